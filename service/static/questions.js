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

/**
 * Ask for one of a few answers.
 * @param {string} name of the file
 * @param {string} field one that is `asked`
 * @param {(answer: string) => void} answered
 */
export function question(name, field, answered) {
  const [text, answers] = QUESTIONS[field];
  const choices = answers.map(([value, meaning]) =>
    made("label", { class: "check" }, made("input", { type: "radio", name: field, value, required: true }), meaning),
  );
  const parts = [
    made("fieldset", {}, made("legend", {}, `${name} does not say: ${text}`), ...choices),
    made("button", { type: "submit", class: "primary" }, "Go on"),
  ];
  ask(parts, () => answered(String(new FormData(at("ask")).get(field))));
  at("ask").querySelector("input").focus();
}

/**
 * Ask for the columns of a table.
 * @param {string | undefined} before what was answered last, which was wrong
 * @param {(names: string) => void} answered
 */
export function nameColumns(before, answered) {
  const input = made("input", { type: "text", id: COLUMNS, name: COLUMNS, required: true, autocomplete: "off", spellcheck: "false", value: before ?? USUAL, "aria-describedby": "columns-hint" });
  const parts = [
    made("label", { for: COLUMNS }, "If it is a table of numbers, what are its columns, from the left?"),
    made("div", { class: "row" }, input, made("button", { type: "submit", class: "primary" }, "Read it so")),
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
