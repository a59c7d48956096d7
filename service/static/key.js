/** The key field, shown when the service asks for a key. */

import { hasKey, onMissingKey, useKey } from "./api.js";
import { at, complain } from "./dom.js";

/** @type {Promise<void> | null} one question for however many requests wait for it */
let asking = null;

/** Ask for a key whenever a request needs one, and let the request go on with it. */
export function install() {
  onMissingKey(() => (asking ??= asked().finally(() => (asking = null))));
}

/** @returns {Promise<void>} */
function asked() {
  const form = at("key");
  const before = /** @type {HTMLElement} */ (document.activeElement);
  complain("key-error", hasKey() ? "Expected a key that this service knows. Check it, and try again." : null);
  form.hidden = false;
  at("key-text").focus();
  return new Promise((done) => {
    form.onsubmit = (/** @type {Event} */ event) => {
      event.preventDefault();
      try {
        useKey(at("key-text").value.trim());
      } catch (error) {
        complain("key-error", error);
        return at("key-text").focus();
      }
      at("key-text").value = "";
      form.hidden = true;
      (before === document.body ? at("main") : before).focus({ preventScroll: true });
      done();
    };
  });
}
