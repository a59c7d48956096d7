/** Lit spheres: one of each fitted material, side by side, and one that follows the sliders. */

import { ask } from "./api.js";
import { at, complain, made } from "./dom.js";
import { SERIES } from "./figures.js";
import { latest } from "./latest.js";
import { choose, chosen, on, ranked, state, valuesOf } from "./state.js";

const SIZE = 200; // pixels, shown at half of it or more

/** @type {Map<string, ImageBitmap>} spheres of fits as they were fitted */
const known = new Map();

const all = latest(30, drawAll, (error) => complain("result-error", error));
const own = latest(30, drawOwn, (error) => complain("look-error", error));

/** Draw whenever there are other fits, another channel or other values. */
export function install() {
  on("fits", all);
  on("chosen", () => { all(); own(); });
  on("values", own);
}

/** @param {AbortSignal} signal */
async function drawAll(signal) {
  const fits = ranked();
  const images = await Promise.all(fits.map((fit) => sphereOf(fit, signal)));
  if (signal.aborted) return;
  const focused = at("spheres").contains(document.activeElement);
  at("spheres").replaceChildren(...fits.map((fit, k) => card(fit, k, images[k])));
  if (focused) at("spheres").querySelector('[aria-pressed="true"]')?.focus();
}

/** A sphere that is pressed to look at its fit. @param {import("./state.js").Fit} fit @param {number} rank from 0 @param {ImageBitmap} image */
function card(fit, rank, image) {
  const name = made("span", { class: "code" }, made("span", { class: `swatch swatch-${rank % SERIES}` }), `${rank + 1}. ${fit.result.model}`);
  const button = made("button", { type: "button", class: "card-of-sphere", "aria-pressed": String(fit.id === state.chosen), onclick: () => choose(fit.id) }, canvas(image), name);
  return made("li", {}, button);
}

/** @param {AbortSignal} signal */
async function drawOwn(signal) {
  const fit = chosen();
  if (fit === null) return;
  const image = await sphereOf(fit, signal);
  if (signal.aborted) return;
  paint(at("sphere"), image);
}

/**
 * The picture of a fit's material; asked for once, and always where its values were changed by hand.
 * @param {import("./state.js").Fit} fit
 * @param {AbortSignal} signal
 * @returns {Promise<ImageBitmap>}
 */
async function sphereOf(fit, signal) {
  const byHand = state.values !== null && fit.id === state.chosen;
  const name = `${fit.id} ${state.channel}`;
  const before = byHand ? undefined : known.get(name);
  if (before) return before;
  const material = { ...fit.result.material, values: valuesOf(fit) };
  const json = { material, channels: fit.result.channels, channel: state.channel, size: SIZE };
  const answer = await ask("/v1/sphere", { method: "POST", json, signal });
  const image = await createImageBitmap(await answer.blob());
  if (!byHand) known.set(name, image);
  return image;
}

/** @param {ImageBitmap} image */
function canvas(image) {
  const element = made("canvas", { class: "ball", "aria-hidden": "true" });
  paint(element, image);
  return element;
}

/** @param {HTMLCanvasElement} element @param {ImageBitmap} image */
function paint(element, image) {
  [element.width, element.height] = [SIZE, SIZE];
  element.getContext("2d")?.drawImage(image, 0, 0);
}
