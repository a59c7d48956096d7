/** Step 3: fits under way, each with its progress, its falling loss and a button that cancels it. */

import { ask, follow, get, Refusal } from "./api.js";
import { at, complain, made, shown } from "./dom.js";
import { changed, choose, nameOf, ranked, state } from "./state.js";
import { show } from "./measurement.js";

const FINISHED = ["succeeded", "failed", "cancelled"];
/** @type {Record<string, string>} */
const WORDS = { queued: "waiting", running: "running", succeeded: "done", failed: "failed", cancelled: "cancelled" };

/** @type {AbortController} ends the streams of the fits that leave the page */
let streams = new AbortController();

/**
 * Ask for fits, and follow them in place of those before; throws where none was accepted.
 * @param {any[]} requests bodies of POST /v1/fits
 */
export async function submit(requests) {
  const fits = [];
  const refused = [];
  for (const json of requests) { // one by one, so that they are fitted in the order in which they stand
    try {
      fits.push(await get("/v1/fits", { method: "POST", json }));
    } catch (error) {
      refused.push(`${json.model}: ${error instanceof Error ? error.message : error}`);
    }
  }
  if (fits.length > 0) present(fits);
  if (refused.length > 0) throw new Error(refused.join("\n"));
}

/**
 * Show fits by their ids, as a permalink or a reload asks for.
 * @param {string[]} ids
 */
export async function open(ids) {
  const answers = await Promise.allSettled(ids.map((id) => get(`/v1/fits/${encodeURIComponent(id)}`)));
  const fits = answers.flatMap((answer) => (answer.status === "fulfilled" ? [answer.value] : []));
  const lost = answers.find((answer) => answer.status === "rejected");
  complain("earlier-error", lost?.status === "rejected" ? lost.reason : null);
  if (fits.length === 0) return;
  present(fits);
  const name = fits[0].request.dataset;
  if (name === null || name === state.dataset?.id) return;
  state.dataset = state.samples = null;
  changed("dataset");
  changed("samples");
  try {
    await show(await get(`/v1/datasets/${name}`));
  } catch (error) {
    complain("measurement-error", error);
  }
}

/** @param {import("./state.js").Fit[]} fits */
function present(fits) {
  streams.abort();
  streams = new AbortController();
  state.fits = new Map(fits.map((fit) => [fit.id, fit]));
  state.chosen = state.values = null;
  history.replaceState(null, "", `#fit=${fits.map((fit) => fit.id).join(",")}`);
  changed("fits");
  at("progress").hidden = false;
  at("jobs").replaceChildren(...fits.map((fit) => row(fit, streams.signal)));
  const best = ranked()[0];
  if (best) choose(best.id);
  else changed("chosen");
  if (fits.some((fit) => !fit.result)) at("progress").scrollIntoView({ block: "nearest" });
}

/**
 * The line of a fit, which follows it to its end.
 * @param {import("./state.js").Fit} fit
 * @param {AbortSignal} signal
 */
function row(fit, signal) {
  const name = nameOf(fit);
  const bar = made("progress", { max: 1, "aria-label": `Progress of ${name}` });
  const said = made("span", { class: "note", role: "status" });
  const svg = sparkline(name);
  const cancel = made("button", { type: "button", class: "small", "aria-label": `Cancel ${name}` }, "Cancel");
  const failure = made("p", { class: "error", role: "alert", hidden: true });
  /** @type {number[]} */
  const losses = [];
  const tell = (/** @type {any} */ now) => {
    const { status, progress, error } = now;
    const loss = progress?.loss ?? null;
    if (loss !== null) losses.push(Math.min(loss, losses.at(-1) ?? loss)); // the lowest so far: starts are tried in turn
    bar.value = status === "succeeded" ? 1 : (progress?.fraction ?? 0);
    said.textContent = `${WORDS[status]}${loss === null ? "" : `, loss ${shown(loss)}`}`;
    svg.draw(losses);
    cancel.hidden = FINISHED.includes(status);
    failure.hidden = !error;
    failure.textContent = error ?? "";
  };
  cancel.addEventListener("click", async () => {
    cancel.disabled = true;
    try {
      await ask(`/v1/fits/${fit.id}/cancel`, { method: "POST" });
    } catch (error) {
      if (!(error instanceof Refusal && error.status === 409)) failing(failure, error); // 409: it has just ended
    }
  });
  tell(fit.result ? { ...fit, progress: { fraction: 1, loss: fit.result.objective } } : fit);
  if (!FINISHED.includes(fit.status)) {
    follow(fit.id, tell, signal)
      .then(() => get(`/v1/fits/${fit.id}`, { signal }))
      .then((ended) => {
        if (ended.result) tell({ ...ended, progress: { fraction: 1, loss: ended.result.objective } });
        arrived(ended);
      })
      .catch((error) => signal.aborted || failing(failure, error));
  }
  return made("div", { class: "job" }, made("span", { class: "code" }, name), bar, said, svg.element, made("span", {}, cancel), failure);
}

/** @param {any} element @param {unknown} error */
function failing(element, error) {
  element.hidden = false;
  element.textContent = error instanceof Error ? error.message : String(error);
}

/** @param {import("./state.js").Fit} fit that has ended */
function arrived(fit) {
  state.fits.set(fit.id, fit);
  changed("fits");
  const best = ranked()[0];
  if (best && fit.result && (state.chosen === null || ((best.job ?? best.id) === fit.id && state.values === null))) choose(best.id);
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
