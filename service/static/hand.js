/** Parameters by hand: a slider each, what the change does to error and energy, and a fit from there. */

import { submit } from "./jobs.js";
import { at, complain, made, shown } from "./dom.js";
import { alter, chosen, ofChannel, on, state, valuesOf } from "./state.js";

const STEPS = 500;

/** Build the sliders for the chosen fit. */
export function install() {
  on("chosen", build);
}

function build() {
  const fit = chosen();
  if (fit === null) return;
  const sliders = Object.keys(fit.result.material.values).map((key) => slider(fit, key));
  const back = made("button", { type: "button", class: "small", id: "as-fitted", onclick: reset }, "Back to the fit");
  const again = made("button", { type: "button", class: "small primary", id: "again", onclick: fitAgain }, "Fit again from here");
  at("hand").replaceChildren(
    made("h3", {}, "Parameters by hand"),
    ...sliders,
    made("div", { class: "row" }, back, fit.request.dataset === null ? null : again),
    made("p", { class: "said", role: "status", id: "hand-said" }, "Move a slider: lobe, albedo, energy and error follow."),
    made("p", { class: "error", role: "alert", id: "hand-error", hidden: true }),
  );
}

/**
 * @param {import("./state.js").Fit} fit
 * @param {string} key
 */
function slider(fit, key) {
  const value = ofChannel(valuesOf(fit)[key]);
  const { low, high, log } = range(fit, key, ofChannel(fit.result.material.values[key]));
  const to = (/** @type {number} */ x) => (log ? Math.log(x) : x);
  const from = (/** @type {number} */ x) => (log ? Math.exp(x) : x);
  const number = made("output", {}, shown(value));
  const input = made("input", { type: "range", id: `hand-${key}`, min: 0, max: STEPS, step: 1, name: key, "aria-valuetext": shown(value) });
  input.value = String((STEPS * (to(value) - to(low))) / (to(high) - to(low)));
  input.addEventListener("input", () => {
    const chosenValue = Number(from(to(low) + ((to(high) - to(low)) * Number(input.value)) / STEPS).toPrecision(6));
    number.textContent = shown(chosenValue);
    input.setAttribute("aria-valuetext", shown(chosenValue));
    const before = valuesOf(fit)[key];
    const after = Array.isArray(before) ? before.map((one, k) => (k === state.channel ? chosenValue : one)) : chosenValue;
    alter({ ...state.values, [key]: after });
  });
  return made("label", { for: input.id, title: fit.result.units[key] ?? key }, made("b", {}, key), number, input);
}

/**
 * Where a parameter may go: its box in the registry, about the value that was fitted.
 * @param {import("./state.js").Fit} fit
 * @param {string} key
 * @param {number} value
 */
function range(fit, key, value) {
  const [label, name] = key.split(".");
  const term = fit.result.material.terms.find((/** @type {any} */ one) => one.label === label);
  const model = state.models.find((one) => one.name === term?.model);
  const fits = (/** @type {any} */ one) => one.name === name && one.where.every((/** @type {string} */ word) => term.options.includes(word));
  const box = model?.parameters.find(fits) ?? { low: 0, high: 1, scale: "linear" };
  if (box.scale === "log") return { low: Math.max(box.low, value / 10), high: Math.min(box.high, value * 10), log: true };
  const wide = Math.max(4 * (value - box.low), 0.02 * (box.high - box.low));
  return { low: box.low, high: Math.min(box.high, box.low + wide), log: false };
}

function reset() {
  alter(null);
  build();
  at("as-fitted").focus();
}

async function fitAgain() {
  const fit = chosen();
  if (fit === null) return;
  complain("hand-error", null);
  const button = at("again");
  button.disabled = true; // a second press would ask for the same
  const { samples, model, models, ...options } = fit.request;
  const free = Object.entries(valuesOf(fit)).filter(([key]) => !(key in options.fixed));
  const given = Object.fromEntries(Object.entries(options).filter(([, value]) => value !== null));
  try {
    await submit([{ ...given, model: model === "auto" ? fit.result.model : model, starts: [Object.fromEntries(free)] }]);
  } catch (error) {
    complain("hand-error", error);
  } finally {
    button.disabled = false;
  }
}

/**
 * Say what the values mean: whether the material could exist, and how far it is from the samples.
 * @param {string} verdict of its certificate
 * @param {number} error now [1/sr]
 * @param {number} fitted as it was fitted [1/sr]
 */
export function tell(verdict, error, fitted) {
  const much = Number.isFinite(error) ? ` Error (cosine_rms) ${shown(error)}${state.values === null ? "" : `, fitted ${shown(fitted)}`} 1/sr.` : "";
  at("hand-said").textContent = verdict + much;
}
