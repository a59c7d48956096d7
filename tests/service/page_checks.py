"""What a page must have everywhere, asked in the page itself: contrast, and a label on every control."""

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

# controls that a reader of the screen could not name
UNLABELLED = """() => {
  const controls = document.querySelectorAll("input, select, textarea, button, [tabindex='0'], progress");
  const named = (element) => element.labels?.length || element.getAttribute("aria-label")
    || element.getAttribute("aria-labelledby") || (element.tagName === "BUTTON" && element.textContent.trim());
  return [...controls].filter((element) => !named(element)).map((element) => element.outerHTML.slice(0, 120));
}"""
