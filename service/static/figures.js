/** Plotly, fetched when the first figure is drawn, in the page's own colours. */

export const SERIES = 6; // colours of curves, in the order of the ranking

/** @type {Promise<any> | null} */
let fetched = null;

/** @returns {Promise<any>} */
function plotly() {
  fetched ??= new Promise((done, fail) => {
    writeStylesAsObjects();
    const script = document.createElement("script");
    script.src = "/static/plotly/plotly-basic.min.js";
    script.onload = () => done(/** @type {any} */ (window).Plotly);
    script.onerror = () => {
      fetched = null;
      fail(new Error("The figures could not be loaded from the service. Reload the page."));
    };
    document.head.append(script);
  });
  return fetched;
}

/** Plotly sets style attributes as text, which the security policy forbids; through the object model it is allowed. */
function writeStylesAsObjects() {
  const plain = Element.prototype.setAttribute;
  Element.prototype.setAttribute = function (/** @type {string} */ name, /** @type {string} */ value) {
    if (name === "style") /** @type {any} */ (this).style.cssText = value;
    else plain.call(this, name, value);
  };
}

/** Fetch Plotly ahead of need, and draw a first figure that nobody sees, when the page has nothing else to do. */
export function prepare() {
  setTimeout(() => plotly().then((library) => setTimeout(() => warm(library), 50)).catch(() => undefined), 200);
}

/** What a figure takes the first time, taken when nobody waits for it. @param {any} library */
async function warm(library) {
  const unseen = document.createElement("div");
  await library.newPlot(unseen, [{ type: "scatter", mode: "lines+markers", x: [0, 1], y: [0, 1] }], { width: 200, height: 100 }, { displayModeBar: false });
  library.purge(unseen);
}

/** The colours of the page as it stands, light or dark. */
export function colours() {
  const style = getComputedStyle(document.documentElement);
  const named = (/** @type {string} */ name) => style.getPropertyValue(`--${name}`).trim();
  return {
    ink: named("ink"), soft: named("soft"), line: named("line"), bad: named("bad"), card: named("card"),
    series: Array.from({ length: SERIES }, (_, k) => named(`series-${k}`)),
  };
}

/**
 * Draw a figure, or redraw it.
 * @param {HTMLElement} element
 * @param {any[]} traces
 * @param {any} layout
 */
export async function draw(element, traces, layout) {
  const library = await plotly();
  const { ink, soft, line } = colours();
  const axis = { gridcolor: line, linecolor: soft, zerolinecolor: line, tickfont: { color: soft, size: 12 } };
  const whole = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { color: ink, size: 13, family: "system-ui, sans-serif" },
    margin: { l: 54, r: 16, t: 14, b: 46 }, showlegend: false, hovermode: "closest", ...layout,
  };
  for (const name of ["xaxis", "yaxis"]) {
    if (layout[name]) whole[name] = { ...axis, ...layout[name], title: { font: { size: 13 }, standoff: 8, ...layout[name].title } };
  }
  await library.react(element, traces, whole, { displayModeBar: false, responsive: true });
  await new Promise((done) => setTimeout(done)); // figures that are drawn together do not make one long stall
}
