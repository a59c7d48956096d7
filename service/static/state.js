/** What the page is about: the measurement, the fits, and what of them is looked at. */

/**
 * @typedef {{id: string, bytes: number, declared: Record<string, string | boolean | null>, report: any}} Dataset as GET /v1/datasets/{id} gives it
 * @typedef {{id: string, status: string, progress: any, error: string | null, request: any, result: any, job?: string,
 *   rank?: number}} Fit as GET /v1/fits/{id} gives it; or one of several that a job compared, with that job and its rank
 * @typedef {{count: number, stride: number, channels: string[], theta_i_deg: number[], phi_i_deg: number[],
 *   theta_o_deg: number[], phi_o_deg: number[], values: (number | null)[][]}} Samples
 */

export const state = {
  /** @type {Dataset | null} */
  dataset: null,
  /** why there is nothing to fit at the moment, in a sentence: a file is being read, or asks a question */
  pending: "",
  /** @type {Samples | null} of the dataset, once they have come */
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
  /** whether somebody has chosen what is looked at, so that nothing else takes its place unasked */
  looked: false,
};

/** @typedef {"dataset" | "pending" | "samples" | "fits" | "chosen" | "view" | "values"} Topic */

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

/**
 * Make the page about a measurement, or about none, and fits of it: all that was before leaves together.
 * @param {Dataset | null} dataset
 * @param {Fit[]} fits those of another measurement are left out
 */
export function about(dataset, fits = []) {
  state.dataset = dataset;
  state.samples = null;
  state.channel = 0;
  keep(fits);
  changed("dataset");
  changed("samples");
  changed("fits");
  changed("chosen");
}

/** Show these fits of the page's measurement in place of those before. @param {Fit[]} fits */
export function present(fits) {
  keep(fits);
  changed("fits");
  changed("chosen");
}

/** @param {Fit[]} fits */
function keep(fits) {
  state.fits = new Map(fits.filter(belongs).map((fit) => [fit.id, fit]));
  if (!ranked().some((fit) => fit.id === state.chosen)) best();
}

/** @param {Fit} fit @returns {boolean} whether its samples are those of the page; where there are none, nothing is drawn with it */
export function belongs(fit) {
  return state.dataset === null || fit.request.dataset === state.dataset.id;
}

/** Take what a fit of the page has come to; the best is looked at until somebody has looked around. @param {Fit} fit */
export function arrived(fit) {
  if (!state.fits.has(fit.id)) return;
  state.fits.set(fit.id, fit);
  const before = state.chosen;
  if (!state.looked) best();
  changed("fits");
  if (state.chosen !== before) changed("chosen");
}

function best() {
  state.chosen = ranked()[0]?.id ?? null;
  state.values = null;
  state.looked = false;
  clamp();
}

/** Look at a fit, as it was fitted. @param {string} id */
export function choose(id) {
  state.chosen = id;
  state.values = null;
  state.looked = true;
  clamp();
  changed("chosen");
}

function clamp() {
  const fit = chosen();
  if (fit) state.channel = Math.min(state.channel, fit.result.channels.length - 1);
}

/**
 * Look at something else of the fit.
 * @param {Partial<Pick<typeof state, "scale" | "theta" | "phi" | "channel">>} view
 */
export function look(view) {
  Object.assign(state, view, { looked: true });
  changed("view");
  if ("channel" in view) changed("chosen");
}

/** Change values by hand, or take all of it back. @param {Record<string, number | number[]> | null} values */
export function alter(values) {
  state.values = values;
  state.looked = true;
  changed("values");
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
