/** Step 6: what one takes away: the report, the figures, files for other programs, a link, and code that does the same. */

import { ask, hasKey } from "./api.js";
import { at, complain, made, save } from "./dom.js";
import { svg } from "./figures.js";
import { chosen, nameOf, on, state } from "./state.js";

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
}

function show() {
  const fit = chosen();
  at("take").hidden = fit === null;
  if (fit === null) return;
  const link = `${location.origin}/#fit=${fit.job ?? fit.id}`;
  const figures = ["lobes", "albedo"].flatMap((name) => ["svg", "png"].map((kind) => button(`${name} ${kind.toUpperCase()}`, () => plot(fit, name, kind))));
  at("taking").replaceChildren(
    made("div", { class: "row" },
      made("b", {}, "Files"),
      button("Report", async () => save(new Blob([fit.result.report], { type: "text/plain" }), `${fit.id}.txt`)),
      button("Result as JSON", async () => save(new Blob([JSON.stringify(fit.result, null, 2)], { type: "application/json" }), `${fit.id}.json`)),
      ...formats.map((format) => offered(fit, format)),
    ),
    ...(drawable(fit) ? [] : [made("p", { class: "hint" }, `The files of other programs hold one channel, or red, green and blue; this material has ${fit.result.channels.length}.`)]),
    made("div", { class: "row" },
      made("b", {}, "Figures"), ...figures,
      button("residuals SVG", async () => save(await svg(at("residuals")), `${fit.id}_residuals.svg`)),
      button("lobe in space PNG", () => picture("solid", `${fit.id}_lobe.png`)),
      button("sphere PNG", () => picture("sphere", `${fit.id}_sphere.png`)),
    ),
    made("div", { class: "row" }, made("b", {}, "Link"), made("a", { href: link, id: "permalink" }, link), copy("Copy the link", () => link)),
    made("div", { class: "pair" }, code("Python", python(fit)), code("curl", curl(fit))),
    made("p", { class: "hint", role: "status", id: "copied" }),
  );
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
  const element = button(format, () => exported(fit, format));
  element.disabled = format !== "json" && !drawable(fit);
  return element;
}

/** @param {string} id of a canvas @param {string} name of the file */
async function picture(id, name) {
  at(id).toBlob((/** @type {Blob} */ content) => save(content, name));
}

/** @param {import("./state.js").Fit} fit @param {string} name @param {string} kind */
async function plot(fit, name, kind) {
  const asked = new URLSearchParams({ channel: fit.result.channels[state.channel], rank: String(fit.rank ?? 1) });
  if (name === "albedo") asked.set("phi_deg", String(state.phi));
  else asked.append("scale", state.scale), asked.append("theta_i_deg", String(state.theta));
  const answer = await ask(`/v1/fits/${fit.job ?? fit.id}/plots/${name}.${kind}?${asked}`);
  save(await answer.blob(), `${fit.id}_${name}.${kind}`);
}

/** @param {import("./state.js").Fit} fit @param {string} format */
async function exported(fit, format) {
  const answer = await ask(`/v1/fits/${fit.job ?? fit.id}/export/${format}?rank=${fit.rank ?? 1}`);
  const name = /filename="([^"]+)"/.exec(answer.headers.get("content-disposition") ?? "")?.[1];
  save(await answer.blob(), name ?? `${fit.id}.${format}`);
}

/** @param {string} title @param {string} text */
function code(title, text) {
  const head = made("div", { class: "head" }, made("h3", {}, title), copy(`Copy the ${title} lines`, () => text));
  return made("div", {}, head, made("pre", { tabindex: 0, "aria-label": `${title} lines` }, text));
}

/** @param {string} text @param {() => string} content */
function copy(text, content) {
  return button(text, async () => {
    await navigator.clipboard.writeText(content());
    at("copied").textContent = "Copied.";
  });
}

/** Options of a request that are not as they are by default. @param {any} request */
function told(request) {
  const { loss, conserve_energy, max_theta_deg, seed, fixed, starts } = request;
  return {
    ...(loss === "cosine" ? {} : { loss }),
    ...(conserve_energy ? { conserve_energy } : {}),
    ...(max_theta_deg === null ? {} : { max_theta_deg }),
    ...(seed === 0 ? {} : { seed }),
    ...(Object.keys(fixed).length ? { fixed } : {}),
    ...(starts.length ? { starts } : {}),
  };
}

/** @param {import("./state.js").Fit} fit */
function python(fit) {
  const literal = (/** @type {unknown} */ value) => (value === true ? "True" : JSON.stringify(value));
  const options = Object.entries(told(fit.request)).map(([name, value]) => `, ${name}=${literal(value)}`).join("");
  const key = hasKey() ? ", api_key=KEY" : "";
  return `from service.client import Client

with Client("${location.origin}"${key}) as client:
    fit = client.fit("FILE", model="${nameOf(fit)}"${options})
    print(fit.report())`;
}

/** @param {import("./state.js").Fit} fit */
function curl(fit) {
  const key = hasKey() ? " -H 'Authorization: Bearer KEY'" : "";
  const body = JSON.stringify({ dataset: fit.request.dataset ?? "DATASET", model: nameOf(fit), ...told(fit.request) }, null, 1).replaceAll("\n", "").replaceAll("{ ", "{");
  return `curl -sS${key} --data-binary @FILE ${location.origin}/v1/datasets
curl -sS${key} -H 'Prefer: wait=30' -H 'Content-Type: application/json' \\
     ${location.origin}/v1/fits -d '${body}'`;
}
