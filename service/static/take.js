/** Step 6: what one takes away: the report, the figures, files for other programs, a link, and code that does the same. */

import { ask, hasKey } from "./api.js";
import { at, complain, made, save, shown } from "./dom.js";
import { nameOf } from "./fit.js";
import { lobeOf } from "./look.js";
import { nameOfDataset } from "./names.js";
import { picture } from "./solid.js";
import { pictured } from "./sphere.js";
import { chosen, on, state } from "./state.js";

/** What a request for a fit says where nothing is asked for; the rest of it is told. @type {Record<string, unknown>} */
const DEFAULTS = {
  loss: "cosine", optimizer: "auto", fixed: {}, gray: [], per_channel: [], seed: 0, bounds: {}, starts: [],
  robust: null, robust_scale: null, max_theta_deg: null, conserve_energy: false,
};

/** What other programs get, by format. @type {Record<string, string>} */
const FILES = { json: "material as JSON", brdf_explorer: "shader for BRDF Explorer", mitsuba: "material for Mitsuba", radiance: "material for Radiance", merl: "MERL table" };
const LARGE = 512; // pixels of a picture to keep

/** @type {string[]} formats of GET /v1/fits/{id}/export/{format}, where this service has it */
let formats = [];

/** Offer files for other programs. @param {string[]} names */
export function offerExports(names) {
  formats = names;
  show();
}

/** Show what there is for the chosen fit. */
export function install() {
  on("chosen", show);
  on("values", () => (at("as-it-was").hidden = state.values === null));
}

function show() {
  const fit = chosen();
  at("take").hidden = fit === null;
  if (fit === null) return;
  const link = `${location.origin}/#fit=${fit.job ?? fit.id}`;
  const address = made("a", { href: link, id: "permalink" }, link);
  const figures = ["lobes", "albedo", "residuals"].flatMap((name) => ["svg", "png"].map((kind) => button(`${name} ${kind.toUpperCase()}`, () => plot(fit, name, kind))));
  at("taking").replaceChildren(
    taken("Files",
      button("Report", async () => save(new Blob([fit.result.report], { type: "text/plain" }), fileName(fit, "report.txt"))),
      button("Result as JSON", async () => save(new Blob([JSON.stringify(fit.result, null, 2)], { type: "application/json" }), fileName(fit, "result.json"))),
      ...formats.map((format) => offered(fit, format)),
    ),
    ...(drawable(fit) ? [] : [taken("", made("p", { class: "hint" }, `The files of other programs hold one channel, or red, green and blue; this material has ${fit.result.channels.length}.`))]),
    taken("Figures", ...figures,
      button("lobe in space PNG", async () => save(await picture(await lobeOf(fit), `${fit.result.model}, light at ${shown(state.theta)}°`), fileName(fit, "lobe_in_space.png"))),
      button("sphere PNG", async () => save(await pictured(fit, fit.result.material.values, undefined, LARGE), fileName(fit, "sphere.png"))),
    ),
    made("p", { class: "hint", id: "as-it-was", hidden: state.values === null }, "All of this is of the fit as it was fitted. What you change by hand is in it once you fit again from there."),
    taken("Link", address, copy("Copy the link", address)),
    made("div", { class: "pair" }, code("Python", python(fit)), code("curl", curl(fit))),
    made("p", { class: "hint" }, `${fit.request.dataset === null ? "SAMPLES stands for the samples, as the request held them" : "FILE stands for the measured file"}${hasKey() ? ", KEY for the key" : ""}.`),
    made("p", { class: "hint", role: "status", id: "copied" }),
  );
}

/** A file's name, after the measurement, the model and what it is. @param {import("./state.js").Fit} fit @param {string} what */
function fileName(fit, what) {
  const measurement = (nameOfDataset(fit.request.dataset)?.name ?? "fit").replace(/\.\w+$/, "");
  return [measurement, fit.result.model, what].join("_").replace(/\([^)]*\)/g, "").replace(/[^\w.+-]+/g, "");
}

/** @param {string} title @param {...Node} things */
function taken(title, ...things) {
  return made("div", { class: "taken" }, made("b", {}, title), made("div", { class: "row" }, ...things));
}

/** @param {string} text @param {() => Promise<void>} action */
function button(text, action) {
  const press = async () => {
    complain("take-error", null);
    await action().catch((error) => complain("take-error", error));
  };
  return made("button", { type: "button", class: "small", onclick: press }, text);
}

/** @param {import("./state.js").Fit} fit @returns {boolean} whether other programs have its number of channels */
function drawable(fit) {
  const values = /** @type {any[]} */ (Object.values(fit.result.material.values));
  return [1, 3].includes(Math.max(...values.map((value) => (Array.isArray(value) ? value.length : 1))));
}

/** @param {import("./state.js").Fit} fit @param {string} format */
function offered(fit, format) {
  const element = button(FILES[format] ?? format, () => exported(fit, format));
  element.disabled = format !== "json" && !drawable(fit);
  return element;
}

/** @param {import("./state.js").Fit} fit @param {string} name @param {string} kind */
async function plot(fit, name, kind) {
  const asked = new URLSearchParams({ channel: fit.result.channels[state.channel], rank: String(fit.rank ?? 1) });
  if (name === "albedo") asked.set("phi_deg", String(state.phi));
  if (name === "lobes") asked.append("scale", state.scale), asked.append("theta_i_deg", String(state.theta));
  const answer = await ask(`/v1/fits/${fit.job ?? fit.id}/plots/${name}.${kind}?${asked}`);
  save(await answer.blob(), fileName(fit, `${name}.${kind}`));
}

/** @param {import("./state.js").Fit} fit @param {string} format */
async function exported(fit, format) {
  const answer = await ask(`/v1/fits/${fit.job ?? fit.id}/export/${format}?rank=${fit.rank ?? 1}`);
  const ending = /filename="[^"]*?(\.[^"]+)"/.exec(answer.headers.get("content-disposition") ?? "")?.[1] ?? `.${format}`;
  save(await answer.blob(), fileName(fit, `${format === "json" ? "material" : format}${ending}`));
}

/** @param {string} title @param {string} text */
function code(title, text) {
  const lines = made("pre", { tabindex: 0, "aria-label": `${title} lines` }, text);
  return made("div", {}, made("div", { class: "head" }, made("h3", {}, title), copy(`Copy the ${title} lines`, lines)), lines);
}

/** A button that copies the text of an element; where the browser forbids that, it is left selected. @param {string} text @param {HTMLElement} element */
function copy(text, element) {
  return button(text, async () => {
    try {
      await navigator.clipboard.writeText(element.textContent ?? "");
      at("copied").textContent = "Copied.";
    } catch {
      getSelection()?.selectAllChildren(element);
      at("copied").textContent = "The browser lets only pages from https or from this machine copy. The text is selected: press Ctrl+C, or ⌘C.";
    }
  });
}

/** What a request asks for beyond what is so by default. @param {any} request @returns {[string, unknown][]} */
function told({ dataset, samples, model, models, ...options }) {
  return Object.entries(options).filter(([name, value]) => JSON.stringify(value) !== JSON.stringify(DEFAULTS[name]));
}

/** What was declared of the measured file. @returns {[string, string | boolean][]} */
function declared() {
  return /** @type {any} */ (Object.entries(state.dataset?.declared ?? {}).filter(([, value]) => value !== null && value !== false));
}

/** @param {import("./state.js").Fit} fit */
function python(fit) {
  const literal = (/** @type {unknown} */ value) => (value === true ? "True" : JSON.stringify(value));
  const options = [["model", nameOf(fit)], ...declared(), ...told(fit.request)].map(([name, value]) => `${name}=${literal(value)}`);
  const given = [fit.request.dataset === null ? "SAMPLES" : '"FILE"', ...options];
  const short = given.join(", ");
  const key = hasKey() ? ", api_key=KEY" : "";
  return `from service.client import Client

with Client("${location.origin}"${key}) as client:
    fit = client.fit(${short.length < 52 ? short : given.map((one) => `\n        ${one},`).join("") + "\n    "})
    print(fit.report())`;
}

/** @param {import("./state.js").Fit} fit */
function curl(fit) {
  const { dataset } = fit.request;
  const quoted = (/** @type {string} */ text) => `'${text.replaceAll("'", "'\\''")}'`;
  const key = hasKey() ? " -H 'Authorization: Bearer KEY'" : "";
  const query = new URLSearchParams(declared().map(([name, value]) => [name, String(value)]));
  const upload = `curl -sS${key} --data-binary @FILE ${quoted(`${location.origin}/v1/datasets${query.size ? "?" : ""}${query}`)}\n`;
  const data = dataset === null ? { samples: "SAMPLES" } : { dataset };
  const fields = Object.entries({ ...data, model: nameOf(fit), ...Object.fromEntries(told(fit.request)) });
  const body = `{${fields.map(([name, value]) => `\n  ${JSON.stringify(name)}: ${JSON.stringify(value)}`).join()}}`;
  return `${dataset === null ? "" : upload}curl -sS${key} -H 'Prefer: wait=30' -H 'Content-Type: application/json' \\
     ${location.origin}/v1/fits -d ${quoted(body)}`;
}
