/** What a fit is called, how it was asked for, and the values of its material. */

import { state } from "./state.js";

/** @typedef {import("./state.js").Fit} Fit */

/** @param {Fit} fit @returns {string} the text of the model that was asked for, or of the several that were compared */
export function nameOf(fit) {
  return fit.request.model ?? fit.request.models.join(", ");
}

/** @param {Fit} fit @returns {string} how it was asked for beyond its model, where fits of one model differ; "" for plainly */
export function mannerOf({ request }) {
  const losses = new Set([...state.fits.values()].map((fit) => fit.request.loss));
  const held = Object.keys(request.fixed);
  return [
    losses.size > 1 ? `${request.loss} loss` : "",
    request.starts.length > 0 ? "from values by hand" : "",
    held.length > 0 ? `${held.join(", ")} held` : "",
    request.conserve_energy ? "albedo kept at 1 or below" : "",
  ].filter(Boolean).join("; ");
}

/** @param {Fit} fit with a result @returns {string} how it came about, beside the model that came out; "" for plainly */
export function originOf(fit) {
  return [fit.request.model === "auto" ? "chosen by auto" : "", mannerOf(fit)].filter(Boolean).join("; ");
}

/** @param {Fit} fit @returns {Record<string, number | number[]>} the values of its material, those set by hand included */
export function valuesOf(fit) {
  return { ...fit.result.material.values, ...(byHand(fit) ? state.values : null) };
}

/** @param {Fit} fit @returns {boolean} whether its values are other than the fit's */
export function byHand(fit) {
  return state.values !== null && fit.id === state.chosen;
}

/** @param {number | number[]} value @returns {number} that of the channel which is looked at */
export function ofChannel(value) {
  return Array.isArray(value) ? value[Math.min(state.channel, value.length - 1)] : value;
}

/**
 * The JSON of a fit's material with those values, in the channel which is looked at: one of 31 takes 1/31 of the time.
 * @param {Fit} fit
 * @param {Record<string, number | number[]>} values
 */
export function materialOf(fit, values) {
  return { ...fit.result.material, values: Object.fromEntries(Object.entries(values).map(([key, value]) => [key, ofChannel(value)])) };
}
