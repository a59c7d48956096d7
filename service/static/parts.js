/** The fits that one job made. */

/** @typedef {import("./state.js").Fit} Fit */

/** @type {WeakMap<Fit, Fit[]>} */
const compared = new WeakMap();

/** @param {Fit} fit @returns {Fit[]} the fits of a job that compared several models, or the lone one */
export function parts(fit) {
  if (!fit.result.comparison) return [fit];
  const found = compared.get(fit) ?? fit.result.comparison.ranking.map((/** @type {any} */ one) => ({
    ...fit, id: `${fit.id}.${one.rank}`, job: fit.id, rank: one.rank, request: { ...fit.request, model: one.model, models: null }, result: one.fit,
  }));
  compared.set(fit, found);
  return found;
}
