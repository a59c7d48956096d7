/** The page starts here. */

import * as choice from "./choice.js";
import { at, complain } from "./dom.js";
import * as earlier from "./earlier.js";
import { prepare } from "./figures.js";
import * as hand from "./hand.js";
import { open } from "./jobs.js";
import * as key from "./key.js";
import * as look from "./look.js";
import * as measurement from "./measurement.js";
import * as offers from "./offers.js";
import * as result from "./result.js";
import * as sphere from "./sphere.js";
import { state } from "./state.js";
import * as take from "./take.js";
import * as where from "./where.js";

key.install();
measurement.install();
result.install();
sphere.install();
hand.install();
look.install();
take.install();
where.install();
within();
window.addEventListener("hashchange", linked);
await choice.install().catch((error) => complain("choose-error", error));
await linked();
await earlier.install();
prepare();
await offers.install().catch(() => undefined); // without it the page offers less

/** Show the fits that the address names, as #fit=ID or #fit=ID,ID. */
async function linked() {
  const ids = new URLSearchParams(location.hash.slice(1)).get("fit")?.split(",").filter(Boolean) ?? [];
  if (ids.length > 0 && ids.join() !== [...state.fits.keys()].join()) await open(ids);
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
