/** Step 5: the figures of the chosen fit beside the others, and what they show. */

import { once } from "./answers.js";
import { get } from "./api.js";
import { cosineRms, drawAlbedo, drawResiduals, THETAS } from "./curves.js";
import { hemisphere, joined, plane } from "./directions.js";
import { at, complain, made, shown } from "./dom.js";
import { byHand, materialOf, valuesOf } from "./fit.js";
import { tell } from "./hand.js";
import { latest } from "./latest.js";
import { drawPolar, measured, turnable } from "./polar.js";
import { drawSolid, install as turnSolid, paint } from "./solid.js";
import { chosen, look, on, ranked, state } from "./state.js";

const SCALES = { linear: "linear", cube_root: "cube root", log: "log" };

const ENOUGH = 4; // measured points that are worth aiming the light at

const REST = 400; // [ms]

const lobes = latest(20, drawLobes, (error) => complain("look-error", error, "lobes"));
const against = latest(160, drawAgainst, (error) => complain("look-error", error, "curves"));

let shape = ""; // of the controls: which there are

/** Draw whenever what is looked at changes. */
export function install() {
  turnSolid();
  for (const topic of /** @type {const} */ (["chosen", "fits", "samples"])) on(topic, whole);
  for (const topic of /** @type {const} */ (["view", "values"])) on(topic, both);
  new ResizeObserver(lobes).observe(at("polar")); // it is drawn for its size
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { both(); paint(); });
}

function both() {
  lobes();
  against();
}

function whole() {
  const fit = chosen();
  at("look").hidden = fit === null;
  if (fit !== null) {
    aim();
    controls(fit);
  }
  both(); // also without a fit, which ends what is being drawn
}

/** Aim the light where most was measured in its plane, if nothing was where it is and nobody has looked around. */
function aim() {
  const here = (/** @type {number} */ theta) => measured(theta).length;
  if (state.samples === null || state.looked || here(state.theta) > 0) return;
  const angles = Array.from({ length: 18 }, (_, k) => 5 * k);
  const best = angles.reduce((a, b) => (here(b) > here(a) ? b : a), 45);
  if (here(best) >= ENOUGH) state.theta = best;
}

/** @param {"theta" | "phi"} name @returns {number[]} the angles of the light of the samples, each once, at most 40 */
function lights(name) {
  const angles = [...new Set((state.samples?.[`${name}_i_deg`] ?? []).map((theta) => Math.round(theta * 10) / 10))].sort((a, b) => a - b);
  return angles.length > 40 ? [] : angles;
}

/** The controls that the fit calls for; those that are there stay, since one may be in use. @param {import("./state.js").Fit} fit */
function controls(fit) {
  const turns = turnable() || fit.result.material.terms.some((/** @type {any} */ term) => term.options.includes("anisotropic"));
  const needed = JSON.stringify([turns, fit.result.channels, lights("theta"), lights("phi")]);
  if (needed !== shape) {
    shape = needed;
    build(turns, fit.result.channels);
  }
  for (const input of at("controls").querySelectorAll("[type=radio]")) input.checked = input.value === state.scale;
  for (const name of /** @type {const} */ (["theta", "phi"])) {
    const input = document.querySelector(`#light-${name}`);
    if (input instanceof HTMLInputElement && Number(input.value) !== state[name]) input.value = String(state[name]);
    if (input) at(`said-${name}`).textContent = `${shown(state[name])}°`;
  }
  const select = document.querySelector("#channel");
  if (select instanceof HTMLSelectElement) select.value = String(state.channel);
}

/** @param {boolean} turns whether the light has an azimuth @param {string[]} channels */
function build(turns, channels) {
  const focused = document.activeElement?.id;
  const scales = Object.entries(SCALES).map(([value, text]) =>
    made("label", {}, made("input", { type: "radio", name: "scale", id: `scale-${value}`, value, onchange: () => look({ scale: /** @type {any} */ (value) }) }), text),
  );
  const parts = [made("fieldset", {}, made("legend", {}, "Radius"), ...scales), slide("theta", "Light, from the normal", 0, 88)];
  if (turns) parts.push(slide("phi", "Light, azimuth", 0, 355));
  if (channels.length > 1) {
    const options = channels.map((name, k) => made("option", { value: k }, name));
    const select = made("select", { id: "channel", onchange: () => look({ channel: Number(select.value) }) }, ...options);
    parts.push(made("label", {}, "Channel ", select));
  }
  at("controls").replaceChildren(...parts);
  if (focused) document.getElementById(focused)?.focus();
}

/** @param {"theta" | "phi"} name @param {string} text @param {number} low @param {number} high */
function slide(name, text, low, high) {
  const value = made("output", { for: `light-${name}`, id: `said-${name}` });
  const marks = made("datalist", { id: `marks-${name}` }, ...lights(name).map((theta) => made("option", { value: theta })));
  const input = made("input", { type: "range", id: `light-${name}`, min: low, max: high, step: name === "theta" ? 0.5 : 5, list: `marks-${name}` });
  input.value = String(state[name]);
  input.addEventListener("input", () => {
    value.textContent = `${input.value}°`;
    look({ [name]: Number(input.value) });
  });
  return made("label", { class: "slide", for: input.id }, made("span", {}, `${text}: `, value), input, marks);
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
  signal.throwIfAborted();
  const curves = fits.map((one, k) => ({ name: one.result.model, angles: line.angles, f: answers[k].slice(0, line.angles.length), chosen: one === fit }));
  await drawPolar(curves);
  signal.throwIfAborted();
  drawSolid(ball.vectors, answers[fits.indexOf(fit)].slice(line.angles.length));
  complain("look-error", null, "lobes");
}

/** @param {AbortSignal} signal */
async function drawAgainst(signal) {
  const fit = chosen();
  if (fit === null) return;
  const { samples, phi } = state;
  const fits = ranked();
  const integrated = async (/** @type {import("./state.js").Fit} */ one) => {
    const json = { material: materialOf(one, valuesOf(one)), theta_deg: THETAS, phi_deg: phi, tolerance: 1e-3 };
    return (await get("/v1/albedo", { method: "POST", json, signal })).values.map((/** @type {(number | null)[]} */ [value]) => value);
  };
  const albedos = await Promise.all(fits.map((one) => (byHand(one) ? integrated(one) : once(named(one, `albedo ${phi}`), () => integrated(one)))));
  signal.throwIfAborted();
  await drawAlbedo(fits.map((one, k) => ({ name: one.result.model, values: albedos[k], chosen: one === fit })));
  signal.throwIfAborted();
  let [error, fitted] = [NaN, NaN];
  if (samples !== null) {
    const { theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg } = samples;
    const pairs = { theta_i_deg, phi_i_deg, theta_o_deg, phi_o_deg };
    const before = await evaluated(fit, pairs, "samples", signal, fit.result.material.values);
    const now = byHand(fit) ? await evaluated(fit, pairs, "samples", signal) : before;
    signal.throwIfAborted();
    await drawResiduals(now);
    signal.throwIfAborted();
    [error, fitted] = [cosineRms(now), cosineRms(before)];
  }
  complain("look-error", null, "curves");
  if (byHand(fit)) tell("Looking whether it conserves energy …", error, fitted);
  const verdict = await verdictOf(fit, signal);
  signal.throwIfAborted();
  tell(verdict, error, fitted);
}

/** What the certificate says of a fit, or of it with the values set by hand. @param {import("./state.js").Fit} fit @param {AbortSignal} signal */
async function verdictOf(fit, signal) {
  if (!byHand(fit)) return fit.result.certificate.verdict;
  await new Promise((done) => setTimeout(done, REST)); // it takes longer than all else, so that a slider rests first
  signal.throwIfAborted();
  const material = { ...fit.result.material, values: valuesOf(fit) };
  const json = { material, theta_deg: [0], tolerance: 0.1, certificate: true };
  return once(`${fit.id} verdict ${JSON.stringify(state.values)}`, async () => (await get("/v1/albedo", { method: "POST", json, signal })).certificate.verdict);
}

/** The lobe in space of a fit, as it was fitted. @param {import("./state.js").Fit} fit @returns {Promise<{vectors: number[][], f: (number | null)[]}>} */
export async function lobeOf(fit) {
  const { theta, phi } = state;
  const { vectors, pairs } = hemisphere(theta, phi);
  return { vectors, f: await evaluated(fit, pairs, `${theta} ${phi} solid`, undefined, fit.result.material.values) };
}

/**
 * The values of a fit's material, one a pair of directions, with those set by hand or with others that are given.
 * @param {import("./state.js").Fit} fit
 * @param {import("./directions.js").Pairs} pairs
 * @param {string} which names the pairs
 * @param {AbortSignal} [signal]
 * @param {Record<string, number | number[]>} values
 * @returns {Promise<(number | null)[]>}
 */
function evaluated(fit, pairs, which, signal, values = valuesOf(fit)) {
  const json = { material: materialOf(fit, values), ...pairs };
  const asked = async () => (await get("/v1/evaluate", { method: "POST", json, signal })).f.map((/** @type {(number | null)[]} */ [f]) => f);
  return byHand(fit) && values !== fit.result.material.values ? asked() : once(named(fit, which), asked);
}

/** @param {import("./state.js").Fit} fit @param {string} which */
function named(fit, which) {
  return `${fit.id} ${state.channel} ${which}`;
}
