/** Elements of the page: found, made, and told to say something. */

/**
 * The element of that id.
 * @param {string} id
 * @returns {any}
 */
export function at(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`no element ${id}`);
  return found;
}

/**
 * A new element; attributes that start with "on" are listeners, true is an empty attribute, false and null are none.
 * @param {string} tag
 * @param {Record<string, any>} attributes
 * @param {...(Node | string | number | null)} children
 * @returns {any}
 */
export function made(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null).map((child) => (child instanceof Node ? child : String(child))));
  return element;
}

/**
 * A table whose cells copy as text; a cell is a text, a number or an element.
 * @param {string} caption what the table is, for readers of the screen
 * @param {string[]} titles those that end in # head columns of numbers
 * @param {any[][]} rows
 * @returns {HTMLElement}
 */
export function table(caption, titles, rows) {
  const kind = (/** @type {number} */ k) => (titles[k].endsWith("#") ? { class: "number" } : {});
  const head = made("tr", {}, ...titles.map((title, k) => made("th", { scope: "col", ...kind(k) }, title.replace("#", ""))));
  const body = rows.map((row) => made("tr", {}, ...row.map((cell, k) => made("td", kind(k), cell))));
  return made(
    "div",
    { class: "scroll", tabindex: 0, role: "region", "aria-label": caption },
    made("table", {}, made("caption", { class: "seen-by-readers" }, caption), made("thead", {}, head), made("tbody", {}, ...body)),
  );
}

/** A material's text that may be broken where its options begin, too. @param {string} text @returns {HTMLElement} */
export function breakable(text) {
  const [first, ...rest] = text.split("(");
  return made("span", {}, first, ...rest.flatMap((part) => ["(", made("wbr"), part]));
}

/** @type {Map<string, Map<string, unknown>>} what stands where, and from where it came */
const complaints = new Map();

/**
 * Show an error in words where it arose, or take it back. What was given up for something newer is no error.
 * @param {string} id of the element
 * @param {unknown} error null for none
 * @param {string} source of several that complain in one element, each takes back its own
 */
export function complain(id, error, source = "") {
  if (error instanceof DOMException && error.name === "AbortError") return;
  const all = complaints.get(id) ?? new Map();
  complaints.set(id, all);
  if (error === null) all.delete(source);
  else all.set(source, error);
  const element = at(id);
  element.hidden = all.size === 0;
  element.textContent = [...new Set([...all.values()].map(inWords))].join("\n");
}

/** Take back every error of a kind that is over. @param {(error: unknown) => boolean} over */
export function forgive(over) {
  for (const [id, all] of complaints)
    for (const [source, error] of all) if (over(error)) complain(id, null, source);
}

/**
 * Do what replaces elements of a container, and leave the keyboard at the control that was in use there, where there still is one.
 * @param {HTMLElement} container
 * @param {() => void} change
 */
export function inPlace(container, change) {
  const active = container.contains(document.activeElement) ? document.activeElement : null;
  const name = active?.id ? `#${CSS.escape(active.id)}` : active?.hasAttribute("data-does") ? `[data-does="${CSS.escape(active.getAttribute("data-does") ?? "")}"]` : null;
  change();
  if (name !== null && document.activeElement !== active) /** @type {HTMLElement | null} */ (container.querySelector(name))?.focus({ preventScroll: true });
}

/** Bring a part of the page into view, and the keyboard to it. @param {string} id of an element that takes the focus */
export function leadTo(id) {
  at(id).scrollIntoView();
  at(id).focus({ preventScroll: true });
}

/** @param {unknown} error @returns {string} */
export function inWords(error) {
  return error instanceof Error ? error.message : String(error);
}

/**
 * A number with four digits, as people read it.
 * @param {number | null | undefined} x
 * @returns {string}
 */
export function shown(x) {
  if (x === null || x === undefined || !Number.isFinite(x)) return "–";
  const size = Math.abs(x);
  if (size !== 0 && (size < 1e-4 || size >= 1e6)) return x.toExponential(3);
  return String(Number(x.toPrecision(4)));
}

/**
 * Hand the browser a file to save.
 * @param {Blob} content
 * @param {string} name
 */
export function save(content, name) {
  const url = URL.createObjectURL(content);
  made("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
