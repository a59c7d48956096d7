/** Earlier fits: found, opened and removed. */

import { ask, get } from "./api.js";
import { at, complain, made, table } from "./dom.js";
import { open } from "./jobs.js";
import { newest } from "./latest.js";
import { nameOf, on, present, state } from "./state.js";

/** @type {import("./state.js").Fit[]} */
let listed = [];
/** @type {string | null} */
let next = null;

const latestList = newest();

/** List the newest fits, and again whenever one has ended. */
export async function install() {
  at("find-fit").addEventListener("input", show);
  at("more").addEventListener("click", () => load(next));
  on("fits", () => load(null));
  await load(null);
}

/** @param {string | null} cursor */
async function load(cursor) {
  const signal = latestList();
  try {
    const page = await get(`/v1/fits?limit=20${cursor === null ? "" : `&cursor=${cursor}`}`, { signal });
    listed = cursor === null ? page.items : [...listed, ...page.items];
    next = page.next;
    at("more").hidden = next === null;
    complain("earlier-error", null, "list");
    show();
  } catch (error) {
    complain("earlier-error", error, "list");
  }
}

function show() {
  const focused = document.activeElement?.getAttribute("data-does");
  const wanted = at("find-fit").value.trim().toLowerCase();
  const text = (/** @type {any} */ fit) => `${nameOf(fit)} ${fit.request.loss} ${fit.status} ${fit.id} ${fit.created}`.toLowerCase();
  const found = listed.filter((fit) => text(fit).includes(wanted));
  const rows = found.map((/** @type {any} */ fit) => [
    new Date(fit.created).toLocaleString(undefined, { dateStyle: "short", timeStyle: "short" }),
    made("span", { class: "code" }, nameOf(fit)),
    fit.request.loss,
    fit.status,
    made("div", { class: "row tight" }, opening(fit), removal(fit)),
  ]);
  const none = made("p", { class: "hint" }, listed.length ? "None of those listed has that in it." : "None yet: what you fit is kept here.");
  at("fits").replaceChildren(rows.length ? table("Earlier fits, the newest first", ["When", "Model", "Loss", "Status", ""], rows) : none);
  if (focused) /** @type {HTMLElement | null} */ (document.querySelector(`[data-does="${focused}"]`))?.focus();
}

/** @param {any} fit */
function opening(fit) {
  const press = async () => {
    complain("earlier-error", null);
    try {
      await open([fit.id]);
      at("measurement").scrollIntoView();
    } catch (error) {
      complain("earlier-error", error);
    }
  };
  return made("button", { type: "button", class: "small", onclick: press, "aria-label": `Open ${nameOf(fit)}`, "data-does": `open ${fit.id}` }, "Open");
}

/** A button that asks once more before it removes. @param {any} fit */
function removal(fit) {
  const button = made("button", { type: "button", class: "small", "data-does": `remove ${fit.id}` });
  const say = (/** @type {string} */ text) => {
    button.textContent = text;
    button.setAttribute("aria-label", `${text.replace("?", "")} ${nameOf(fit)}${text.endsWith("?") ? "?" : ""}`);
  };
  say("Remove");
  button.addEventListener("click", () => (button.textContent === "Remove" ? say("Really remove?") : remove(fit)));
  button.addEventListener("blur", () => say("Remove"));
  return button;
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
  if (state.fits.has(fit.id)) present([...state.fits.values()].filter((one) => one.id !== fit.id));
  const left = document.querySelectorAll("#fits [data-does^=remove]");
  /** @type {HTMLElement} */ (left[Math.min(place, left.length - 1)] ?? at("find-fit")).focus();
}
