/** Step 2: which models are fitted, and how. */

import { get } from "./api.js";
import { at, complain, made } from "./dom.js";
import { submit } from "./jobs.js";
import { on, state } from "./state.js";

const LOSSES = {
  cosine: "cosine: peaks count most",
  l2: "l2: peaks, averaged by area",
  cube_root: "cube_root: peaks and tails",
  log: "log: tails count more",
  relative: "relative: every sample alike",
};
const AT_FIRST = ["ward_bounded", "ggx"];

let asking = false; // while the service has not yet accepted what was asked for

/** Fill the form from the service's own lists, and fit on its word. */
export async function install() {
  for (const [value, text] of Object.entries(LOSSES)) at("loss").append(made("option", { value }, text));
  at("find-model").addEventListener("input", filter);
  at("find-model").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => event.key === "Enter" && event.preventDefault()); // it finds, and fits nothing
  at("choose").addEventListener("submit", begin);
  at("choose").addEventListener("change", ready);
  at("text").addEventListener("input", ready);
  on("dataset", ready);
  on("pending", ready);
  state.models = (await get("/v1/models")).items;
  const isDiffuse = (/** @type {any} */ model) => named(model, "kd");
  const lobes = state.models.filter((model) => !isDiffuse(model));
  // a diffuse term with an f0 is tied to a lobe's: that is for the text field
  const diffuse = state.models.filter((model) => isDiffuse(model) && !named(model, "f0"));
  lobes.sort((a, b) => Number(AT_FIRST.includes(b.name)) - Number(AT_FIRST.includes(a.name)));
  at("lobes").append(...lobes.map(entry));
  at("diffuse").append(...diffuse.map(({ name }) => made("option", { value: name }, name)), made("option", { value: "" }, "none"));
  ready();
}

/** @param {any} model @param {string} parameter */
function named(model, parameter) {
  return model.parameters.some((/** @type {any} */ one) => one.name === parameter);
}

/** @param {any} model */
function entry({ name, summary }) {
  const box = made("input", { type: "checkbox", name: "lobe", value: name, checked: AT_FIRST.includes(name) });
  return made("label", { class: "model" }, box, made("span", {}, made("b", {}, name), made("span", {}, summary)));
}

/** Offer the choice by the data where this service knows it. */
export function offerAuto() {
  at("auto").replaceChildren(
    made("label", { class: "check" }, made("input", { type: "checkbox", id: "use-auto" }), "auto: add the effects that the data call for, one by one"),
  );
}

function filter() {
  const wanted = at("find-model").value.trim().toLowerCase();
  for (const label of at("lobes").querySelectorAll("label")) // what will be fitted stays in sight
    label.hidden = !label.textContent.toLowerCase().includes(wanted) && !label.querySelector("input").checked;
}

/** @returns {string[]} the models' texts, each once */
function texts() {
  const diffuse = at("diffuse").value;
  const lobes = [...at("lobes").querySelectorAll("input:checked")].map((box) => (diffuse ? `${diffuse} + ${box.value}` : box.value));
  const own = at("text").value.split("\n").map((/** @type {string} */ line) => line.trim()).filter(Boolean);
  const auto = document.querySelector("#use-auto:checked") ? ["auto"] : [];
  return [...new Set([...auto, ...lobes, ...own])];
}

function ready() {
  const count = texts().length;
  const missing = state.pending || (state.dataset === null ? "Choose a measurement first." : count === 0 ? "Choose a model." : "");
  at("start").disabled = asking || missing !== "";
  at("start").textContent = count > 1 ? `Fit ${count} models` : "Fit";
  at("start-hint").textContent = missing;
}

/** @param {Event} event */
async function begin(event) {
  event.preventDefault();
  if (state.dataset === null) return;
  complain("choose-error", null);
  asking = true;
  ready();
  const common = { dataset: state.dataset.id, loss: at("loss").value, conserve_energy: at("conserve").checked };
  try {
    await submit(texts().map((model) => ({ ...common, model })));
  } catch (error) {
    complain("choose-error", error);
  } finally {
    asking = false;
    ready();
  }
}
