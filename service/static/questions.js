/** The questions that a file leaves open, in the form under the drop zone. */

import { at, made } from "./dom.js";

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
export const COLUMNS = "columns";
const USUAL = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value";

/** @param {string | null} field @returns {field is string} whether it is asked for in words of its own */
export function asked(field) {
  return field !== null && field in QUESTIONS;
}

/** @param {Record<string, string | boolean | null>} declared of a dataset @returns {string} that in words, "" for nothing */
export function inPlain(declared) {
  const words = (/** @type {string} */ field) => QUESTIONS[field]?.[1].find(([value]) => value === declared[field])?.[1] ?? `${field} ${declared[field]}`;
  const told = Object.keys(declared).filter((field) => declared[field] !== null && declared[field] !== false);
  return told.map((field) => (field === "rgb" ? "its spectrum read as red, green and blue" : words(field))).join("; ");
}

/**
 * Ask for one of a few answers.
 * @param {string} name of the file
 * @param {string} field one that is `asked`
 * @param {string | undefined} before what was answered last, which was refused
 * @param {(answer: string) => void} answered
 * @param {() => void} cancelled
 */
export function question(name, field, before, answered, cancelled) {
  const [text, answers] = QUESTIONS[field];
  const choices = answers.map(([value, meaning]) =>
    made("label", { class: "check" }, made("input", { type: "radio", name: field, value, required: true, checked: value === before }), meaning),
  );
  const parts = [
    made("fieldset", {}, made("legend", {}, before === undefined ? `${name} does not say: ${text}` : `${name} cannot be read so: ${text}`), ...choices),
    made("div", { class: "row" }, made("button", { type: "submit", class: "primary" }, "Go on"), leaving(cancelled)),
  ];
  ask(parts, () => answered(String(new FormData(at("ask")).get(field))));
  at("ask").querySelector("input:checked, input").focus();
}

/**
 * Ask for the columns of a table.
 * @param {string | undefined} before what was answered last, which was wrong
 * @param {(names: string) => void} answered
 * @param {() => void} cancelled
 */
export function nameColumns(before, answered, cancelled) {
  const input = made("input", { type: "text", id: COLUMNS, name: COLUMNS, required: true, autocomplete: "off", spellcheck: "false", value: before ?? USUAL, "aria-describedby": "columns-hint" });
  const parts = [
    made("label", { for: COLUMNS }, "If it is a table of numbers, what are its columns, from the left?"),
    made("div", { class: "row" }, input, made("button", { type: "submit", class: "primary" }, "Read it so"), leaving(cancelled)),
    made("p", { class: "hint", id: "columns-hint" }, "Four angles, or wi_x to wo_z, in any order, and a name for each value. Without _deg or _rad, the unit is asked for."),
  ];
  ask(parts, () => answered(input.value.trim()));
  input.focus();
}

/**
 * Of a file whose channels are wavelengths, offer the colour that the eye sees.
 * @param {string[]} channels
 * @param {() => void} taken
 */
export function offerColour(channels, taken) {
  if (channels.length <= 3 || !channels.every((name) => /^\d{3,}(\.\d+)?\s*(nm)?$/.test(name))) return;
  ask([
    made("p", { class: "hint" }, "The channels are wavelengths. Renderers take three colours: "),
    made("button", { type: "submit" }, "Read as red, green and blue"),
  ], taken);
}

/** @param {() => void} cancelled */
function leaving(cancelled) {
  return made("button", { type: "button", onclick: cancelled }, "Cancel");
}

/** Take the question back. */
export function close() {
  at("ask").hidden = true;
}

/** @param {Blob} file @returns {Promise<boolean>} whether it begins as text with a line that is no comment, so that it may be a table */
export async function textual(file) {
  const head = await file.slice(0, 4096).arrayBuffer();
  try {
    const text = new TextDecoder("utf-8", { fatal: true }).decode(head, { stream: true });
    return !/[\x00-\x08]/.test(text) && /^[^\S\n]*[^#\s]/m.test(text);
  } catch {
    return false;
  }
}

/** @param {Node[]} parts of the form @param {() => void} answered */
function ask(parts, answered) {
  const form = at("ask");
  form.replaceChildren(...parts);
  form.onsubmit = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    answered();
  };
  form.hidden = false;
}
