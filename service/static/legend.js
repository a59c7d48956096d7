/** Which curve is whose: a button for each fitted material, which also switches to it. */

import { at, breakable, inPlace, made } from "./dom.js";
import { SERIES } from "./figures.js";
import { originOf } from "./fit.js";
import { choose, on, ranked, state } from "./state.js";

/** Name the materials that are drawn whenever there are others. */
export function install() {
  for (const topic of /** @type {const} */ (["fits", "chosen"])) on(topic, show);
}

function show() {
  const buttons = ranked().map((fit, rank) =>
    made("button", { type: "button", class: "small", "aria-pressed": String(fit.id === state.chosen), "data-does": `look ${fit.id}`, onclick: () => choose(fit.id) },
      made("span", { class: `swatch swatch-${rank % SERIES}` }), made("span", { class: "code" }, breakable(fit.result.model)), made("span", { class: "hint" }, originOf(fit))),
  );
  inPlace(at("legend"), () => at("legend").replaceChildren(...buttons));
}
