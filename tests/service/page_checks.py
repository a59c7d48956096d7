"""What a page must have everywhere, asked in the page itself: contrast, and controls with names that keys reach."""

import json
from typing import Any

# texts with less than 4.5 : 1 against what is behind them (WCAG 2.2, 1.4.3), each with its colour
LOW_CONTRASTS = """() => {
  const parse = (text) => (text.match(/[\\d.]+/g) ?? [0, 0, 0, 0]).map(Number);
  const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  const light = ([r, g, b]) => 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const colour = parse(getComputedStyle(e).backgroundColor);
      if (colour.length === 3 || colour[3] === 1) return colour;
    }
    return [255, 255, 255];
  };
  const low = [];
  let seen = 0;
  for (const element of document.querySelectorAll("body *")) {
    const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
    if (!own || !element.checkVisibility()) continue;
    seen += 1;
    const style = getComputedStyle(element);
    const front = parse(element.closest("svg") ? style.fill : style.color);
    const [dark, bright] = [light(front), light(behind(element))].sort((x, y) => x - y);
    const text = element.textContent.trim().slice(0, 40);
    if ((bright + 0.05) / (dark + 0.05) < 4.5) low.push(`${element.tagName} ${text} ${front}`);
  }
  return seen > 50 ? low : [`only ${seen} texts were seen`];
}"""

# what a reader of the screen could not name or would get wrong: controls and pictures without a name, names that point
# nowhere, ids that are there twice, and an order of the keyboard other than that of the page
UNLABELLED = """() => {
  const said = (node) => (node ? [node.getAttribute?.("aria-label"), node.textContent, node.getAttribute?.("alt")] : [])
    .find((text) => text?.trim())?.trim() ?? "";
  const pointed = (element, attribute) => (element.getAttribute(attribute) ?? "").split(" ").filter(Boolean);
  const named = (element) => {
    const by = pointed(element, "aria-labelledby");
    if (by.length) return by.every((id) => said(document.getElementById(id)));
    if (element.getAttribute("aria-label")?.trim()) return true;
    if (element.labels) return [...element.labels].some((label) => {
      const copy = label.cloneNode(true);
      copy.querySelectorAll("select, option, output, textarea").forEach((one) => one.remove());
      return said(copy);
    }) || (element.tagName === "BUTTON" && Boolean(said(element)));
    return Boolean(said(element));
  };
  const all = "input, select, textarea, button, a[href], summary, [tabindex='0'], progress, [role=img], [role=region], "
    + "img:not([alt=''])";
  const nameless = [...document.querySelectorAll(all)].filter((element) => !named(element))
    .map((element) => element.outerHTML.slice(0, 120));
  const ids = [...document.querySelectorAll("body [id]")].map((element) => element.id);
  const twice = ids.filter((id, k) => ids.indexOf(id) !== k && !id.startsWith("clip")).map((id) => `id ${id} twice`);
  const pointers = ["aria-labelledby", "aria-describedby", "for", "list"].flatMap((attribute) =>
    [...document.querySelectorAll(`body [${attribute}]`)].flatMap((e) => pointed(e, attribute))
      .filter((id) => !document.getElementById(id)).map((id) => `${attribute} ${id} points nowhere`));
  const ahead = [...document.querySelectorAll("[tabindex]")].filter((e) => e.tabIndex > 0)
    .map((e) => `${e.id} jumps ahead`);
  return [...nameless, ...twice, ...pointers, ...ahead];
}"""

# every control that the keyboard has to reach, marked; of radio buttons, one a group
MARK_CONTROLS = """() => {
  const all = [...document.querySelectorAll("input, select, textarea, button, a[href], summary, [tabindex='0']")];
  const needed = all.filter((e) => e.checkVisibility() && !e.disabled && (e.type !== "radio" || e.checked));
  needed.forEach((element, k) => element.setAttribute("data-reach", k));
  document.activeElement.blur();
  window.scrollTo(0, 0);
  return needed.length;
}"""
FOCUSED = "document.activeElement === document.body ? null : document.activeElement.getAttribute('data-reach')"
REACH = "(k) => document.querySelector(`[data-reach='${k}']`).outerHTML.slice(0, 120)"


def unreached(page: Any) -> list[str]:
    """The visible controls that the Tab key does not come to, in a round through the page."""
    count = page.evaluate(MARK_CONTROLS)
    reached = set()
    for _ in range(count + 20):
        page.keyboard.press("Tab")
        reached.add(page.evaluate(FOCUSED))
    assert count > 20, f"only {count} controls were seen"
    return [page.evaluate(REACH, k) for k in range(count) if str(k) not in reached]


def longest_task(trace: bytes) -> float:
    """The processor's time in the longest task of a page's main thread [ms], of a trace that the browser has made.

    Its own time, not the clock's: what else the machine does at the time stalls no page.
    """
    events = json.loads(trace)["traceEvents"]
    mains = {
        (e["pid"], e["tid"]) for e in events if e["name"] == "thread_name" and e["args"]["name"] == "CrRendererMain"
    }
    tasks = [e for e in events if e["name"].endswith("RunTask") and (e["pid"], e["tid"]) in mains]
    return max(float(e.get("tdur", 0)) for e in tasks) / 1000
