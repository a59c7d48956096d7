/** Earlier fits: found, opened and removed. */

import { ask, get } from "./api.js";
import { confirmed } from "./confirm.js";
import { at, complain, inPlace, made, table } from "./dom.js";
import { nameOf } from "./fit.js";
import { reopen } from "./jobs.js";
import { newest } from "./latest.js";
import { nameOfDataset } from "./names.js";
import { on, state, takeOff } from "./state.js";

const PAGE = 20; // fits that are asked for at a time
const WHOLE = 100; // and at most, where all are searched

/** @type {import("./state.js").Fit[]} */
let listed = [];
/** @type {string | null} */
let next = null;

const latestList = newest();

/** List the newest fits, and again whenever one has ended. */
export async function install() {
  at("find-fit").addEventListener("input", () => {
    show();
    if (sought() && next !== null) extend(Infinity);
  });
  at("more").addEventListener("click", () => extend(listed.length + PAGE));
  on("fits", () => load(listed.length));
  await load(PAGE);
}

/** @returns {string} */
function sought() {
  return at("find-fit").value.trim().toLowerCase();
}

/** List the newest fits anew. @param {number} count at least so many, where there are */
function load(count) {
  return list([], null, sought() ? Infinity : count);
}

/** List more of them. @param {number} count at least so many, where there are */
function extend(count) {
  return list(listed, next, count);
}

/** @param {import("./state.js").Fit[]} found before @param {string | null} cursor @param {number} count */
async function list(found, cursor, count) {
  const signal = latestList();
  try {
    do {
      const limit = Math.min(Math.max(count - found.length, PAGE), WHOLE);
      const page = await get(`/v1/fits?limit=${limit}${cursor === null ? "" : `&cursor=${cursor}`}`, { signal });
      found = [...found, ...page.items];
      cursor = page.next;
    } while (cursor !== null && found.length < count);
    [listed, next] = [found, cursor];
    at("more").hidden = next === null;
    complain("earlier-error", null, "list");
    show();
  } catch (error) {
    complain("earlier-error", error, "list");
  }
}

/** @param {any} fit @returns {string} */
function measurementOf(fit) {
  return nameOfDataset(fit.request.dataset)?.name ?? "";
}

function show() {
  const text = (/** @type {any} */ fit) => `${nameOf(fit)} ${measurementOf(fit)} ${fit.request.loss} ${fit.status} ${fit.id} ${fit.created}`.toLowerCase();
  const found = listed.filter((fit) => text(fit).includes(sought()));
  const rows = found.map((/** @type {any} */ fit) => [
    new Date(fit.created).toLocaleString(undefined, { dateStyle: "short", timeStyle: "short" }),
    made("div", {}, made("span", { class: "code" }, nameOf(fit)), " ", made("span", { class: "hint" }, measurementOf(fit))),
    fit.request.loss,
    fit.status,
    made("div", { class: "row tight" }, opening(fit), confirmed("Remove", nameOf(fit), `remove ${fit.id}`, () => remove(fit))),
  ]);
  const none = made("p", { class: "hint" }, !listed.length ? "None yet: what you fit is kept here." : next === null ? "None of them has that in it." : "Looking …");
  inPlace(at("fits"), () => at("fits").replaceChildren(rows.length ? table("Earlier fits, the newest first", ["When", "Model", "Loss", "Status", ""], rows) : none));
}

/** @param {any} fit */
function opening(fit) {
  const press = async () => {
    complain("earlier-error", null);
    await reopen(fit).catch((error) => complain("earlier-error", error));
  };
  return made("button", { type: "button", class: "small", onclick: press, "aria-label": `Open ${nameOf(fit)}`, "data-does": `open ${fit.id}` }, "Open");
}

/** Remove a fit for good, from the page too; the keyboard stays at its place in the list. @param {any} fit */
async function remove(fit) {
  complain("earlier-error", null);
  try {
    await ask(`/v1/fits/${fit.id}`, { method: "DELETE" });
  } catch (error) {
    return complain("earlier-error", error);
  }
  const buttons = [...document.querySelectorAll("#fits [data-does^=remove]")];
  const place = buttons.findIndex((button) => button.getAttribute("data-does") === `remove ${fit.id}`);
  listed = listed.filter((one) => one.id !== fit.id);
  show();
  if (state.fits.has(fit.id)) takeOff(fit.id);
  const left = document.querySelectorAll("#fits [data-does^=remove]");
  /** @type {HTMLElement} */ (left[Math.min(place, left.length - 1)] ?? at("find-fit")).focus();
}
