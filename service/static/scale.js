/** What a radius shows: f itself, its cube root, or its logarithm over four decades. */

import { shown } from "./dom.js";

const DECADES = 4;

/**
 * The radius of a value, 0 to 1, where `top` is the largest.
 * @param {"linear" | "cube_root" | "log"} scale
 * @param {number} top
 * @returns {(value: number | null) => number}
 */
export function radius(scale, top) {
  if (!(top > 0)) return () => 0;
  const share = (/** @type {number | null} */ value) => Math.max(value ?? 0, 0) / top;
  if (scale === "linear") return share;
  if (scale === "cube_root") return (value) => Math.cbrt(share(value));
  return (value) => Math.max(0, 1 + Math.log10(Math.max(share(value), 1e-300)) / DECADES);
}

/**
 * Rings for the axis: their radii and what they stand for.
 * @param {"linear" | "cube_root" | "log"} scale
 * @param {number} top
 * @returns {{tickvals: number[], ticktext: string[]}}
 */
export function rings(scale, top) {
  const at = radius(scale, top);
  const decade = 10 ** Math.floor(Math.log10(top > 0 ? top : 1));
  const values =
    scale === "linear"
      ? [0.25, 0.5, 0.75, 1].map((share) => Number((share * top).toPrecision(2)))
      : [decade * 10, decade, decade / 10, decade / 100, decade / 1000].filter((value) => value <= 1.001 * top);
  // labels that would touch are left out
  const kept = values.filter((value, k) => at(value) > 0.08 && values.slice(0, k).every((other) => scale === "linear" || at(other) - at(value) > 0.24));
  return { tickvals: kept.map(at), ticktext: kept.map(shown) };
}
