/** Where the measured directions lie: the hemisphere seen from above, once for the light and once for the viewer. */

import { at } from "./dom.js";
import { colours } from "./figures.js";
import { on, state } from "./state.js";

/** Draw whenever there are samples. */
export function install() {
  on("samples", draw);
  new ResizeObserver(draw).observe(at("where"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}

function draw() {
  const { samples } = state;
  at("where-figure").hidden = samples === null;
  const canvas = at("where");
  const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
  if (samples === null || wide === 0) return;
  const dots = window.devicePixelRatio || 1;
  [canvas.width, canvas.height] = [Math.round(wide * dots), Math.round(high * dots)];
  const pen = canvas.getContext("2d");
  pen.setTransform(dots, 0, 0, dots, 0, 0);
  const size = Math.min(wide / 4.4, high / 2 - 14);
  disc(pen, wide / 4, high / 2 + 8, size, "light", samples.theta_i_deg, samples.phi_i_deg);
  disc(pen, (3 * wide) / 4, high / 2 + 8, size, "viewer", samples.theta_o_deg, samples.phi_o_deg);
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {number} x of the normal
 * @param {number} y of the normal
 * @param {number} size radius of the horizon
 * @param {string} name
 * @param {number[]} theta
 * @param {number[]} phi
 */
function disc(pen, x, y, size, name, theta, phi) {
  const { line, soft, series } = colours();
  pen.strokeStyle = line;
  for (const ring of [30, 60, 90]) {
    pen.beginPath();
    pen.arc(x, y, (size * ring) / 90, 0, 2 * Math.PI);
    pen.stroke();
  }
  pen.fillStyle = soft;
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.fillText(name, x, y - size - 6);
  pen.fillStyle = series[name === "light" ? 1 : 0];
  theta.forEach((angle, k) => {
    const turn = (phi[k] * Math.PI) / 180;
    pen.fillRect(x + (size * angle * Math.cos(turn)) / 90 - 1.2, y - (size * angle * Math.sin(turn)) / 90 - 1.2, 2.4, 2.4);
  });
}
