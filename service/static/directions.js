/** Pairs of directions in degrees, as POST /v1/evaluate takes them; the mirror of azimuth phi is phi + 180. */

const DEGREE = Math.PI / 180;

/** @typedef {{theta_i_deg: number[], phi_i_deg: number[], theta_o_deg: number[], phi_o_deg: number[]}} Pairs */

/**
 * The plane of incidence from -89 to 89 degrees, denser about the mirror; a positive angle is on the mirror's side.
 * @param {number} theta of the light
 * @param {number} phi of the light
 * @returns {{angles: number[], pairs: Pairs}}
 */
export function plane(theta, phi) {
  const angles = [];
  for (let angle = -89; angle <= 89; angle += 1) angles.push(angle);
  for (let off = -8; off <= 8; off += 0.2) if (Math.abs(theta + off) < 89.5) angles.push(theta + off);
  angles.sort((a, b) => a - b);
  const out = angles.map((angle) => [Math.abs(angle), angle >= 0 ? phi + 180 : phi]);
  return { angles, pairs: against(theta, phi, out) };
}

export const RINGS = 26;
export const SPOKES = 40;

/**
 * Viewers over the whole hemisphere on RINGS + 1 rings of SPOKES about the mirror direction, closer together near it;
 * the last ring is the horizon.
 * @param {number} theta of the light
 * @param {number} phi of the light
 * @returns {{vectors: number[][], pairs: Pairs}}
 */
export function hemisphere(theta, phi) {
  const mirror = vector(theta, phi + 180);
  const up = vector(theta - 90, phi + 180); // across the mirror direction, in the plane of incidence
  const side = [mirror[1] * up[2] - mirror[2] * up[1], mirror[2] * up[0] - mirror[0] * up[2], mirror[0] * up[1] - mirror[1] * up[0]];
  const vectors = [];
  for (let ring = 0; ring <= RINGS; ring++) {
    for (let spoke = 0; spoke < SPOKES; spoke++) {
      const turn = (2 * Math.PI * spoke) / SPOKES;
      const across = up.map((u, k) => Math.cos(turn) * u + Math.sin(turn) * side[k]);
      const horizon = Math.atan2(mirror[2], -across[2]) - 1e-3;
      const angle = horizon * (ring / RINGS) ** 2;
      vectors.push(mirror.map((m, k) => Math.cos(angle) * m + Math.sin(angle) * across[k]));
    }
  }
  const out = vectors.map(([x, y, z]) => [Math.acos(Math.min(Math.max(z, 0), 1)) / DEGREE, Math.atan2(y, x) / DEGREE]);
  return { vectors, pairs: against(theta, phi, out) };
}

/**
 * A unit vector.
 * @param {number} theta
 * @param {number} phi
 */
export function vector(theta, phi) {
  const [t, p] = [theta * DEGREE, phi * DEGREE];
  return [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
}

/**
 * The angle between two azimuths, 0 to 180.
 * @param {number} a
 * @param {number} b
 */
export function apart(a, b) {
  return Math.abs(((((a - b) % 360) + 540) % 360) - 180);
}

/** @param {...Pairs} parts @returns {Pairs} */
export function joined(...parts) {
  const column = (/** @type {keyof Pairs} */ name) => parts.flatMap((part) => part[name]);
  return { theta_i_deg: column("theta_i_deg"), phi_i_deg: column("phi_i_deg"), theta_o_deg: column("theta_o_deg"), phi_o_deg: column("phi_o_deg") };
}

/** @param {number} theta @param {number} phi @param {number[][]} out @returns {Pairs} */
function against(theta, phi, out) {
  const short = (/** @type {number} */ x) => Math.round(x * 1e4) / 1e4;
  return {
    theta_i_deg: out.map(() => theta),
    phi_i_deg: out.map(() => phi),
    theta_o_deg: out.map(([angle]) => Math.min(short(angle), 89.99)),
    phi_o_deg: out.map(([, azimuth]) => short(azimuth)),
  };
}
