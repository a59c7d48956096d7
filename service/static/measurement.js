/** Step 1: a file becomes a dataset; what it is, and the questions that it leaves open. */

import { ask, get, Refusal } from "./api.js";
import { at, complain, made, shown } from "./dom.js";
import { changed, on, state } from "./state.js";

/**
 * What a file may leave unsaid: the question, and the answers with what each means.
 * @type {Record<string, [string, [string, string][]]>}
 */
const QUESTIONS = {
  quantity: ["What are the values?", [
    ["brdf", "BRDF, without the cosine [1/sr]"],
    ["brdf_cos", "BRDF times cos θᵢ [1/sr]"],
    ["reflectance_factor", "reflectance factor, 1 for a perfect diffuser"],
  ]],
  angle_unit: ["In what are the angles?", [["degrees", "degrees"], ["radians", "radians"]]],
};

/** What is asked where a file is of no known format, or names no columns; the answer is text. */
const COLUMNS = "columns";
const USUAL = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value";

/** Listen to the drop zone, the file field and the example's button. */
export function install() {
  const drop = at("drop");
  at("file").addEventListener("change", () => at("file").files[0] && take(at("file").files[0]));
  at("example").addEventListener("click", example);
  for (const name of ["dragenter", "dragover"]) drop.addEventListener(name, (/** @type {DragEvent} */ event) => hover(event, true));
  for (const name of ["dragleave", "drop"]) drop.addEventListener(name, (/** @type {DragEvent} */ event) => hover(event, false));
  drop.addEventListener("drop", (/** @type {DragEvent} */ event) => {
    const file = event.dataTransfer?.files[0];
    if (file) take(file);
  });
  // a file that misses the zone must not replace the page
  for (const name of ["dragover", "drop"]) window.addEventListener(name, (event) => event.preventDefault());
  on("dataset", describe);
}

/**
 * @param {DragEvent} event
 * @param {boolean} over
 */
function hover(event, over) {
  event.preventDefault();
  at("drop").classList.toggle("over", over);
}

async function example() {
  const content = await (await ask("/static/example.csv")).blob();
  await take(new File([content], "red_linoleum.csv"), {}, "generated from published parameters with stated noise, not measured");
}

/**
 * Upload a file with what has been declared of it so far; ask for what it does not say.
 * @param {File} file
 * @param {Record<string, string>} declared
 * @param {string} remark what else is known of it
 */
async function take(file, declared = {}, remark = "") {
  complain("measurement-error", null);
  at("ask").hidden = true;
  at("measurement-said").textContent = `Reading ${file.name} …`;
  try {
    const query = new URLSearchParams(declared);
    const headers = { "content-type": "application/octet-stream" };
    const dataset = await get(`/v1/datasets?${query}`, { method: "POST", body: file, headers });
    at("measurement-said").textContent = `${file.name} was read${remark && `: ${remark}`}.`;
    await show(dataset);
    offerColour(file, declared, dataset.report.channels);
  } catch (error) {
    at("measurement-said").textContent = "";
    const field = error instanceof Refusal ? (error.field === "format" ? COLUMNS : error.field) : null;
    const open = field !== null && field in QUESTIONS && !(field in declared);
    if (open) question(file, declared, field);
    if (field === COLUMNS) nameColumns(file, declared);
    if (!open) complain("measurement-error", `${file.name}: ${inShort(error)}`);
  } finally {
    at("file").value = ""; // so that the same file can be chosen again
  }
}

/**
 * @param {File} file
 * @param {Record<string, string>} declared
 * @param {string} field
 */
function question(file, declared, field) {
  const [text, answers] = QUESTIONS[field];
  const choices = answers.map(([value, meaning]) =>
    made("label", { class: "check" }, made("input", { type: "radio", name: field, value, required: true }), meaning),
  );
  const parts = [
    made("fieldset", {}, made("legend", {}, `${file.name} does not say: ${text}`), ...choices),
    made("button", { type: "submit", class: "primary" }, "Go on"),
  ];
  asking(parts, () => take(file, { ...declared, [field]: String(new FormData(at("ask")).get(field)) }));
}

/** @param {File} file @param {Record<string, string>} declared */
function nameColumns(file, declared) {
  const input = made("input", { type: "text", id: COLUMNS, name: COLUMNS, required: true, autocomplete: "off", spellcheck: "false", value: declared[COLUMNS] ?? USUAL, "aria-describedby": "columns-hint" });
  const parts = [
    made("label", { for: COLUMNS }, "If it is a table of numbers, what are its columns, from the left?"),
    made("div", { class: "row" }, input, made("button", { type: "submit", class: "primary" }, "Read it so")),
    made("p", { class: "hint", id: "columns-hint" }, "Four angles, or wi_x to wo_z, in any order, and a name for each value. Without _deg or _rad, the unit is asked for."),
  ];
  asking(parts, () => take(file, { ...declared, [COLUMNS]: input.value.trim() }));
}

/** Ask in the form under the drop zone. @param {Node[]} parts @param {() => void} answered */
function asking(parts, answered) {
  const form = at("ask");
  form.replaceChildren(...parts);
  form.onsubmit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    answered();
  };
  form.hidden = false;
  form.querySelector("input").focus();
}

/** The sentence of an error; of formats that it lists, the names only. @param {unknown} error */
function inShort(error) {
  const [sentence, known] = (error instanceof Error ? error.message : String(error)).split(" Known: ");
  return known === undefined ? sentence : `${sentence} Known: ${known.split("; ").map((one) => one.split(" ")[0]).join(", ")}.`;
}

/**
 * Of a file whose channels are wavelengths, offer the colour that the eye sees.
 * @param {File} file
 * @param {Record<string, string>} declared
 * @param {string[]} channels
 */
function offerColour(file, declared, channels) {
  if (channels.length <= 3 || !channels.every((name) => /^\d{3,}(\.\d+)?\s*(nm)?$/.test(name))) return;
  const form = at("ask");
  form.replaceChildren(
    made("p", { class: "hint" }, "The channels are wavelengths. Renderers take three colours: "),
    made("button", { type: "submit" }, "Read as red, green and blue"),
  );
  form.onsubmit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    take(file, { ...declared, rgb: "true" }, "its spectrum as red, green and blue under daylight (linear sRGB, D65)");
  };
  form.hidden = false;
}

/**
 * Make a dataset the page's, with the samples that are drawn.
 * @param {import("./state.js").Dataset} dataset
 */
export async function show(dataset) {
  state.dataset = dataset;
  state.samples = null;
  changed("dataset");
  changed("samples");
  state.samples = await get(`/v1/datasets/${dataset.id}/samples?limit=2000`);
  changed("samples");
}

function describe() {
  const about = at("about");
  at("ask").hidden = true;
  if (state.dataset === null) return about.replaceChildren();
  const { report, bytes } = state.dataset;
  const range = (/** @type {number[]} */ [low, high]) => (low === high ? `${shown(low)}°` : `${shown(low)}° to ${shown(high)}°`);
  const facts = {
    Format: `${report.format}, ${bytes.toLocaleString("en")} bytes`,
    Samples: report.samples.toLocaleString("en"),
    Channels: report.channels.length > 8 ? `${report.channels.length}, ${report.channels[0]} to ${report.channels.at(-1)}` : report.channels.join(", "),
    Light: `${range(report.theta_i_deg)} from the normal`,
    Viewer: `${range(report.theta_o_deg)} from the normal`,
    Sample: report.azimuth_observed ? "turned, so anisotropy can be seen" : "not turned, so models stay isotropic",
    Values: `${shown(report.value_range[0])} to ${shown(report.value_range[1])} 1/sr, from ${report.quantity}`
      + (report.negative_values ? `; ${report.negative_values} negative` : ""),
    Errors: report.has_sigma ? "stated for each sample" : "not stated",
    "Left out": report.masked.length === 0 ? "nothing" : report.masked.map((/** @type {any} */ one) => `${one.count}: ${one.reason}`).join("; "),
  };
  const rows = Object.entries(facts).flatMap(([name, value]) => [made("dt", {}, name), made("dd", {}, value)]);
  about.replaceChildren(made("dl", { class: "facts" }, ...rows));
}
