/** Step 4: what came out, the models ranked side by side and the chosen one in full. */

import { at, breakable, complain, made, shown, table } from "./dom.js";
import { SERIES } from "./figures.js";
import { originOf } from "./fit.js";
import { again, submit } from "./jobs.js";
import { nameOfDataset } from "./names.js";
import { choose, chosen, on, ranked, state, yardstick } from "./state.js";

const ADVISED = /="(log|cube_root|relative)"/; // a loss that a warning names
const FEW = 4; // channels whose values are all shown at once

/** Show results as they come. */
export function install() {
  on("fits", () => {
    at("result").hidden = ranked().length === 0;
    rank();
  });
  on("chosen", () => {
    rank();
    detail();
  });
}

function rank() {
  const fits = ranked();
  if (fits.length === 0) return at("ranking").replaceChildren();
  const losses = Object.keys(fits[0].result.errors);
  const best = Object.fromEntries(losses.map((loss) => [loss, Math.min(...fits.map((fit) => fit.result.errors[loss] ?? Infinity))]));
  const rows = fits.map((fit, k) => [
    `${k + 1}`,
    choice(fit, k),
    ...losses.map((loss) => figure(fit.result.errors[loss], fits.length > 1 && shown(fit.result.errors[loss]) === shown(best[loss]))),
    energy(fit.result.certificate),
    `${fit.result.cost.seconds.toFixed(2)} s`,
  ]);
  const heads = losses.map((loss) => `${loss}#`);
  const shownTable = table("Models, the best first, with their errors under every loss", ["Rank", "Model", ...heads, "Energy", "Time#"], rows);
  const chosenRow = fits.findIndex((fit) => fit.id === state.chosen);
  shownTable.querySelectorAll("tbody tr")[chosenRow]?.classList.add("chosen");
  const several = fits.length > 1 ? made("p", { class: "hint" }, `Ranked by ${measure(fits[0].result)}; the lowest error of a column is bold.`) : null;
  const focused = document.activeElement?.getAttribute("name") === "chosen-fit";
  const file = nameOfDataset(fits[0].request.dataset);
  const subject = file && made("p", { class: "hint" }, `Fitted to ${file.name}${file.remark && `: ${file.remark}`}.`);
  at("ranking").replaceChildren(...(subject ? [subject] : []), shownTable, ...(several ? [several] : []));
  if (focused) at("ranking").querySelector("input:checked")?.focus();
}

/** @param {any} result @returns {string} by what the fits are ranked */
function measure({ chi_square }) {
  const { loss, same } = yardstick();
  if (!same) return `their error under ${loss}, since they minimised different losses`;
  return `what was minimised, ${minimised({ loss, chi_square })}`;
}

/** @param {any} result */
function minimised({ loss, chi_square, weighed, options }) {
  const form = options?.robust ? `, made robust by ${options.robust}` : "";
  return `the ${loss} loss${(weighed ?? chi_square) ? " with every sample weighted by its stated error" : ""}${form}`;
}

/** @param {import("./state.js").Fit} fit @param {number} rank from 0, which is the colour of its curves */
function choice(fit, rank) {
  const radio = made("input", { type: "radio", name: "chosen-fit", checked: fit.id === state.chosen, onchange: () => choose(fit.id) });
  return made("label", { class: "choice code" }, radio, made("span", { class: `swatch swatch-${rank % SERIES}` }), made("span", {}, breakable(fit.result.model), " ", made("span", { class: "hint" }, originOf(fit))));
}

/** @param {number | null} value @param {boolean} best */
function figure(value, best) {
  return made(best ? "b" : "span", {}, shown(value));
}

/** @param {any} certificate */
function energy(certificate) {
  if (!certificate.decided) return made("span", {}, "undecided");
  return certificate.energy_conserving ? made("span", { class: "good" }, "conserves") : made("span", { class: "bad" }, "creates");
}

/** @type {Record<string, string>} */
const ENDS = { converged: "Converged. ", undetermined: "Converged, with values left free. ", stopped_early: "Stopped early. " };

function detail() {
  const fit = chosen();
  if (fit === null) return at("details").replaceChildren();
  const { result } = fit;
  const parts = [
    made("h3", {}, "Parameters of ", made("span", { class: "code" }, result.model)),
    ...parameters(result),
  ];
  if (result.undetermined.length > 0)
    parts.push(made("p", { class: "said" }, `The data do not determine ${result.undetermined.join(", ")}: other values fit as well, so none is stated.`));
  for (const sentence of result.warnings) parts.push(warning(fit, sentence));
  for (const sentence of result.choices) parts.push(made("p", { class: "hint" }, sentence));
  parts.push(
    made("h3", {}, "Certificate"),
    made("p", { class: `verdict ${!result.certificate.decided ? "" : result.certificate.energy_conserving ? "good" : "bad"}` }, result.certificate.verdict),
    made("p", { class: "hint" }, reciprocity(result.certificate)),
    made("p", {}, made("b", {}, ENDS[result.status]), result.message),
  );
  if (result.chi_square) parts.push(made("p", {}, `Chi-square ${shown(result.chi_square[0])} for ${result.chi_square[1]} degrees of freedom.`));
  if (result.conservation && !(result.conservation.free_max_albedo <= 1)) parts.push(made("p", {}, conserved(result)));
  if (result.ladder?.length) parts.push(made("h3", {}, "How it was chosen"), ladder(result.ladder));
  at("details").replaceChildren(...parts);
}

/** A warning, with what it advises at hand. @param {import("./state.js").Fit} fit @param {string} sentence */
function warning(fit, sentence) {
  const loss = ADVISED.exec(sentence)?.[1];
  const button = made("button", { type: "button", class: "small" }, `Fit again with ${loss}`);
  button.addEventListener("click", async () => {
    complain("result-error", null, "again");
    await submit([again(fit, { loss, starts: [] })]).catch((error) => complain("result-error", error, "again"));
  });
  return made("div", { class: "warning" }, made("p", {}, sentence), loss && fit.request.dataset !== null ? button : null);
}

/** @param {any} result */
function conserved({ conservation, objective }) {
  const { free_objective: free, free_max_albedo: most } = conservation;
  return `Kept at 1 or below, the loss is ${shown(objective)}; free, it is ${shown(free)} with a largest albedo of ${most === null ? "infinity" : shown(most)}.`;
}

/** @param {any} certificate */
function reciprocity(certificate) {
  const symmetric = certificate.reciprocal ? "Reciprocal: light and viewer can be exchanged." : `Not reciprocal: exchanging light and viewer changes it by up to ${shown(100 * certificate.reciprocity_error)} %.`;
  return `${symmetric} The smallest value met is ${shown(certificate.min_value)} 1/sr. The albedo is drawn against the angle below.`;
}

/**
 * One row a value; where the channels are many, only that which is looked at, and all of them folded away.
 * @param {any} result
 * @returns {HTMLElement[]}
 */
function parameters(result) {
  const listed = (/** @type {any[][]} */ rows) => table("Parameters with their intervals", ["Parameter", "Value#", "95 % interval", "What it is"], rows);
  const every = result.channels.map((/** @type {string} */ _, /** @type {number} */ k) => k);
  const few = every.length <= FEW ? every : [state.channel];
  const entries = Object.entries(result.parameters);
  const rows = (/** @type {number[]} */ channels) => entries.flatMap(([key, value]) => valuesIn(result, key, value, channels));
  if (few === every) return [listed(rows(every))];
  const all = made("details", {}, made("summary", {}, `All ${every.length} channels`));
  all.addEventListener("toggle", () => all.open && all.childElementCount === 1 && all.append(listed(rows(every))));
  return [listed(rows(few)), all];
}

/**
 * @param {any} result
 * @param {string} key
 * @param {any} value a number, or one a channel
 * @param {number[]} channels
 */
function valuesIn(result, key, value, channels) {
  const what = result.units[key] ?? "";
  if (!Array.isArray(value)) return [[made("span", { class: "code" }, key), shown(value), interval(result, key, value, result.intervals[key]), what]];
  return channels.map((k) => [
    made("span", { class: "code" }, `${key} (${result.channels[k]})`), shown(value[k]), interval(result, key, value[k], result.intervals[key]?.[k]), k === channels[0] ? what : "",
  ]);
}

/** @param {any} result @param {string} key @param {number | null} value @param {number[] | null | undefined} interval */
function interval(result, key, value, interval) {
  if (value === null) return "not determined by the data";
  if (result.fixed.includes(key)) return "held";
  return interval ? `${shown(interval[0])} to ${shown(interval[1])}` : "none: it lies at an end of its range, or is held";
}

/** @param {any[]} rungs */
function ladder(rungs) {
  const rows = rungs.map((rung) => [
    rung.effect, rung.kept ? "kept" : "left out", made("div", { class: "why" }, rung.reason), made("span", { class: "code" }, rung.model), shown(rung.error), shown(rung.held_out),
  ]);
  return table("The materials that were tried", ["Effect", "", "Why", "Model", "Error#", "Held-out error#"], rows);
}
