// What a figure says of the place that is pointed at.
import { html, show } from "./words.js";

// From the pointer to a panel and the place on it, in the units of the picture.
export const placeOf = (picture, event) => {
  const matrix = picture.svg.getScreenCTM();
  if (!matrix) return null;
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
  const panel = picture.panels.find((p) => p.holds(point.x, point.y));
  return panel ? { panel, x: point.x, y: point.y, scale: matrix.a } : null;
};
export const read = (chart, picture, event) => {
  const found = placeOf(picture, event);
  if (!found) { chart.hide(); return false; }
  return readAt(chart, picture, found.panel, found.x, found.y);
};
export const readAt = (chart, picture, panel, px, py) => {
  for (const p of chart.panels) p.clear();
  const rows = panel.byPoint ? point(chart, panel, px, py) : level(chart, picture, panel, px);
  if (rows.length < 2) { chart.readout.hidden = true; return false; }
  fill(chart, rows);
  chart.root.dispatchEvent(new CustomEvent("chart:at", { detail: { hertz: hertzAt(chart, panel, px, py), x: panel.x.value(panel.back(px, 0)[0]) } }));
  const box = picture.svg.getBoundingClientRect(), own = chart.root.getBoundingClientRect();
  const scale = box.width / picture.svg.viewBox.baseVal.width;
  const x = box.left - own.left + px * scale, y = box.top - own.top + py * scale;
  const width = chart.readout.offsetWidth;
  chart.readout.style.left = `${Math.max(0, x + 14 + width > own.width ? x - width - 14 : x + 14)}px`;
  chart.readout.style.top = `${Math.max(0, y - chart.readout.offsetHeight - 10)}px`;
  return true;
};
// the frequency that is pointed at, along an axis or a curve; a time in a loop's step is half a period: a wave that begins there has its peak then
const hertzAt = (chart, panel, px, py) => {
  if (panel.byPoint) { const best = panel.nearest(chart, px, py); return best?.curve.parameter?.[best.k]; }
  const at = panel.x.value(panel.back(px, 0)[0]);
  if (panel.x.unit === "Hz") return at;
  return chart.loop && panel.x.seconds && at > 0 ? 0.5 / (at * panel.x.seconds) : undefined;
};
const level = (chart, picture, panel, px) => {
  const [origin] = panel.back(px, 0);
  const value = panel.x.value(origin);
  const rows = [["", panel.x.name || "x", panel.x.words(value)]], wave = panel.x.unit !== "Hz" && hertzAt(chart, panel, px, 0);
  if (wave) rows.push(["", "half a period of", show(wave) + " Hz"]);
  for (const p of chart.linked(panel)) {
    p.cursor(origin, "cursor");
    if (!picture.panels.includes(p)) continue;
    for (const curve of p.seen(chart)) {
      const q = p.at(curve, origin);
      if (!q) continue;
      p.dot(q);
      rows.push([curve.node.style.stroke, nameOf(chart, curve, p), p.y.words(p.y.value(q[1]))]);
    }
  }
  return rows;
};
const point = (chart, panel, px, py) => {
  const best = panel.nearest(chart, px, py);
  if (!best || best.d > 60) return [];
  panel.dot(best.q);
  const rows = [[best.curve.node.style.stroke, chart.labels[best.curve.key] || "curve", ""]];
  if (best.curve.parameter) rows.push(["", "frequency", show(best.curve.parameter[best.k]) + " Hz"]);
  for (const [axis, k] of [[panel.x, 0], [panel.y, 1]])
    if (!axis.fixed) rows.push(["", axis.name, axis.words(axis.value(best.q[k]))]);
  return rows;
};
const nameOf = (chart, curve, panel) => {
  const label = chart.labels[curve.key];
  return label ? `${label}: ${panel.y.name}` : panel.y.name;
};
const fill = (chart, rows) => {
  const table = html("table");
  for (const [colour, name, value] of rows) {
    const row = html("tr"), dot = html("td", "bead");
    if (colour) dot.style.color = colour;
    dot.textContent = colour ? "●" : "";
    row.append(dot, html("td", "", name), html("td", "value", value));
    table.append(row);
  }
  chart.readout.replaceChildren(table);
  chart.readout.hidden = false;
};
