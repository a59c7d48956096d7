/** Earlier fits: found, opened and removed. */

import { ask, get } from "./api.js";
import { at, complain, made, table } from "./dom.js";
import { open } from "./jobs.js";
import { nameOf, on, state } from "./state.js";

/** @type {import("./state.js").Fit[]} */
let listed = [];
/** @type {string | null} */
let next = null;

/** List the newest fits, and again whenever one has ended. */
export async function install() {
  at("find-fit").addEventListener("input", show);
  at("more").addEventListener("click", () => load(next));
  on("fits", () => load(null));
  await load(null);
}

/** @param {string | null} cursor */
async function load(cursor) {
  try {
    const page = await get(`/v1/fits?limit=20${cursor === null ? "" : `&cursor=${cursor}`}`);
    listed = cursor === null ? page.items : [...listed, ...page.items];
    next = page.next;
    at("more").hidden = next === null;
    show();
  } catch (error) {
    complain("earlier-error", error);
  }
}

function show() {
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
  const none = made("p", { class: "hint" }, listed.length ? "None of those listed has that in it." : "None yet.");
  at("fits").replaceChildren(rows.length ? table("Earlier fits, the newest first", ["When", "Model", "Loss", "Status", ""], rows) : none);
}

/** @param {any} fit */
function opening(fit) {
  const press = () => open([fit.id]).then(() => at("measurement").scrollIntoView());
  return made("button", { type: "button", class: "small", onclick: press, "aria-label": `Open ${nameOf(fit)}` }, "Open");
}

/** A button that asks once more before it removes. @param {any} fit */
function removal(fit) {
  const button = made("button", { type: "button", class: "small", "aria-label": `Remove ${nameOf(fit)}` }, "Remove");
  button.addEventListener("click", async () => {
    if (button.textContent === "Remove") {
      button.textContent = "Really remove?";
      button.setAttribute("aria-label", `Really remove ${nameOf(fit)}?`);
      return;
    }
    try {
      await ask(`/v1/fits/${fit.id}`, { method: "DELETE" });
      listed = listed.filter((one) => one.id !== fit.id);
      if (state.fits.has(fit.id)) location.hash = "";
      show();
    } catch (error) {
      complain("earlier-error", error);
    }
  });
  button.addEventListener("blur", () => {
    button.textContent = "Remove";
    button.setAttribute("aria-label", `Remove ${nameOf(fit)}`);
  });
  return button;
}
