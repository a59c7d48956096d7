/** Step 1: a file becomes a dataset, with the samples that are drawn of it. */

import { ask, get, Refusal } from "./api.js";
import { at, complain, inWords } from "./dom.js";
import { newest, subject } from "./latest.js";
import { asked, COLUMNS, nameColumns, offerColour, question } from "./questions.js";
import { about, changed, on, state } from "./state.js";

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
  on("dataset", () => {
    wait(state.pending, "");
    draw();
  });
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
  const signal = subject();
  try {
    const content = await (await ask("/static/example.csv", { signal })).blob();
    signal.throwIfAborted();
    await take(new File([content], "red_linoleum.csv"), {}, "generated from published parameters with stated noise, not measured");
  } catch (error) {
    complain("measurement-error", error);
  }
}

/**
 * Upload a file with what has been declared of it so far, and make the page about it; ask for what it does not say.
 * @param {File} file
 * @param {Record<string, string>} declared
 * @param {string} remark what else is known of it
 */
async function take(file, declared = {}, remark = "") {
  const signal = subject();
  const giveUp = () => {
    wait("", "");
    complain("measurement-error", null);
  };
  signal.addEventListener("abort", giveUp);
  complain("measurement-error", null);
  wait(`Reading ${file.name} …`, `Reading ${file.name} …`);
  try {
    const query = new URLSearchParams(declared);
    const headers = { "content-type": "application/octet-stream" };
    const dataset = await get(`/v1/datasets?${query}`, { method: "POST", body: file, headers, signal });
    signal.removeEventListener("abort", giveUp);
    const before = state.fits.size;
    begin(dataset);
    const left = before > state.fits.size ? " What was fitted before is under Earlier fits." : "";
    wait("", `${file.name} was read${remark && `: ${remark}`}.${left}`);
    offerColour(dataset.report.channels, () => take(file, { ...declared, rgb: "true" }, "its spectrum as red, green and blue under daylight (linear sRGB, D65)"));
  } catch (error) {
    if (signal.aborted) return;
    wait("", "");
    const field = error instanceof Refusal ? (error.field === "format" ? COLUMNS : error.field) : null;
    const open = asked(field) && !(field in declared);
    if (open || field === COLUMNS) {
      begin(null);
      wait(`Answer the question about ${file.name} first.`, "");
    }
    if (open) question(file.name, field, (answer) => take(file, { ...declared, [field]: answer }));
    if (field === COLUMNS) nameColumns(declared[COLUMNS], (names) => take(file, { ...declared, [COLUMNS]: names }));
    if (!open) complain("measurement-error", `${file.name}: ${inShort(error)}`);
  } finally {
    at("file").value = ""; // so that the same file can be chosen again
  }
}

/**
 * Let the page be about a dataset, or about a file that is none yet; the browser's way back leads to what it was about.
 * @param {import("./state.js").Dataset | null} dataset
 */
function begin(dataset) {
  if (state.fits.size > 0 && dataset?.id !== state.dataset?.id) history.pushState(null, "", location.pathname + location.search);
  about(dataset, dataset === null ? [] : [...state.fits.values()]);
}

/** @param {string} pending why nothing can be fitted now @param {string} said what is told of the file */
function wait(pending, said) {
  state.pending = pending;
  at("measurement-said").textContent = said;
  at("ask").hidden = true;
  changed("pending");
}

const latestSamples = newest();

/** Fetch the samples that are drawn of the dataset. */
async function draw() {
  const signal = latestSamples();
  complain("measurement-error", null, "samples");
  if (state.dataset === null) return;
  try {
    state.samples = await get(`/v1/datasets/${state.dataset.id}/samples?limit=2000`, { signal });
    changed("samples");
  } catch (error) {
    complain("measurement-error", error, "samples");
  }
}

/** The sentence of an error; of formats that it lists, the names only. @param {unknown} error */
function inShort(error) {
  const [sentence, known] = inWords(error).split(" Known: ");
  return known === undefined ? sentence : `${sentence} Known: ${known.split("; ").map((one) => one.split(" ")[0]).join(", ")}.`;
}
