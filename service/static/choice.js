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
const PLACE = "brdf-choice"; // of the form in this tab's memory
const FIRST = ["ward_bounded", "ggx"]; // of the list: what is fitted most

let asking = false; // while the service has not yet accepted what was asked for

/** Fill the form from the service's own lists, and fit on its word. */
export async function install() {
  for (const [value, text] of Object.entries(LOSSES)) at("loss").append(made("option", { value }, text));
  at("find-model").addEventListener("input", filter);
  at("find-model").addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => event.key === "Enter" && event.preventDefault()); // it finds, and fits nothing
  at("choose").addEventListener("submit", begin);
  for (const act of ["change", "input"]) at("choose").addEventListener(act, remember);
  at("choose").addEventListener("change", ready);
  at("text").addEventListener("input", ready);
  on("dataset", ready);
  on("pending", ready);
  state.models = (await get("/v1/models")).items;
  const isDiffuse = (/** @type {any} */ model) => named(model, "kd");
  const lobes = state.models.filter((model) => !isDiffuse(model));
  // a diffuse term with an f0 is tied to a lobe's: that is for the text field
  const diffuse = state.models.filter((model) => isDiffuse(model) && !named(model, "f0"));
  lobes.sort((a, b) => Number(FIRST.includes(b.name)) - Number(FIRST.includes(a.name)));
  at("lobes").append(...lobes.map(entry));
  at("diffuse").append(...diffuse.map(({ name, good_for }) => made("option", { value: name }, `${name}: ${good_for}`)), made("option", { value: "" }, "none"));
  recall();
  ready();
}

/** @param {any} model @param {string} parameter */
function named(model, parameter) {
  return model.parameters.some((/** @type {any} */ one) => one.name === parameter);
}

/** @param {any} model */
function entry({ name, good_for: line }) {
  const box = made("input", { type: "checkbox", name: "lobe", value: name });
  return made("label", { class: "model" }, box, made("span", {}, made("b", {}, name), made("span", {}, line)));
}

/** @returns {any[]} the controls that say what is fitted */
function fields() {
  return [...at("choose").querySelectorAll("input:not(#find-model), select, textarea")];
}

/** Keep what is chosen, so that a reload finds it. */
function remember() {
  const chosen = fields().map((field) => [field.id || field.value, field.type === "checkbox" ? field.checked : field.value]);
  sessionStorage.setItem(PLACE, JSON.stringify(Object.fromEntries(chosen)));
}

function recall() {
  const chosen = JSON.parse(sessionStorage.getItem(PLACE) ?? "{}");
  for (const field of fields()) {
    const value = chosen[field.id || field.value];
    if (value === undefined) continue;
    if (field.type === "checkbox") field.checked = value;
    else field.value = value;
  }
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
  const auto = at("use-auto").checked ? ["auto"] : [];
  return [...new Set([...auto, ...lobes, ...own])];
}

function ready() {
  const count = texts().length;
  const missing = state.pending || (state.dataset === null ? "Choose a measurement first." : count === 0 ? "Choose a model." : "");
  at("start").disabled = missing !== "";
  at("start").setAttribute("aria-disabled", String(asking)); // it keeps the keyboard meanwhile
  at("start").textContent = count > 1 ? `Fit ${count} models` : "Fit";
  at("start-hint").textContent = missing;
}

/** @param {Event} event */
async function begin(event) {
  event.preventDefault();
  if (state.dataset === null || asking) return;
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
