/** Step 3: fits under way, each with its progress, its falling loss and a button that cancels it. */

import { ask, followed, get, Refusal } from "./api.js";
import { at, inWords, made, shown } from "./dom.js";
import { subject } from "./latest.js";
import { about, arrived, belongs, nameOf, on, present, state } from "./state.js";

const FINISHED = ["succeeded", "failed", "cancelled"];
/** @type {Record<string, string>} */
const WORDS = { queued: "waiting", running: "running", succeeded: "done", failed: "failed", cancelled: "cancelled" };

/** @type {Map<string, {element: HTMLElement, leave: AbortController}>} the lines on the page by the fit's id */
const lines = new Map();

/** Keep a line for each fit of the page, and the address that names them. */
export function install() {
  on("fits", () => {
    for (const [id, line] of lines) if (!state.fits.has(id)) line.leave.abort(), lines.delete(id);
    for (const fit of state.fits.values()) if (!lines.has(fit.id)) lines.set(fit.id, row(fit));
    const wanted = [...state.fits.keys()].map((id) => lines.get(id)?.element);
    if (wanted.some((element, k) => at("jobs").children[k] !== element) || at("jobs").childElementCount !== wanted.length)
      at("jobs").replaceChildren(...wanted);
    at("progress").hidden = wanted.length === 0;
    name();
  });
}

/** Let the address name the fits of the page. */
function name() {
  const fits = state.fits.size > 0 ? `#fit=${[...state.fits.keys()].join(",")}` : "";
  if (fits !== location.hash && (fits || location.hash.startsWith("#fit="))) history.replaceState(null, "", fits || location.pathname + location.search);
}

/**
 * Ask for fits of the page's measurement, and follow them in place of those before; throws where one was not accepted.
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
    present(fits);
    at("progress").scrollIntoView({ block: "nearest" });
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
      missing.push(inWords(error));
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
 * The line of a fit, which follows it to its end.
 * @param {import("./state.js").Fit} fit
 */
function row(fit) {
  const leave = new AbortController();
  const name = nameOf(fit);
  const bar = made("progress", { max: 1, "aria-label": `Progress of ${name}` });
  const said = made("span", { class: "note" });
  const spoken = made("span", { class: "seen-by-readers", role: "status" }); // its losses would be too much to hear
  const svg = sparkline(name);
  const cancel = made("button", { type: "button", class: "small", "aria-label": `Cancel ${name}` }, "Cancel");
  const failure = made("p", { class: "error", role: "alert", hidden: true });
  /** @type {Record<string, string | null>} why it failed, could not be cancelled, or is not heard of */
  const reasons = {};
  const fail = (/** @type {string} */ source, /** @type {string | null} */ text) => {
    if ((reasons[source] ?? null) === text) return; // said once, heard once
    reasons[source] = text;
    failure.textContent = Object.values(reasons).filter(Boolean).join("\n");
    failure.hidden = failure.textContent === "";
  };
  /** @type {number[]} */
  const losses = [];
  let words = "";
  const tell = (/** @type {any} */ { status, progress, error }) => {
    const loss = progress?.loss ?? null;
    if (loss !== null) losses.push(Math.min(loss, losses.at(-1) ?? loss)); // the lowest so far: starts are tried in turn
    bar.value = status === "succeeded" ? 1 : (progress?.fraction ?? 0);
    said.textContent = words = `${WORDS[status]}${loss === null ? "" : `, loss ${shown(loss)}`}`;
    if (spoken.dataset.status !== status) spoken.textContent = `${name}: ${WORDS[status]}`;
    spoken.dataset.status = status;
    svg.draw(losses);
    cancel.hidden = FINISHED.includes(status);
    fail("fit", error);
  };
  const ended = (/** @type {import("./state.js").Fit} */ now) =>
    tell(now.result ? { ...now, progress: { fraction: 1, loss: now.result.objective } } : now);
  const lost = (/** @type {unknown} */ error) => {
    said.textContent = error === null ? words : error instanceof Refusal ? "trying again …" : "connection lost, trying again …";
    fail("stream", error instanceof Refusal ? error.message : null);
  };
  cancel.addEventListener("click", async () => {
    cancel.disabled = true;
    fail("cancel", null);
    try {
      await ask(`/v1/fits/${fit.id}/cancel`, { method: "POST" });
    } catch (error) {
      cancel.disabled = false;
      if (!(error instanceof Refusal && error.status === 409)) fail("cancel", inWords(error)); // 409: it has just ended
    }
  });
  ended(fit);
  if (!FINISHED.includes(fit.status)) {
    followed(fit.id, tell, lost, leave.signal)
      .then((now) => {
        ended(now);
        arrived(now);
      })
      .catch((error) => leave.signal.aborted || fail("stream", inWords(error)));
  }
  const element = made("div", { class: "job" }, made("span", { class: "code" }, name), bar, said, svg.element, made("span", {}, cancel, spoken), failure);
  return { element, leave };
}

/** A small drawing of how the loss falls, its scale logarithmic. @param {string} name */
function sparkline(name) {
  const space = "http://www.w3.org/2000/svg";
  const element = document.createElementNS(space, "svg");
  const line = document.createElementNS(space, "polyline");
  for (const [key, value] of Object.entries({ class: "spark", viewBox: "0 0 100 24", preserveAspectRatio: "none", role: "img" }))
    element.setAttribute(key, value);
  element.setAttribute("aria-label", `The loss of ${name} as it falls`);
  element.append(line);
  const draw = (/** @type {number[]} */ losses) => {
    const logs = losses.map((loss) => Math.log(Math.max(loss, 1e-300)));
    const low = Math.min(...logs), span = Math.max(Math.max(...logs) - low, 0.01); // 1 %, below which it lies flat
    const step = 96 / Math.max(logs.length - 1, 1);
    line.setAttribute("points", logs.length < 2 ? "" : logs.map((y, k) => `${2 + step * k},${21 - (18 * (y - low)) / span}`).join(" "));
  };
  return { element, draw };
}
