/** What the page is about: the measurement, the fits, and what of them is looked at. */

import { parts } from "./parts.js";

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
  /** @type {Set<string>} ids of those that were asked for last */
  asked: new Set(),
  /** @type {string | null} id of the fit that is looked at, one of `ranked` */
  chosen: null,
  channel: 0,
  /** @type {"linear" | "cube_root" | "log"} */
  scale: "cube_root",
  theta: 45,
  phi: 0,
  /** @type {Record<string, number | number[]> | null} values changed by hand; null where they are the fit's */
  values: null,
  /** @type {Set<string>} keys that keep their value when it is fitted again */
  held: new Set(),
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
  keep(fits, new Set(fits.map((fit) => fit.id)));
  changed("dataset");
  changed("samples");
  changed("fits");
  changed("chosen");
}

/**
 * Show these fits of the page's measurement in place of those before.
 * @param {Fit[]} fits
 * @param {Set<string>} asked ids of those that were asked for last
 */
export function present(fits, asked = new Set(fits.map((fit) => fit.id))) {
  keep(fits, asked);
  changed("fits");
  changed("chosen");
}

/** Show fits of the page's measurement beside those before; the best of them is looked at, once there is one. @param {Fit[]} fits */
export function add(fits) {
  state.looked = false;
  const asked = new Set(fits.map((fit) => fit.id));
  present([...[...state.fits.values()].filter((fit) => !asked.has(fit.id)), ...fits], asked);
  if (fits.some((fit) => fit.result)) {
    best();
    changed("chosen");
  }
}

/** Take a fit off the page. @param {string} id */
export function takeOff(id) {
  present([...state.fits.values()].filter((fit) => fit.id !== id), state.asked);
}

/** @param {Fit[]} fits @param {Set<string>} asked */
function keep(fits, asked) {
  state.fits = new Map(fits.filter(belongs).map((fit) => [fit.id, fit]));
  state.asked = asked;
  if (!ranked().some((fit) => fit.id === state.chosen)) best();
}

/** @param {Fit} fit @returns {boolean} whether its samples are those of the page; where there are none, nothing is drawn with it */
export function belongs(fit) {
  return state.dataset === null || fit.request.dataset === state.dataset.id;
}

/** Take what a fit of the page has come to; the best of those asked for last is looked at until somebody has looked around. @param {Fit} fit */
export function arrived(fit) {
  if (!state.fits.has(fit.id)) return;
  state.fits.set(fit.id, fit);
  const before = state.chosen;
  if (fit.result && !state.looked) best();
  changed("fits");
  if (state.chosen !== before) changed("chosen");
}

function best() {
  const all = ranked();
  const first = all.find((fit) => state.asked.has(fit.job ?? fit.id)) ?? all[0];
  settle(first?.id ?? null);
  state.looked = false;
}

/** @param {string | null} id of the fit that is looked at from now on, as it was fitted */
function settle(id) {
  state.chosen = id;
  state.values = null;
  const fit = chosen();
  state.held = new Set(Object.keys(fit?.request.fixed ?? {}));
  if (fit) state.channel = Math.min(state.channel, fit.result.channels.length - 1);
}

/** Look at a fit, as it was fitted. @param {string} id */
export function choose(id) {
  settle(id);
  state.looked = true;
  changed("chosen");
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

/** Let a parameter keep its value when it is fitted again, or no longer. @param {string} key @param {boolean} held */
export function hold(key, held) {
  if (held) state.held.add(key);
  else state.held.delete(key);
  state.looked = true;
}

/** @returns {Fit | null} the fit that is looked at, once it has a result */
export function chosen() {
  return ranked().find((fit) => fit.id === state.chosen) ?? null;
}

/** @returns {Fit[]} those with a result, the best by `yardstick` first */
export function ranked() {
  const done = [...state.fits.values()].filter((fit) => fit.result).flatMap(parts);
  const { loss, same } = yardstick();
  const size = (/** @type {Fit} */ fit) => (same ? fit.result.objective : fit.result.errors[loss]) ?? Infinity;
  return done.sort((a, b) => size(a) - size(b));
}

/**
 * By what the fits of the page are ranked: what all of them minimised, or the error under the loss asked for last.
 * @returns {{loss: string, same: boolean}}
 */
export function yardstick() {
  const minimised = [...state.fits.values()].map(({ request }) => `${request.loss} ${request.robust} ${request.robust_scale} ${request.max_theta_deg}`);
  return { loss: [...state.fits.values()].at(-1)?.request.loss, same: new Set(minimised).size < 2 };
}
