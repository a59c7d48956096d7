/** Lit spheres: one of each fitted material, side by side, and one that follows the sliders. */

import { once } from "./answers.js";
import { ask } from "./api.js";
import { at, breakable, complain, made } from "./dom.js";
import { SERIES } from "./figures.js";
import { byHand, originOf, valuesOf } from "./fit.js";
import { latest } from "./latest.js";
import { choose, chosen, on, ranked, state } from "./state.js";

const SIZE = 200; // pixels, shown at half of it or more

/** @type {Map<string, {item: HTMLElement, canvas: HTMLCanvasElement, name: HTMLElement}>} the spheres on the page by the fit's id */
const cards = new Map();

const all = latest(30, drawAll, (error) => complain("result-error", error));
const own = latest(150, drawOwn, (error) => complain("look-error", error, "sphere"));

/** Draw whenever there are other fits, another channel or other values. */
export function install() {
  on("fits", all);
  on("chosen", () => { all(); own(); });
  on("values", own);
}

/** @param {AbortSignal} signal */
async function drawAll(signal) {
  const fits = ranked();
  for (const id of cards.keys()) if (!fits.some((fit) => fit.id === id)) cards.delete(id);
  const wanted = fits.map((fit, rank) => {
    const { item, name } = cards.get(fit.id) ?? card(fit);
    name.replaceChildren(made("span", { class: `swatch swatch-${rank % SERIES}` }), `${rank + 1}. `, breakable(fit.result.model), " ", made("span", { class: "hint" }, originOf(fit)));
    item.firstElementChild?.setAttribute("aria-pressed", String(fit.id === state.chosen));
    return item;
  });
  const list = at("spheres");
  if (wanted.length !== list.childElementCount || wanted.some((item, k) => item !== list.children[k])) list.replaceChildren(...wanted);
  await Promise.all(fits.map(async (fit) => {
    const image = await sphereOf(fit, signal);
    if (!signal.aborted) paint(/** @type {any} */ (cards.get(fit.id)).canvas, image);
  }));
  complain("result-error", null);
}

/** A sphere that is pressed to look at its fit, empty at first. @param {import("./state.js").Fit} fit */
function card(fit) {
  const canvas = made("canvas", { class: "ball", "aria-hidden": "true" });
  const name = made("span", { class: "code" });
  const found = { item: made("li", {}, made("button", { type: "button", class: "card-of-sphere", onclick: () => choose(fit.id) }, canvas, name)), canvas, name };
  cards.set(fit.id, found);
  return found;
}

/** @param {AbortSignal} signal */
async function drawOwn(signal) {
  const fit = chosen();
  if (fit === null) return;
  const image = byHand(fit) ? await createImageBitmap(await pictured(fit, valuesOf(fit), signal)) : await sphereOf(fit, signal);
  signal.throwIfAborted();
  paint(at("sphere"), image);
  complain("look-error", null, "sphere");
}

/** The sphere of a fit, as it was fitted. @param {import("./state.js").Fit} fit @param {AbortSignal} signal @returns {Promise<ImageBitmap>} */
function sphereOf(fit, signal) {
  return once(`${fit.id} ${state.channel} sphere`, async () => createImageBitmap(await pictured(fit, fit.result.material.values, signal)));
}

/**
 * A picture of a fit's material with those values, as a PNG file.
 * @param {import("./state.js").Fit} fit
 * @param {Record<string, number | number[]>} values
 * @param {AbortSignal} [signal]
 * @param {number} size in pixels
 * @returns {Promise<Blob>}
 */
export async function pictured(fit, values, signal, size = SIZE) {
  const { channels, material } = fit.result;
  const json = { material: { ...material, values }, channels, channel: state.channel, size };
  return (await ask("/v1/sphere", { method: "POST", json, signal })).blob();
}

/** @param {HTMLCanvasElement} element @param {ImageBitmap} image */
function paint(element, image) {
  [element.width, element.height] = [SIZE, SIZE];
  element.getContext("2d")?.drawImage(image, 0, 0);
}
