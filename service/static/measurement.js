/** Step 1: a file becomes a dataset, with the samples that are drawn of it. */

import { ask, get, Refusal } from "./api.js";
import { at, complain, inWords } from "./dom.js";
import { newest, subject } from "./latest.js";
import { remember } from "./names.js";
import { asked, COLUMNS, close, nameColumns, offerColour, question, textual } from "./questions.js";
import { about, changed, on, state } from "./state.js";

const COLOURED = "its spectrum as red, green and blue under daylight (linear sRGB, D65)";
const GENERATED = "generated from published parameters with stated noise, not measured";

/** @type {{id: string, file: File, remark: string} | null} the file of the page's dataset, while it is at hand */
let source = null;

/** Listen to the whole window as a drop zone, to the file field and to the example's button. */
export function install() {
  at("file").addEventListener("change", () => at("file").files[0] && take(at("file").files[0]));
  at("example").addEventListener("click", example);
  for (const name of ["dragenter", "dragover"]) window.addEventListener(name, (event) => hover(/** @type {DragEvent} */ (event), true));
  for (const name of ["dragleave", "drop"]) window.addEventListener(name, (event) => hover(/** @type {DragEvent} */ (event), false));
  window.addEventListener("drop", (event) => dropped([...(event.dataTransfer?.files ?? [])]));
  document.addEventListener("keydown", (event) => event.key === "Escape" && !at("ask").hidden && cancel());
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
  event.preventDefault(); // a file must not replace the page
  if (event.type !== "dragleave" || event.relatedTarget === null) at("drop").classList.toggle("over", over);
}

/** @param {File[]} files */
function dropped([file, ...rest]) {
  if (!file) return;
  at("measurement").scrollIntoView({ block: "nearest" });
  take(file, {}, "", rest.length > 0 ? `One at a time: ${rest.map((one) => one.name).join(", ")} left out.` : "");
}

async function example() {
  const signal = subject();
  try {
    const content = await (await ask("/static/example.csv", { signal })).blob();
    signal.throwIfAborted();
    await take(new File([content], "red_linoleum.csv"), {}, GENERATED);
  } catch (error) {
    complain("measurement-error", error);
  }
}

/**
 * Upload a file with what has been declared of it so far, and make the page about it; ask for what it does not say.
 * Until it is accepted the page stays about what it was about.
 * @param {File} file
 * @param {Record<string, string>} declared
 * @param {string} remark what else is known of it
 * @param {string} aside what else is told once
 */
async function take(file, declared = {}, remark = "", aside = "") {
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
    source = { id: dataset.id, file, remark };
    remember(dataset.id, { name: file.name, remark });
    begin(dataset);
    const left = before > state.fits.size ? "What was fitted before is under Earlier fits." : "";
    wait("", [`${file.name} was read${remark && `: ${remark}`}.`, left, aside].filter(Boolean).join(" "));
    if (Object.keys(declared).length > 0) at("about").focus({ preventScroll: true });
    offerColour(dataset.report.channels, () => take(file, { ...declared, rgb: "true" }, COLOURED));
  } catch (error) {
    if (signal.aborted) return;
    wait("", aside);
    await answerable(file, declared, remark, error, signal);
  } finally {
    at("file").value = ""; // so that the same file can be chosen again
  }
}

/**
 * Tell why a file was not read, and ask what may help: what the refusal names, or else what was answered last.
 * @param {File} file
 * @param {Record<string, string>} declared
 * @param {string} remark
 * @param {unknown} error
 * @param {AbortSignal} signal of the file
 */
async function answerable(file, declared, remark, error, signal) {
  const named = error instanceof Refusal ? error.field : null;
  const table = named === COLUMNS || (named === "format" && (await textual(file)));
  if (signal.aborted) return;
  const field = table ? COLUMNS : asked(named) ? named : Object.keys(declared).filter(asked).at(-1);
  const first = asked(named) && !(named in declared);
  if (!first) complain("measurement-error", `${file.name}: ${forVisitors(inWords(error))}`);
  if (field === undefined) return;
  wait(`Answer the question about ${file.name} first, or cancel it.`, at("measurement-said").textContent);
  const answered = (/** @type {string} */ answer) => take(file, { ...declared, [field]: answer }, remark);
  if (field === COLUMNS) nameColumns(declared[COLUMNS], answered, cancel);
  else question(file.name, field, declared[field], answered, cancel);
}

/** Leave a file that asks a question; the page is about what it was about. */
function cancel() {
  if (state.pending !== "") subject(); // which takes back what was said of the file
  close();
  at("file").focus({ preventScroll: true });
}

/** @returns {(() => void) | null} what declares the page's measurement anew, where its file is at hand */
export function declaredAnew() {
  const now = source;
  if (now === null || now.id !== state.dataset?.id) return null;
  return () => take(now.file, {}, now.remark === COLOURED ? "" : now.remark);
}

/**
 * Let the page be about a dataset; the browser's way back leads to what it was about.
 * @param {import("./state.js").Dataset} dataset
 */
function begin(dataset) {
  if (state.fits.size > 0 && dataset.id !== state.dataset?.id) history.pushState(null, "", location.pathname + location.search);
  about(dataset, [...state.fits.values()]);
}

/** @param {string} pending why nothing can be fitted now @param {string} said what is told of the file */
function wait(pending, said) {
  state.pending = pending;
  at("measurement-said").textContent = said;
  close();
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

/** The sentence of a refusal without the advice for those who call the library. @param {string} sentence */
function forVisitors(sentence) {
  return sentence.replace(/ (?:For a table\b|Pass format\b).*?(?= Known:|$)/, "").replace(" Known:", " Known formats:");
}
