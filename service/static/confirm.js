/** A button that asks once more before it does what cannot be undone. */

import { made } from "./dom.js";

const PAUSE = 500; // [ms] in which a second press is still that of a double click

/**
 * @param {string} verb what it does, as it is written on it
 * @param {string} object what it does it to, for readers of the screen
 * @param {string} does names the button among others
 * @param {() => void} action
 * @returns {HTMLButtonElement}
 */
export function confirmed(verb, object, does, action) {
  const button = made("button", { type: "button", class: "small", "data-does": does });
  let armed = false;
  let timer = 0;
  const arm = (/** @type {boolean} */ on) => {
    clearTimeout(timer);
    armed = on;
    button.textContent = on ? `Really ${verb.toLowerCase()}?` : verb;
    button.setAttribute("aria-label", on ? `Really ${verb.toLowerCase()} ${object}?` : `${verb} ${object}`);
    wait(on);
    if (on) timer = window.setTimeout(() => wait(false), PAUSE);
  };
  const wait = (/** @type {boolean} */ on) => (on ? button.setAttribute("aria-disabled", "true") : button.removeAttribute("aria-disabled"));
  arm(false);
  button.addEventListener("click", () => {
    if (!armed) arm(true);
    else if (!button.hasAttribute("aria-disabled")) action();
  });
  button.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
    if (event.key === "Escape") arm(false);
    if (event.repeat && event.key === "Enter") event.preventDefault();
  });
  button.addEventListener("blur", () => arm(false));
  return button;
}
