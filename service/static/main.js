/** The page starts here. */

import { onReached, Unreached } from "./api.js";
import * as choice from "./choice.js";
import { at, complain, forgive } from "./dom.js";
import * as earlier from "./earlier.js";
import * as facts from "./facts.js";
import { prepare } from "./figures.js";
import * as hand from "./hand.js";
import * as jobs from "./jobs.js";
import * as key from "./key.js";
import * as legend from "./legend.js";
import * as look from "./look.js";
import * as measurement from "./measurement.js";
import * as offers from "./offers.js";
import * as result from "./result.js";
import * as sphere from "./sphere.js";
import { on, present, state } from "./state.js";
import * as take from "./take.js";
import * as where from "./where.js";

onReached(() => forgive((error) => error instanceof Unreached));
key.install();
measurement.install();
facts.install();
jobs.install();
result.install();
sphere.install();
hand.install();
legend.install();
look.install();
take.install();
where.install();
within();
on("dataset", () => complain("link-error", null));
window.addEventListener("hashchange", linked);
await choice.install().catch((error) => complain("choose-error", error));
await linked();
await earlier.install();
prepare();
await offers.install().catch(() => undefined); // without it the page offers less

/** Show the fits that the address names, as #fit=ID or #fit=ID,ID; none where it names none. */
async function linked() {
  if (location.hash && !location.hash.startsWith("#fit=")) return;
  const ids = location.hash.slice("#fit=".length).split(",").filter(Boolean);
  complain("link-error", null);
  if (ids.join() === [...state.fits.keys()].join()) return;
  if (ids.length === 0) return present([]);
  await jobs.open(ids).catch((error) => complain("link-error", error));
}

/** Links within the page move the view, and leave the address to name the fits. */
function within() {
  for (const link of document.querySelectorAll('a[href^="#"]')) {
    link.addEventListener("click", (event) => {
      event.preventDefault();
      const target = at(/** @type {string} */ (link.getAttribute("href")).slice(1));
      target.scrollIntoView();
      target.querySelector("input")?.focus({ preventScroll: true });
    });
  }
}
