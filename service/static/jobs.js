/** Step 3: the fits of the page, asked for, opened and followed. */

import { get, Refusal } from "./api.js";
import { at, inWords, leadTo } from "./dom.js";
import { mannerOf } from "./fit.js";
import { line } from "./job.js";
import { subject } from "./latest.js";
import { about, add, chosen, on, present, state } from "./state.js";

/** @type {Map<string, {element: HTMLElement, leave: AbortController, manner: (text: string) => void}>} the lines on the page by the fit's id */
const lines = new Map();

/** Keep a line for each fit of the page, and the address that names them. */
export function install() {
  on("fits", () => {
    for (const [id, { leave }] of lines) if (!state.fits.has(id)) leave.abort(), lines.delete(id);
    for (const fit of state.fits.values()) if (!lines.has(fit.id)) lines.set(fit.id, line(fit));
    const wanted = [...state.fits.keys()].map((id) => lines.get(id)?.element);
    if (wanted.some((element, k) => at("jobs").children[k] !== element) || at("jobs").childElementCount !== wanted.length)
      at("jobs").replaceChildren(...wanted);
    for (const fit of state.fits.values()) lines.get(fit.id)?.manner(mannerOf(fit));
    at("progress").hidden = wanted.length === 0;
    name();
  });
  on("chosen", reveal);
  for (const act of ["wheel", "touchmove", "keydown", "pointerdown"]) window.addEventListener(act, () => (awaited = false), { passive: true });
}

let awaited = false; // a result: nobody has done anything since it was asked for

/** Show the first result of what was asked for last, unless somebody has turned to something else. */
function reveal() {
  const fit = chosen();
  if (!awaited || fit === null || !state.asked.has(fit.job ?? fit.id)) return;
  awaited = false;
  at("result").scrollIntoView();
}

/** Let the address name the fits of the page; the browser's way back leads to those before others came. */
function name() {
  const named = location.hash.startsWith("#fit=") ? location.hash.slice("#fit=".length).split(",") : [];
  const fits = state.fits.size > 0 ? `#fit=${[...state.fits.keys()].join(",")}` : "";
  if (fits === location.hash || (!fits && named.length === 0)) return;
  const more = named.length > 0 && [...state.fits.keys()].some((id) => !named.includes(id));
  history[more ? "pushState" : "replaceState"](null, "", fits || location.pathname + location.search);
}

/**
 * Ask for fits of the page's measurement, and follow them beside those before; throws where one was not accepted.
 * @param {any[]} requests bodies of POST /v1/fits
 */
export async function submit(requests) {
  const signal = subject();
  const fits = [];
  const refused = [];
  for (const json of requests) { // one by one, so that they are fitted in the order in which they stand
    try {
      fits.push(await get("/v1/fits", { method: "POST", json }));
    } catch (error) {
      refused.push(`${json.model}: ${inWords(error)}`);
    }
  }
  if (fits.length > 0 && !signal.aborted) {
    add(fits);
    at("progress").scrollIntoView({ block: "nearest" });
    awaited = true;
  }
  if (refused.length > 0) throw new Error(refused.join("\n"));
}

/**
 * Show fits by their ids, and their measurement, as a permalink or a reload asks for; throws where not all is there.
 * @param {string[]} ids
 */
export async function open(ids) {
  const signal = subject();
  /** @type {string[]} */
  const missing = [];
  const there = async (/** @type {string} */ path) => {
    try {
      return await get(path, { signal });
    } catch (error) {
      signal.throwIfAborted();
      missing.push(error instanceof Refusal && error.status === 404 ? `${path.split("/").at(-1)} is not here: removed, or of another service.` : inWords(error));
      return null;
    }
  };
  const found = (await Promise.all(ids.map((id) => there(`/v1/fits/${encodeURIComponent(id)}`)))).filter(Boolean);
  if (found.length > 0) {
    const { dataset } = found[0].request;
    const fits = found.filter((fit) => fit.request.dataset === dataset);
    if (fits.length < found.length) missing.push("Some of these fits are of another measurement. Open them by themselves.");
    if (dataset !== null && dataset === state.dataset?.id) present(fits);
    else about(dataset === null ? null : await there(`/v1/datasets/${dataset}`), fits);
  }
  if (missing.length > 0) throw new Error(["Not all that was to be shown is there.", ...missing].join("\n"));
}

/**
 * The body that asks for a fit once more, its model as it came out.
 * @param {import("./state.js").Fit} fit
 * @param {Record<string, unknown>} other than it was asked for
 */
export function again(fit, other) {
  const { samples, model, models, ...options } = fit.request;
  const given = Object.fromEntries(Object.entries(options).filter(([, value]) => value !== null));
  return { ...given, model: model === "auto" ? fit.result.model : model, ...other };
}

/** Show an earlier fit, beside those of its measurement that are on the page, and lead the eye to it. @param {import("./state.js").Fit} fit */
export async function reopen(fit) {
  const { dataset } = fit.request;
  if (dataset !== null && dataset === state.dataset?.id) add([await get(`/v1/fits/${fit.id}`, { signal: subject() })]);
  else await open([fit.id]);
  leadTo(chosen() === null ? "progress" : "result");
}
