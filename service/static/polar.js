/** The lobes in the plane of incidence, with the points that were measured there. */

import { apart } from "./directions.js";
import { at, shown } from "./dom.js";
import { colours, draw } from "./figures.js";
import { radius, rings } from "./scale.js";
import { state } from "./state.js";

const SPOKES = [-90, -60, -30, 0, 30, 60, 90]; // degrees
const MARGIN = { l: 8, r: 8, t: 6, b: 18 }; // pixels
const NEAR = 3; // a measured point is drawn where its light is so close to the one chosen [degrees]

/** @typedef {{name: string, angles: number[], f: (number | null)[], chosen: boolean}} Curve */

/**
 * Draw the curves, the chosen one last and bold.
 * @param {Curve[]} curves
 */
export async function drawPolar(curves) {
  const { series, soft, line, ink } = colours();
  const points = measured(state.theta);
  const top = Math.max(...curves.flatMap((curve) => curve.f.map((value) => value ?? 0)), ...points.map((point) => point.value));
  const r = radius(state.scale, top);
  const traces = curves.map(({ name, angles, f, chosen }, k) => ({
    type: "scatter", mode: "lines", name, ...placed(angles, f.map(r)), customdata: angles, text: f.map(shown),
    line: { color: series[k % series.length], width: chosen ? 2.6 : 1.3, dash: chosen ? "solid" : "dot" },
    hovertemplate: "%{customdata:.1f}°: %{text} 1/sr<extra>%{fullData.name}</extra>",
  }));
  traces.sort((a, b) => a.line.width - b.line.width);
  const { tickvals, ticktext } = rings(state.scale, top);
  if (ticktext.length > 0) ticktext[0] += " 1/sr";
  const plain = { type: "scatter", mode: "lines", hoverinfo: "skip" };
  const light = { ...plain, ...placed([-state.theta, 0], [1, 0]), line: { color: soft, width: 1.2, dash: "dash" } };
  const dots = {
    type: "scatter", mode: "markers", name: "measured", ...placed(points.map((point) => point.angle), points.map((point) => r(point.value))),
    customdata: points.map((point) => point.angle), text: points.map((point) => shown(point.value)),
    marker: { size: 6.5, color: "rgba(0,0,0,0)", line: { color: ink, width: 1.4 } },
    hovertemplate: "%{customdata:.1f}°: %{text} 1/sr<extra>measured</extra>",
  };
  // one trace of words: annotations take plotly longer than all curves
  const words = {
    type: "scatter", mode: "text", hoverinfo: "skip", cliponaxis: false, textfont: { color: soft, size: 11.5 },
    ...placed([...SPOKES, ...tickvals.map(() => 90)], [...SPOKES.map(() => 1.09), ...tickvals]),
    text: [...SPOKES.map((angle) => `${Math.abs(angle)}°`), ...ticktext],
    textposition: [...SPOKES.map((angle) => (Math.abs(angle) === 90 ? "top center" : "middle center")), ...tickvals.map(() => "bottom center")],
  };
  const axis = { visible: false, fixedrange: true };
  const { x, y } = ranges(at("polar"));
  await draw(at("polar"), [{ ...plain, ...grid(tickvals), line: { color: line, width: 1 } }, words, light, ...traces, dots], {
    margin: MARGIN, xaxis: { ...axis, range: x }, yaxis: { ...axis, range: y },
  });
  at("polar-title").textContent = `In the plane of incidence, light at ${shown(state.theta)}°${turnable() ? `, azimuth ${shown(state.phi)}°` : ""}`
    + (points.length ? `: ${points.length} measured` : state.samples ? ": none measured" : "");
}

/** What both axes show, so that a unit is as long on both. @param {HTMLElement} element */
function ranges(element) {
  const [wide, high] = [element.clientWidth - MARGIN.l - MARGIN.r, element.clientHeight - MARGIN.t - MARGIN.b];
  const unit = Math.max(Math.min(wide / 2.34, high / 1.16), 1); // pixels
  return { x: [-wide / unit / 2, wide / unit / 2], y: [0, high / unit] };
}

/** The point at an angle from the normal, which points up; a positive one is to the right. @param {number} angle @param {number} radius */
function spot(angle, radius) {
  const turn = (angle * Math.PI) / 180;
  return { x: radius * Math.sin(turn), y: radius * Math.cos(turn) };
}

/** @param {number[]} angles @param {number[]} radii @returns {{x: any[], y: any[]}} */
function placed(angles, radii) {
  const spots = angles.map((angle, k) => spot(angle, radii[k]));
  return { x: spots.map((one) => one.x), y: spots.map((one) => one.y) };
}

/** Rings, the horizon and a spoke every 30 degrees, as one line with gaps. @param {number[]} radii @returns {{x: any[], y: any[]}} */
function grid(radii) {
  const around = Array.from({ length: 61 }, (_, k) => 3 * k - 90);
  const arcs = [...radii, 1].map((radius) => placed(around, around.map(() => radius)));
  const parts = [...arcs, ...SPOKES.map((angle) => placed([angle, angle], [0, 1])), placed([-90, 90], [1, 1])];
  const joined = (/** @type {"x" | "y"} */ name) => parts.flatMap((part) => [...part[name], null]);
  return { x: joined("x"), y: joined("y") };
}

/**
 * The samples of the light's direction in its plane; a positive angle is on the mirror's side.
 * @param {number} theta of the light
 */
export function measured(theta) {
  const { samples } = state;
  if (samples === null) return [];
  return samples.values.flatMap((row, k) => {
    const value = row[Math.min(state.channel, row.length - 1)];
    const turned = apart(samples.phi_o_deg[k], samples.phi_i_deg[k]);
    const away = Math.abs(samples.theta_i_deg[k] - theta) > NEAR || (samples.theta_o_deg[k] > 1 && turned > 5 && turned < 175);
    const other = samples.theta_i_deg[k] > 1 && turnable() && apart(samples.phi_i_deg[k], state.phi) > 5;
    return value === null || away || other ? [] : [{ angle: turned > 90 ? samples.theta_o_deg[k] : -samples.theta_o_deg[k], value }];
  });
}

/** @returns {boolean} whether the sample was turned, so that the azimuth of the light matters */
export function turnable() {
  return state.dataset?.report.azimuth_observed ?? false;
}
