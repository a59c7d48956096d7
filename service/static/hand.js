/** Parameters by hand: a slider and a field each, what the change does to error and energy, and a fit from there. */

import { ofChannel, valuesOf } from "./fit.js";
import { again, submit } from "./jobs.js";
import { at, complain, inPlace, made, shown } from "./dom.js";
import { alter, chosen, hold, on, state } from "./state.js";

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
  const refit = made("button", { type: "button", class: "small primary", id: "again", onclick: fitAgain }, "Fit again from here");
  inPlace(at("hand"), () => at("hand").replaceChildren(
    made("h3", {}, "Parameters by hand"),
    ...sliders,
    made("div", { class: "row" }, back, fit.request.dataset === null ? null : refit),
    made("p", { class: "said", role: "status", id: "hand-said" }, "Move a slider: lobe, albedo, energy and error follow."),
    made("p", { class: "error", role: "alert", id: "hand-error", hidden: true }),
  ));
}

/**
 * @param {import("./state.js").Fit} fit
 * @param {string} key
 */
function slider(fit, key) {
  const value = ofChannel(valuesOf(fit)[key]);
  const box = boxOf(fit, key);
  const fitted = ofChannel(fit.result.material.values[key]);
  let way = track(box, fitted, value);
  const input = made("input", { type: "range", id: `hand-${key}`, min: 0, max: STEPS, step: 1, name: key });
  const number = made("input", { type: "number", id: `number-${key}`, step: "any", min: box.low, max: box.high, "aria-label": `${key}, as a number` });
  const show = (/** @type {number} */ now) => {
    input.value = String(STEPS * way.to(now));
    input.setAttribute("aria-valuetext", shown(now));
    number.value = String(Number(now.toPrecision(4)));
  };
  const set = (/** @type {number} */ now) => {
    const before = valuesOf(fit)[key];
    alter({ ...state.values, [key]: Array.isArray(before) ? before.map((one, k) => (k === state.channel ? now : one)) : now });
  };
  show(value);
  input.addEventListener("input", () => {
    const now = Number(way.from(Number(input.value) / STEPS).toPrecision(6));
    input.setAttribute("aria-valuetext", shown(now));
    number.value = String(Number(now.toPrecision(4)));
    set(now);
  });
  number.addEventListener("change", () => {
    const asked = number.value === "" ? value : Number(number.value);
    const now = Math.min(Math.max(asked, box.low), box.high);
    way = track(box, fitted, now); // the slider goes about it
    show(now);
    set(now);
  });
  const lock = made("input", { type: "checkbox", checked: state.held.has(key), onchange: () => hold(key, lock.checked), "aria-label": `Hold ${key}` });
  return made("div", { class: "slider", title: fit.result.units[key] ?? key },
    made("label", { for: input.id }, key), number, made("label", { class: "lock" }, lock, "hold"), input);
}

/**
 * Where a parameter may go: its box in the registry.
 * @param {import("./state.js").Fit} fit
 * @param {string} key
 * @returns {{low: number, high: number, scale: string}}
 */
function boxOf(fit, key) {
  const [label, name] = key.split(".");
  const term = fit.result.material.terms.find((/** @type {any} */ one) => one.label === label);
  const model = state.models.find((one) => one.name === term?.model);
  const fits = (/** @type {any} */ one) => one.name === name && one.where.every((/** @type {string} */ word) => term.options.includes(word));
  return model?.parameters.find(fits) ?? { low: 0, high: 1, scale: "linear" };
}

/**
 * The way of a slider, 0 to 1, over the part of a box about the value that was fitted and the one that there is now.
 * @param {{low: number, high: number, scale: string}} box
 * @param {number} fitted
 * @param {number} now
 * @returns {{to: (x: number) => number, from: (share: number) => number}}
 */
function track(box, fitted, now) {
  if (box.scale === "log") {
    const [low, high] = [Math.max(box.low, Math.min(fitted, now) / 10), Math.min(box.high, Math.max(fitted, now) * 10)].map(Math.log);
    return { to: (x) => (Math.log(x) - low) / (high - low), from: (share) => Math.exp(low + share * (high - low)) };
  }
  const wide = Math.min(box.high - box.low, Math.max(4 * (Math.max(fitted, now) - box.low), 0.1 * (box.high - box.low)));
  return { to: (x) => (x - box.low) / wide, from: (share) => box.low + share * wide };
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
  if (button.hasAttribute("aria-disabled")) return; // a second press would ask for the same
  button.setAttribute("aria-disabled", "true");
  const values = Object.entries(valuesOf(fit));
  const fixed = Object.fromEntries(values.filter(([key]) => state.held.has(key)));
  const start = Object.fromEntries(values.filter(([key]) => !state.held.has(key)));
  try {
    await submit([again(fit, { fixed, starts: [start] })]);
  } catch (error) {
    complain("hand-error", error);
  } finally {
    button.removeAttribute("aria-disabled");
  }
}

/**
 * Say what the values mean: whether the material could exist, and how far it is from the samples.
 * @param {string} verdict of its certificate
 * @param {number} error now [1/sr]
 * @param {number} fitted as it was fitted [1/sr]
 */
export function tell(verdict, error, fitted) {
  const channels = chosen()?.result.channels ?? [];
  const where = channels.length > 1 ? ` in channel ${channels[state.channel]}` : "";
  const much = Number.isFinite(error) ? ` Error (cosine_rms)${where} ${shown(error)}${state.values === null ? "" : `, fitted ${shown(fitted)}`} 1/sr.` : "";
  at("hand-said").textContent = verdict + much;
}
