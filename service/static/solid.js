/** The lobe in space, drawn on a canvas: a mesh seen from a point that drags and arrow keys move. */

import { RINGS, SPOKES, vector } from "./directions.js";
import { at, made } from "./dom.js";
import { colours } from "./figures.js";
import { radius } from "./scale.js";
import { state } from "./state.js";

const DEGREE = Math.PI / 180;
const SKIN = [64, 128, 214]; // red, green and blue, readable on light and on dark
const EDGE = 6; // pixels that stay free
const view = { turn: -60, height: 24 }; // where the eye is [degrees]
/** @type {{vectors: number[][], f: (number | null)[]}} */
let mesh = { vectors: [], f: [] };

/** Let the pointer and the arrow keys turn the lobe. */
export function install() {
  const canvas = at("solid");
  canvas.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => event.buttons && move(-0.5 * event.movementX, 0.5 * event.movementY));
  canvas.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    const step = { ArrowLeft: [-6, 0], ArrowRight: [6, 0], ArrowUp: [0, 6], ArrowDown: [0, -6] }[event.key];
    if (!step) return;
    event.preventDefault();
    move(step[0], step[1]);
  });
  new ResizeObserver(paint).observe(canvas);
}

/** @param {number} turn @param {number} height */
function move(turn, height) {
  view.turn += turn;
  view.height = Math.min(Math.max(view.height + height, 0), 90);
  paint();
}

/** @param {number[][]} vectors unit vectors of the mesh, as `hemisphere` gives them @param {(number | null)[]} f */
export function drawSolid(vectors, f) {
  mesh = { vectors, f };
  paint();
}

/** Draw the mesh as it is seen now. */
export function paint() {
  const canvas = at("solid");
  const { clientWidth, clientHeight } = canvas;
  if (clientWidth > 0) painted(canvas, mesh, clientWidth, clientHeight, window.devicePixelRatio || 1);
}

/** A lobe as one is seen now, as a PNG file of 1280 by 960 pixels. @param {typeof mesh} lobe @param {string} title @returns {Promise<Blob>} */
export function picture(lobe, title) {
  const canvas = made("canvas");
  painted(canvas, lobe, 640, 480, 2);
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.globalCompositeOperation = "destination-over"; // behind the lobe
  pen.fillStyle = colours().card;
  pen.fillRect(0, 0, 640, 480);
  pen.globalCompositeOperation = "source-over";
  pen.fillStyle = colours().ink;
  pen.font = "14px system-ui, sans-serif";
  pen.fillText(title, 12, 22, 616);
  return new Promise((done) => canvas.toBlob(done));
}

/** @param {HTMLCanvasElement} canvas @param {typeof mesh} lobe @param {number} wide @param {number} high @param {number} dots in each of these units */
function painted(canvas, { vectors, f }, wide, high, dots) {
  if (f.length === 0) return;
  const [width, height] = [Math.round(wide * dots), Math.round(high * dots)];
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.setTransform(dots, 0, 0, dots, 0, 0);
  pen.clearRect(0, 0, wide, high);
  const low = Math.sin(view.height * DEGREE); // how far below the normal's foot the horizon is seen
  const size = Math.min(wide / 2.2, (high - 2 * EDGE) / (1 + low));
  const seen = camera();
  const place = (/** @type {number[]} */ p) => {
    const [x, y, depth] = seen(p);
    return [wide / 2 + size * x, (high + size * (1 - low)) / 2 - size * y, depth];
  };
  ground(pen, place);
  const r = radius(state.scale, Math.max(...f.map((value) => value ?? 0)));
  const points = vectors.map((direction, k) => direction.map((part) => part * r(f[k])));
  const placed = points.map(place);
  const faces = [];
  for (let ring = 0; ring < RINGS; ring++) {
    for (let spoke = 0; spoke < SPOKES; spoke++) {
      const next = (spoke + 1) % SPOKES;
      const corners = [ring * SPOKES + spoke, ring * SPOKES + next, (ring + 1) * SPOKES + next, (ring + 1) * SPOKES + spoke];
      faces.push({ corners, depth: corners.reduce((sum, k) => sum + placed[k][2], 0), shade: shade(corners.map((k) => points[k])) });
    }
  }
  faces.sort((a, b) => a.depth - b.depth);
  pen.lineWidth = 0.7;
  for (const { corners, shade: lit } of faces) {
    pen.fillStyle = pen.strokeStyle = `rgb(${SKIN.map((c) => Math.round(c * (0.42 + 0.58 * lit) + 70 * lit ** 4)).join(" ")})`;
    pen.beginPath();
    for (const k of corners) pen.lineTo(placed[k][0], placed[k][1]);
    pen.closePath();
    pen.fill();
    pen.stroke();
  }
  ray(pen, place, vector(state.theta, state.phi));
}

/** The turn from the surface's axes to those of the screen: right, up, towards the eye. */
function camera() {
  const [ct, st] = [Math.cos(view.turn * DEGREE), Math.sin(view.turn * DEGREE)];
  const [ch, sh] = [Math.cos(view.height * DEGREE), Math.sin(view.height * DEGREE)];
  return (/** @type {number[]} */ [x, y, z]) => {
    const [right, back] = [-st * x + ct * y, ct * x + st * y];
    return [right, ch * z - sh * back, ch * back + sh * z];
  };
}

/** How bright a face is, 0 to 1, in the light of a lamp over the eye's shoulder. @param {number[][]} corners */
function shade([a, b, c, d]) {
  const [u, v] = [c.map((x, k) => x - a[k]), d.map((x, k) => x - b[k])];
  const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const lamp = vector(45, view.turn + 40);
  const length = Math.hypot(...normal) || 1;
  return Math.abs(normal.reduce((sum, n, k) => sum + n * lamp[k], 0)) / length;
}

/** @param {CanvasRenderingContext2D} pen @param {(p: number[]) => number[]} place */
function ground(pen, place) {
  const { line, soft } = colours();
  pen.strokeStyle = line;
  pen.lineWidth = 1;
  for (const size of [0.5, 1]) {
    pen.beginPath();
    for (let turn = 0; turn <= 360; turn += 5) pen.lineTo(...flat(place(vector(90, turn).map((x) => size * x))));
    pen.stroke();
  }
  pen.strokeStyle = soft;
  pen.beginPath();
  pen.moveTo(...flat(place([0, 0, 0])));
  pen.lineTo(...flat(place([0, 0, 1])));
  pen.stroke();
}

/** The light's ray. @param {CanvasRenderingContext2D} pen @param {(p: number[]) => number[]} place @param {number[]} light */
function ray(pen, place, light) {
  pen.strokeStyle = colours().ink;
  pen.lineWidth = 1.6;
  pen.setLineDash([5, 4]);
  pen.beginPath();
  pen.moveTo(...flat(place(light)));
  pen.lineTo(...flat(place([0, 0, 0])));
  pen.stroke();
  pen.setLineDash([]);
}

/** @param {number[]} point @returns {[number, number]} */
function flat([x, y]) {
  return [x, y];
}
