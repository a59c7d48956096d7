/** What measurements are called and what is known of them, kept by this browser: the service knows their content only. */

const PLACE = "brdf-measurements";
const MOST = 200; // that are kept; the oldest goes first

/** @typedef {{name: string, remark: string}} Name of the file, and what else is known of it */

/** @type {Map<string, Name>} by the id of the dataset */
const known = new Map(kept());

/** @returns {[string, Name][]} */
function kept() {
  try {
    return JSON.parse(localStorage.getItem(PLACE) ?? "[]");
  } catch {
    return []; // the browser keeps nothing for pages, or something else wrote there
  }
}

/** @param {string} dataset id @param {Name} name */
export function remember(dataset, name) {
  known.delete(dataset);
  known.set(dataset, name);
  while (known.size > MOST) known.delete(/** @type {string} */ (known.keys().next().value));
  try {
    localStorage.setItem(PLACE, JSON.stringify([...known]));
  } catch {
    // it is known until the page is left
  }
}

/** @param {string | null} dataset id @returns {Name | null} */
export function nameOfDataset(dataset) {
  return (dataset !== null && known.get(dataset)) || null;
}
