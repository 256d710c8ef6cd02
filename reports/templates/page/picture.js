// A figure as a file: SVG and PNG as it is seen, its curves as a table.
import { give, make } from "./words.js";

const MARGIN = 10, KEY = 16, DENSE = 2; // DENSE: points of the PNG for one of the page
// pictures side by side and the legend below, with the colours of now in place of their names
const svgOf = (chart) => {
  const colours = getComputedStyle(document.documentElement);
  const put = (node, attributes) => { for (const name in attributes) node.setAttribute(name, attributes[name]); };
  const ink = colours.getPropertyValue("--ink").trim(), whole = make("svg", { "font-family": "sans-serif" });
  let x = MARGIN, high = 0;
  for (const { svg } of chart.pictures) {
    const { width, height } = svg.viewBox.baseVal, copy = svg.cloneNode(true);
    for (const node of copy.querySelectorAll(".over, .grab, [data-off]")) node.remove();
    for (const name of ["class", "style", "aria-label", "role"]) copy.removeAttribute(name);
    put(copy, { x, y: MARGIN, width, height });
    whole.append(copy);
    x += width + MARGIN;
    high = Math.max(high, height);
  }
  let at = MARGIN, y = high + 2 * MARGIN + 8;
  for (const item of chart.root.querySelectorAll(".keys li:not([hidden]):not([aria-pressed=false])")) {
    const wide = 34 + 6.2 * item.textContent.length;
    if (at > MARGIN && at + wide > x) { at = MARGIN; y += KEY; }
    const swatch = item.querySelector("svg").cloneNode(true);
    put(swatch, { x: at, y: y - 10, width: 26, height: 12 });
    swatch.removeAttribute("class");
    make("text", { x: at + 31, y, "font-size": 10.5, fill: ink }, whole).textContent = item.textContent;
    whole.append(swatch);
    at += wide;
  }
  const height = y + MARGIN;
  put(whole, { viewBox: `0 0 ${x} ${height}`, width: x, height });
  whole.prepend(make("rect", { width: x, height, fill: colours.getPropertyValue("--paper").trim() }));
  const text = new XMLSerializer().serializeToString(whole);
  return text.replace(/var\(--([\w-]+)(?:,[^()]*)?\)/g, (_, name) => colours.getPropertyValue(`--${name}`).trim()).replace(/ class="(?!world)[^"]*"/g, "");
};
const png = (text, name) => {
  const image = new Image();
  image.onload = () => {
    const canvas = document.createElement("canvas");
    canvas.width = DENSE * image.width;
    canvas.height = DENSE * image.height;
    const pen = canvas.getContext("2d");
    pen.scale(DENSE, DENSE);
    pen.drawImage(image, 0, 0);
    canvas.toBlob((made) => { if (made) give(name, made); });
  };
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
};
const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
// every curve that is switched on, a point a row, to the hundredth of a point to which it is drawn
const csvOf = (chart) => {
  const rows = [["panel", "curve", "x", "y", "x is", "y is"]];
  chart.panels.forEach((panel, k) => {
    const named = (axis) => axis.name + (axis.unit ? `, ${axis.unit}` : "");
    for (const curve of panel.seen(chart)) for (const [x, y] of curve.points) {
      const values = [panel.x.value(x), panel.y.value(y)].map((value) => String(Number(value.toPrecision(6))));
      rows.push([String(k + 1), chart.labels[curve.key] ?? panel.y.name, ...values, named(panel.x), named(panel.y)]);
    }
  });
  return rows.map((row) => row.map(quoted).join(",")).join("\n") + "\n";
};
const nameOf = (chart) => {
  const own = chart.root.closest("[data-chart]")?.dataset.chart, all = [...document.querySelectorAll("main .chart")];
  const section = chart.root.closest("section")?.id ?? "figure";
  return `${section}-${own ?? 1 + all.filter((one) => one.closest("section")?.id === section).indexOf(chart.root)}`;
};
export const saveAs = {
  SVG: (chart) => give(`${nameOf(chart)}.svg`, svgOf(chart), "image/svg+xml"),
  PNG: (chart) => png(svgOf(chart), `${nameOf(chart)}.png`),
  CSV: (chart) => give(`${nameOf(chart)}.csv`, csvOf(chart), "text/csv"),
};
