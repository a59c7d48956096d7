/** The albedo against the angle, and what is left between the model and the measurement. */

import { apart } from "./directions.js";
import { at, shown } from "./dom.js";
import { colours, draw } from "./figures.js";
import { state } from "./state.js";

const DOTS = 1000; // residuals that are drawn at most: each is an element, and 1000 of them take a tenth of a second

export const THETAS = [0, 10, 20, 30, 40, 45, 50, 55, 60, 65, 70, 74, 78, 81, 84, 86, 88, 89];

/**
 * Draw albedos at THETAS.
 * @param {{name: string, values: (number | null)[], chosen: boolean}[]} curves
 */
export async function drawAlbedo(curves) {
  const { series, bad } = colours();
  const traces = curves.map(({ name, values, chosen }, k) => ({
    type: "scatter", mode: "lines", name, x: THETAS, y: values,
    line: { color: series[k % series.length], width: chosen ? 2.6 : 1.3, dash: chosen ? "solid" : "dot" },
    hovertemplate: "%{x}°: %{y:.4g}<extra>%{fullData.name}</extra>",
  }));
  const top = Math.max(0.05, ...traces.flatMap((trace) => trace.y.map((y) => y ?? 0)));
  const one = { type: "line", xref: "paper", x0: 0, x1: 1, y0: 1, y1: 1, line: { color: bad, width: 1.4, dash: "dash" } };
  await draw(at("albedo"), traces, {
    xaxis: { title: { text: "angle from the normal [°]" }, range: [0, 90], dtick: 15 },
    yaxis: { title: { text: "albedo" }, range: [0, 1.15 * Math.min(top, 4)] },
    shapes: top > 0.85 ? [one] : [],
  });
}

/**
 * Draw the differences at the samples, as shares of the mean of both: bounded, whatever was measured.
 * @param {(number | null)[]} f the model there
 */
export async function drawResiduals(f) {
  const { samples } = state;
  if (samples === null) return;
  const { soft } = colours();
  const measured = column(samples);
  const floor = 1e-3 * median(measured.filter((y) => y !== null && y > 0).map(Number)); // two zeros do not differ
  const dots = measured.map((y, k) => (200 * ((f[k] ?? NaN) - (y ?? NaN))) / (Math.abs(f[k] ?? 0) + Math.abs(y ?? 0) + floor));
  const step = Math.ceil(dots.length / DOTS);
  const some = (/** @type {any[]} */ column) => column.filter((_, k) => k % step === 0);
  const side = samples.theta_o_deg.map((theta, k) => (apart(samples.phi_o_deg[k], samples.phi_i_deg[k]) > 90 ? theta : -theta));
  const bar = { title: { text: "light [°]", side: "right", font: { size: 13 } }, thickness: 10, outlinewidth: 0, tickfont: { color: soft, size: 11.5 } };
  await draw(at("residuals"), [{
    type: "scatter", mode: "markers", x: some(side), y: some(dots), text: some(samples.theta_i_deg).map(shown),
    marker: { size: 5.5, opacity: 0.85, color: some(samples.theta_i_deg), colorscale: [[0, "#4c8be0"], [0.5, "#b57ad0"], [1, "#e8743b"]], colorbar: bar },
    hovertemplate: "viewer %{x:.1f}°, light %{text}°: %{y:.2f} %<extra></extra>",
  }], {
    xaxis: { title: { text: "viewer, positive on the mirror's side [°]" }, range: [-92, 92], dtick: 30 },
    yaxis: { title: { text: "model - measurement [% of their mean]" } },
  });
  at("residuals-title").textContent = "Model less measurement, by angle"
    + (samples.stride * step > 1 ? ` (one in ${samples.stride * step} samples)` : "");
}

/**
 * The root mean square of cos theta_i (f - y) [1/sr] over the samples that the page has, in the channel looked at.
 * @param {(number | null)[]} f
 * @returns {number}
 */
export function cosineRms(f) {
  const { samples } = state;
  if (samples === null) return NaN;
  const squares = column(samples).flatMap((y, k) => {
    const value = f[k];
    return y === null || value === null ? [] : [(Math.cos((samples.theta_i_deg[k] * Math.PI) / 180) * (value - y)) ** 2];
  });
  return Math.sqrt(squares.reduce((sum, square) => sum + square, 0) / Math.max(squares.length, 1));
}

/** @param {import("./state.js").Samples} samples @returns {(number | null)[]} the values of the channel looked at */
function column(samples) {
  return samples.values.map((row) => row[Math.min(state.channel, row.length - 1)]);
}

/** @param {number[]} numbers */
function median(numbers) {
  return numbers.sort((a, b) => a - b)[numbers.length >> 1] ?? 1;
}
