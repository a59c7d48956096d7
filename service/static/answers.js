/** Answers about fits as they were fitted, which do not change: each is asked for once. */

const MOST = 400; // that are kept; the oldest goes first

/** @type {Map<string, any>} */
const known = new Map();

/**
 * The answer of that name, asked for where it is not known.
 * @template T
 * @param {string} name
 * @param {() => Promise<T>} answer
 * @returns {Promise<T>}
 */
export async function once(name, answer) {
  if (known.has(name)) return known.get(name);
  const found = await answer();
  known.set(name, found);
  if (known.size > MOST) known.delete(/** @type {string} */ (known.keys().next().value));
  return found;
}
