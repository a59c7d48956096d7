/** Lit spheres: one of each fitted material, side by side, and one that follows the sliders. */

import { ask } from "./api.js";
import { at, complain, made } from "./dom.js";
import { SERIES } from "./figures.js";
import { latest } from "./latest.js";
import { choose, chosen, on, ranked, state, valuesOf } from "./state.js";

const SIZE = 200; // pixels, shown at half of it or more

const MOST = 200; // pictures that are kept

/** @type {Map<string, ImageBitmap>} spheres of fits as they were fitted */
const known = new Map();

const all = latest(30, drawAll, (error) => complain("result-error", error));
const own = latest(150, drawOwn, (error) => complain("look-error", error));

/** Draw whenever there are other fits, another channel or other values. */
export function install() {
  on("fits", all);
  on("chosen", () => { all(); own(); });
  on("values", own);
}

/** @param {AbortSignal} signal */
async function drawAll(signal) {
  const fits = ranked();
  const cards = fits.map(card);
  const focused = at("spheres").contains(document.activeElement);
  at("spheres").replaceChildren(...cards.map(({ item }) => item));
  if (focused) at("spheres").querySelector('[aria-pressed="true"]')?.focus();
  await Promise.all(fits.map(async (fit, k) => paint(cards[k].canvas, await sphereOf(fit, signal))));
  complain("result-error", null);
}

/** A sphere that is pressed to look at its fit, empty at first. @param {import("./state.js").Fit} fit @param {number} rank from 0 */
function card(fit, rank) {
  const canvas = made("canvas", { class: "ball", "aria-hidden": "true" });
  const name = made("span", { class: "code" }, made("span", { class: `swatch swatch-${rank % SERIES}` }), `${rank + 1}. ${fit.result.model}`);
  const button = made("button", { type: "button", class: "card-of-sphere", "aria-pressed": String(fit.id === state.chosen), onclick: () => choose(fit.id) }, canvas, name);
  return { item: made("li", {}, button), canvas };
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
  if (known.size > MOST) known.clear();
  const material = { ...fit.result.material, values: valuesOf(fit) };
  const json = { material, channels: fit.result.channels, channel: state.channel, size: SIZE };
  const answer = await ask("/v1/sphere", { method: "POST", json, signal });
  const image = await createImageBitmap(await answer.blob());
  if (!byHand) known.set(name, image);
  return image;
}

/** @param {HTMLCanvasElement} element @param {ImageBitmap} image */
function paint(element, image) {
  [element.width, element.height] = [SIZE, SIZE];
  element.getContext("2d")?.drawImage(image, 0, 0);
}
