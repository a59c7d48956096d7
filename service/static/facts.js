/** What a measurement is, in a list of facts. */

import { at, made, shown } from "./dom.js";
import { declaredAnew } from "./measurement.js";
import { nameOfDataset } from "./names.js";
import { inPlain } from "./questions.js";
import { on, state } from "./state.js";

/** Show them whenever there is another measurement. */
export function install() {
  on("dataset", describe);
}

function describe() {
  const about = at("about");
  if (state.dataset === null) return about.replaceChildren();
  const { id, report, bytes, declared } = state.dataset;
  const file = nameOfDataset(id);
  const again = declaredAnew();
  const answers = inPlain(declared);
  const range = (/** @type {number[]} */ [low, high]) => (low === high ? `${shown(low)}°` : `${shown(low)}° to ${shown(high)}°`);
  const facts = {
    ...(file ? { File: file.name + (file.remark && `: ${file.remark}`) } : {}),
    Format: `${report.format}, ${bytes.toLocaleString("en")} bytes`,
    Samples: report.samples.toLocaleString("en"),
    Channels: report.channels.length > 8 ? `${report.channels.length}, ${report.channels[0]} to ${report.channels.at(-1)}` : report.channels.join(", "),
    Light: `${range(report.theta_i_deg)} from the normal`,
    Viewer: `${range(report.theta_o_deg)} from the normal`,
    Sample: report.azimuth_observed ? "turned, so anisotropy can be seen" : "not turned, so models stay isotropic",
    Values: `${shown(report.value_range[0])} to ${shown(report.value_range[1])} 1/sr, from ${report.quantity}`
      + (report.negative_values ? `; ${report.negative_values.toLocaleString("en")} negative` : ""),
    Errors: report.has_sigma ? "stated for each sample" : "not stated",
    "Left out": report.masked.length === 0 ? "nothing" : report.masked.map((/** @type {any} */ one) => `${one.count.toLocaleString("en")}: ${one.reason}`).join("; "),
    ...(answers ? { Declared: made("span", {}, `${answers} `, again && made("button", { type: "button", class: "small", onclick: again, "aria-label": "Change what is declared" }, "Change")) } : {}),
  };
  const rows = Object.entries(facts).flatMap(([name, value]) => [made("dt", {}, name), made("dd", {}, value)]);
  about.replaceChildren(made("dl", { class: "facts" }, ...rows));
}
