/** The line of a fit under way: its progress, its falling loss, and a button that cancels it or takes it off the page. */

import { ask, followed, Refusal } from "./api.js";
import { at, inWords, made, shown } from "./dom.js";
import { nameOf } from "./fit.js";
import { arrived, state, takeOff } from "./state.js";

const FINISHED = ["succeeded", "failed", "cancelled"];
/** @type {Record<string, string>} */
const WORDS = { queued: "waiting", running: "running", succeeded: "done", failed: "failed", cancelled: "cancelled" };

/**
 * The line of a fit, which follows it to its end.
 * @param {import("./state.js").Fit} fit
 * @returns {{element: HTMLElement, leave: AbortController, manner: (text: string) => void}} its element, what ends the following, and what says how it was asked for
 */
export function line(fit) {
  const leave = new AbortController();
  const name = nameOf(fit);
  const manner = made("span", { class: "hint" });
  const bar = made("progress", { max: 1, "aria-label": `Progress of ${name}` });
  const said = made("span", { class: "note" });
  const spoken = made("span", { class: "seen-by-readers", role: "status" }); // its losses would be too much to hear
  const svg = sparkline(name);
  const cancel = made("button", { type: "button", class: "small", "aria-label": `Cancel ${name}` }, "Cancel");
  const off = made("button", { type: "button", class: "small", "aria-label": `Take ${name} off the page` }, "Take off");
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
  const measure = state.dataset?.report.has_sigma ? "chi-square" : "loss"; // stated errors weigh every sample
  let words = "";
  const tell = (/** @type {any} */ { status, progress, error }) => {
    const loss = progress?.loss ?? null;
    if (loss !== null) losses.push(Math.min(loss, losses.at(-1) ?? loss)); // the lowest so far: starts are tried in turn
    bar.value = status === "succeeded" ? 1 : (progress?.fraction ?? 0);
    said.textContent = words = `${WORDS[status]}${loss === null ? "" : `, ${measure} ${shown(loss)}`}`;
    if (spoken.dataset.status !== status) spoken.textContent = `${name}: ${WORDS[status]}`;
    spoken.dataset.status = status;
    svg.draw(losses);
    const focused = document.activeElement === cancel;
    cancel.hidden = FINISHED.includes(status);
    off.hidden = !cancel.hidden;
    if (focused && cancel.hidden) off.focus({ preventScroll: true });
    fail("fit", error);
    fail("cancel", null);
  };
  const ended = (/** @type {import("./state.js").Fit} */ now) =>
    tell(now.result ? { ...now, progress: { fraction: 1, loss: now.result.objective } } : now);
  const lost = (/** @type {unknown} */ error) => {
    said.textContent = error === null ? words : error instanceof Refusal ? "trying again …" : "connection lost, trying again …";
    fail("stream", error instanceof Refusal ? error.message : null);
  };
  off.addEventListener("click", () => {
    takeOff(fit.id);
    at(state.fits.size > 0 ? "progress" : "models").focus({ preventScroll: true });
  });
  cancel.addEventListener("click", async () => {
    if (cancel.hasAttribute("aria-disabled")) return;
    cancel.setAttribute("aria-disabled", "true");
    fail("cancel", null);
    try {
      await ask(`/v1/fits/${fit.id}/cancel`, { method: "POST" });
    } catch (error) {
      cancel.removeAttribute("aria-disabled");
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
  const element = made("div", { class: "job" }, made("div", {}, made("span", { class: "code" }, name), " ", manner), bar, said, svg.element, made("span", {}, cancel, off, spoken), failure);
  return { element, leave, manner: (/** @type {string} */ text) => (manner.textContent = text) };
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
