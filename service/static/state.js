/** What the page is about: the measurement, the fits, and what of them is looked at. */

/**
 * @typedef {{id: string, bytes: number, report: any}} Dataset as GET /v1/datasets/{id} gives it
 * @typedef {{id: string, status: string, progress: any, error: string | null, request: any, result: any, job?: string,
 *   rank?: number}} Fit as GET /v1/fits/{id} gives it; or one of several that a job compared, with that job and its rank
 * @typedef {{count: number, stride: number, channels: string[], theta_i_deg: number[], phi_i_deg: number[],
 *   theta_o_deg: number[], phi_o_deg: number[], values: (number | null)[][]}} Samples
 */

export const state = {
  /** @type {Dataset | null} */
  dataset: null,
  /** @type {Samples | null} */
  samples: null,
  /** @type {any[]} the registry of models */
  models: [],
  /** @type {Map<string, Fit>} the fits on the page by id, in the order in which they were asked for */
  fits: new Map(),
  /** @type {string | null} id of the fit that is looked at, one of `ranked` */
  chosen: null,
  channel: 0,
  /** @type {"linear" | "cube_root" | "log"} */
  scale: "cube_root",
  theta: 45,
  phi: 0,
  /** @type {Record<string, number | number[]> | null} values changed by hand; null where they are the fit's */
  values: null,
};

/** @typedef {"dataset" | "samples" | "fits" | "chosen" | "view" | "values"} Topic */

/** @type {Map<Topic, (() => void)[]>} */
const listeners = new Map();

/**
 * Call back whenever something of a topic has changed.
 * @param {Topic} topic
 * @param {() => void} listener
 */
export function on(topic, listener) {
  listeners.set(topic, [...(listeners.get(topic) ?? []), listener]);
}

/** @param {Topic} topic */
export function changed(topic) {
  for (const listener of listeners.get(topic) ?? []) listener();
}

/** @returns {Fit | null} the fit that is looked at, once it has a result */
export function chosen() {
  return ranked().find((fit) => fit.id === state.chosen) ?? null;
}

/** @returns {Fit[]} those with a result, that with the lowest value of their loss first */
export function ranked() {
  const done = [...state.fits.values()].filter((fit) => fit.result).flatMap(parts);
  return done.sort((a, b) => (a.result.objective ?? Infinity) - (b.result.objective ?? Infinity));
}

/** @type {WeakMap<Fit, Fit[]>} */
const compared = new WeakMap();

/** @param {Fit} fit @returns {Fit[]} the fits of a job that compared several models, or the lone one */
function parts(fit) {
  if (!fit.result.comparison) return [fit];
  const found = compared.get(fit) ?? fit.result.comparison.ranking.map((/** @type {any} */ one) => ({
    ...fit, id: `${fit.id}.${one.rank}`, job: fit.id, rank: one.rank, request: { ...fit.request, model: one.model, models: null }, result: one.fit,
  }));
  compared.set(fit, found);
  return found;
}

/** @param {Fit} fit @returns {string} the text of the model that was asked for, or of the several that were compared */
export function nameOf(fit) {
  return fit.request.model ?? fit.request.models.join(", ");
}

/** Look at a fit, as it was fitted. @param {string} id */
export function choose(id) {
  state.chosen = id;
  state.values = null;
  const channels = chosen()?.result.channels.length ?? 1;
  state.channel = Math.min(state.channel, channels - 1);
  changed("chosen");
}

/** @param {Fit} fit @returns {Record<string, number | number[]>} the values of its material, those set by hand included */
export function valuesOf(fit) {
  return { ...fit.result.material.values, ...(fit.id === state.chosen ? state.values : null) };
}

/** @param {number | number[]} value @returns {number} that of the channel which is looked at */
export function ofChannel(value) {
  return Array.isArray(value) ? value[Math.min(state.channel, value.length - 1)] : value;
}

/** @param {Fit} fit @returns {any} the JSON of its material in the channel which is looked at: one of 31 takes 1/31 of the time */
export function materialOf(fit) {
  const values = Object.entries(valuesOf(fit)).map(([key, value]) => [key, ofChannel(value)]);
  return { ...fit.result.material, values: Object.fromEntries(values) };
}
