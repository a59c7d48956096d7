/** Step 5: the figures of the chosen fit beside the others, and what they show. */

import { get } from "./api.js";
import { cosineRms, drawAlbedo, drawResiduals, THETAS } from "./curves.js";
import { hemisphere, joined, plane } from "./directions.js";
import { at, complain, made, shown } from "./dom.js";
import { tell } from "./hand.js";
import { latest } from "./latest.js";
import { drawPolar, measured, turnable } from "./polar.js";
import { drawSolid, install as turnSolid, paint } from "./solid.js";
import { changed, chosen, materialOf, on, ranked, state } from "./state.js";

const SCALES = { linear: "linear", cube_root: "cube root", log: "log" };

const ENOUGH = 4; // measured points that are worth aiming the light at

/** @type {Map<string, any>} answers about fits as they were fitted, which do not change */
const known = new Map();

const lobes = latest(20, drawLobes, (error) => complain("look-error", error));
const against = latest(160, drawAgainst, (error) => complain("look-error", error));

/** Draw whenever what is looked at changes. */
export function install() {
  turnSolid();
  for (const topic of /** @type {const} */ (["chosen", "fits"])) on(topic, () => (topic === "chosen" || state.values === null) && whole());
  on("samples", whole);
  on("view", () => { lobes(); against(); });
  on("values", () => { lobes(); against(); });
  new ResizeObserver(lobes).observe(at("polar")); // it is drawn for its size
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { lobes(); against(); paint(); });
}

function whole() {
  const fit = chosen();
  at("look").hidden = fit === null;
  if (fit === null) return;
  complain("look-error", null);
  aim();
  controls(fit);
  lobes();
  against();
}

/** Aim the light where most was measured in its plane, if nothing was where it is. */
function aim() {
  const here = (/** @type {number} */ theta) => measured(theta).length;
  if (state.samples === null || here(state.theta) > 0) return;
  const angles = Array.from({ length: 18 }, (_, k) => 5 * k);
  const best = angles.reduce((a, b) => (here(b) > here(a) ? b : a), 45);
  if (here(best) >= ENOUGH) state.theta = best;
}

/** @returns {number[]} the angles of incidence of the samples, each once, at most 40 */
function incidences() {
  const angles = [...new Set((state.samples?.theta_i_deg ?? []).map((theta) => Math.round(theta * 10) / 10))].sort((a, b) => a - b);
  return angles.length > 40 ? [] : angles;
}

/** @param {import("./state.js").Fit} fit */
function controls(fit) {
  const focused = document.activeElement?.id;
  const scales = Object.entries(SCALES).map(([value, text]) =>
    made("label", {}, made("input", { type: "radio", name: "scale", id: `scale-${value}`, value, checked: state.scale === value, onchange: () => set("scale", value) }), text),
  );
  const parts = [made("fieldset", {}, made("legend", {}, "Radius"), ...scales), slide("theta", "Light, from the normal", 0, 88)];
  if (turnable() || fit.result.material.terms.some((/** @type {any} */ term) => term.options.includes("anisotropic")))
    parts.push(slide("phi", "Light, azimuth", 0, 355));
  if (fit.result.channels.length > 1) {
    const options = fit.result.channels.map((/** @type {string} */ name, /** @type {number} */ k) => made("option", { value: k, selected: k === state.channel }, name));
    const select = made("select", { id: "channel", onchange: () => { set("channel", Number(select.value)); changed("chosen"); } }, ...options);
    parts.push(made("label", {}, "Channel ", select));
  }
  at("controls").replaceChildren(...parts);
  if (focused) document.getElementById(focused)?.focus();
}

/** @param {"theta" | "phi"} name @param {string} text @param {number} low @param {number} high */
function slide(name, text, low, high) {
  const value = made("output", { for: `light-${name}` }, `${shown(state[name])}°`);
  const marks = made("datalist", { id: `marks-${name}` }, ...(name === "theta" ? incidences() : []).map((theta) => made("option", { value: theta })));
  const input = made("input", { type: "range", id: `light-${name}`, min: low, max: high, step: name === "theta" ? 0.5 : 5, list: `marks-${name}` });
  input.value = String(state[name]);
  input.addEventListener("input", () => {
    value.textContent = `${input.value}°`;
    set(name, Number(input.value));
  });
  return made("label", { class: "slide", for: input.id }, made("span", {}, `${text}: `, value), input, marks);
}

/** @param {"scale" | "theta" | "phi" | "channel"} name @param {any} value */
function set(name, value) {
  /** @type {any} */ (state)[name] = value;
  changed("view");
}

/** @param {AbortSignal} signal */
async function drawLobes(signal) {
  const fit = chosen();
  if (fit === null) return;
  const line = plane(state.theta, state.phi);
  const ball = hemisphere(state.theta, state.phi);
  const fits = ranked();
  const answers = await Promise.all(
    fits.map((one) => evaluated(one, one === fit ? joined(line.pairs, ball.pairs) : line.pairs, `${state.theta} ${state.phi} ${one === fit}`, signal)),
  );
  if (signal.aborted) return;
  const curves = fits.map((one, k) => ({ name: one.result.model, angles: line.angles, f: answers[k].slice(0, line.angles.length), chosen: one === fit }));
  await drawPolar(curves);
  drawSolid(ball.vectors, answers[fits.indexOf(fit)].slice(line.angles.length));
  complain("look-error", null);
}

/** @param {AbortSignal} signal */
async function drawAgainst(signal) {
  const fit = chosen();
  if (fit === null) return;
  const fits = ranked();
  const json = (/** @type {import("./state.js").Fit} */ one) => ({ material: materialOf(one), theta_deg: THETAS, phi_deg: state.phi, tolerance: 1e-3 });
  const integrated = async (/** @type {import("./state.js").Fit} */ one) => (await get("/v1/albedo", { method: "POST", json: json(one), signal })).values.map((/** @type {(number | null)[]} */ [value]) => value);
  const albedos = await Promise.all(fits.map((one) => remembered(one, `albedo ${state.phi}`, () => integrated(one))));
  if (signal.aborted) return;
  await drawAlbedo(fits.map((one, k) => ({ name: one.result.model, values: albedos[k], chosen: one === fit })));
  const { samples } = state;
  let [error, fitted] = [NaN, NaN];
  if (samples !== null) {
    const { theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg } = samples;
    const f = await evaluated(fit, { theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg }, "samples", signal);
    if (signal.aborted) return;
    await drawResiduals(f);
    error = cosineRms(f);
    fitted = cosineRms(known.get(nameOf(fit, "samples")) ?? f);
  }
  tell(albedos[fits.indexOf(fit)], error, fitted);
}

/**
 * The values of a fit's material, one a pair of directions.
 * @param {import("./state.js").Fit} fit
 * @param {import("./directions.js").Pairs} pairs
 * @param {string} which names the pairs
 * @param {AbortSignal} signal
 * @returns {Promise<(number | null)[]>}
 */
function evaluated(fit, pairs, which, signal) {
  const json = { material: materialOf(fit), ...pairs };
  return remembered(fit, which, async () => (await get("/v1/evaluate", { method: "POST", json, signal })).f.map((/** @type {(number | null)[]} */ [f]) => f));
}

/** @param {import("./state.js").Fit} fit @param {string} which */
function nameOf(fit, which) {
  return `${fit.id} ${state.channel} ${which}`;
}

/**
 * The answer about a fit, asked for once; always asked for where its values were changed by hand.
 * @param {import("./state.js").Fit} fit
 * @param {string} which
 * @param {() => Promise<any>} answer
 */
async function remembered(fit, which, answer) {
  if (state.values !== null && fit.id === state.chosen) return answer();
  const name = nameOf(fit, which);
  if (!known.has(name)) {
    const found = await answer();
    if (known.size > 400) known.clear();
    known.set(name, found);
  }
  return known.get(name);
}
