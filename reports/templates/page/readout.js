// What a figure says of the place that is pointed at.
import { pointer } from "./d3.js";
import { html, show } from "./words.js";

// From the pointer to a panel and the place on it, in the units of the picture.
export const placeOf = (picture, event) => {
  const [x, y] = pointer(event, picture.svg), panel = picture.panels.find((p) => p.holds(x, y));
  return panel ? { panel, x, y } : null;
};
export const read = (chart, picture, event) => {
  const found = placeOf(picture, event);
  if (!found) { chart.hide(); return false; }
  return readAt(chart, picture, found.panel, found.x, found.y);
};
export const readAt = (chart, picture, panel, px, py) => {
  for (const p of chart.panels) p.clear();
  const best = panel.byPoint && panel.nearest(chart, px, py), origin = panel.x.back(px), hertz = panel.byPoint ? best?.curve.parameter?.[best.k] : hertzAt(chart, panel, origin);
  const rows = panel.byPoint ? point(chart, panel, best) : level(chart, picture, panel, origin, hertz);
  chart.readout.hidden = rows.length < 2;
  if (rows.length < 2) return false;
  chart.readout.replaceChildren(html("table", {}, ...rows.map(([colour, name, value]) => html("tr", {}, html("td", { className: "bead", style: colour && `color:${colour}` }, colour && "●"), html("td", {}, name), html("td", "value", value)))));
  chart.tell("at", { hertz, x: panel.x.value(origin) });
  const box = picture.svg.getBoundingClientRect(), own = chart.root.getBoundingClientRect(), scale = box.width / picture.svg.viewBox.baseVal.width;
  const x = box.left - own.left + px * scale, y = box.top - own.top + py * scale, width = chart.readout.offsetWidth;
  chart.readout.style.left = `${Math.max(0, x + 14 + width > own.width ? x - width - 14 : x + 14)}px`;
  chart.readout.style.top = `${Math.max(0, y - chart.readout.offsetHeight - 10)}px`;
  return true;
};
// the frequency of a place along x; a time in a loop's step is half a period: a wave that begins there has its peak then
const hertzAt = (chart, { x }, origin) => {
  const at = x.value(origin);
  if (x.unit === "Hz") return at;
  return chart.loop && x.seconds && at > 0 ? 0.5 / (at * x.seconds) : undefined;
};
const level = (chart, picture, panel, origin, hertz) => {
  const rows = [["", panel.x.name || "x", panel.x.words(panel.x.value(origin))]];
  if (hertz && panel.x.unit !== "Hz") rows.push(["", "half a period of", show(hertz) + " Hz"]);
  for (const p of chart.linked(panel)) {
    p.cursor(origin, "cursor");
    if (!picture.panels.includes(p)) continue;
    for (const curve of p.seen(chart)) {
      const q = p.at(curve, origin), label = chart.labels[curve.key];
      if (!q) continue;
      p.dot(q);
      rows.push([curve.node.style.stroke, label ? `${label}: ${p.y.name}` : p.y.name, p.y.words(p.y.value(q[1]))]);
    }
  }
  return rows;
};
const point = (chart, panel, best) => {
  if (!best || best.d > 60) return [];
  panel.dot(best.q);
  const rows = [[best.curve.node.style.stroke, chart.labels[best.curve.key] || "curve", ""]];
  if (best.curve.parameter) rows.push(["", "frequency", show(best.curve.parameter[best.k]) + " Hz"]);
  for (const [axis, k] of [[panel.x, 0], [panel.y, 1]])
    if (!axis.fixed) rows.push(["", axis.name, axis.words(axis.value(best.q[k]))]);
  return rows;
};
