/** The lobes in the plane of incidence, with the points that were measured there. */

import { apart } from "./directions.js";
import { at, shown } from "./dom.js";
import { colours, draw } from "./figures.js";
import { radius, rings } from "./scale.js";
import { state } from "./state.js";

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
    type: "scatterpolar", mode: "lines", name, theta: angles, r: f.map(r), text: f.map(shown),
    line: { color: series[k % series.length], width: chosen ? 2.6 : 1.3, dash: chosen ? "solid" : "dot" },
    hovertemplate: "%{theta:.1f}°: %{text} 1/sr<extra>%{fullData.name}</extra>",
  }));
  traces.sort((a, b) => a.line.width - b.line.width);
  const light = { type: "scatterpolar", mode: "lines", theta: [-state.theta, 0], r: [1, 0], hoverinfo: "skip", line: { color: soft, width: 1.2, dash: "dash" } };
  const dots = {
    type: "scatterpolar", mode: "markers", name: "measured", theta: points.map((point) => point.angle), r: points.map((point) => r(point.value)),
    text: points.map((point) => shown(point.value)), marker: { size: 6.5, color: "rgba(0,0,0,0)", line: { color: ink, width: 1.4 } },
    hovertemplate: "%{theta:.1f}°: %{text} 1/sr<extra>measured</extra>",
  };
  const axis = { gridcolor: line, linecolor: soft, tickfont: { color: soft, size: 11.5 } };
  await draw(at("polar"), [light, ...traces, dots], {
    margin: { l: 30, r: 30, t: 26, b: 10 },
    polar: {
      bgcolor: "rgba(0,0,0,0)", sector: [0, 180],
      angularaxis: { ...axis, rotation: 90, direction: "clockwise", tickvals: [-90, -60, -30, 0, 30, 60, 90], ticktext: ["90°", "60°", "30°", "0°", "30°", "60°", "90°"] },
      radialaxis: { ...axis, range: [0, 1.04], angle: 0, tickangle: 0, ...rings(state.scale, top) },
    },
  });
  at("polar-title").textContent = `In the plane of incidence, light at ${shown(state.theta)}°`
    + (points.length ? `: ${points.length} measured` : state.samples ? ": none measured" : "");
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
