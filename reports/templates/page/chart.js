// A figure that lives: curves on and off, zoom and pan of linked panels, curves redrawn, crossings shown.
// The SVG is the data: a panel says its axes (data-x, data-y: kind, ends, pixels), a curve is its path.
import { holdCurve, putMarks } from "./grips.js";
import { Panel } from "./panel.js";
import { saveAs } from "./picture.js";
import { key, listen, wheel } from "./pointer.js";
import { html, make } from "./words.js";

export const closest = (list, value) => list.reduce((best, one, k) => (Math.abs(one - value) < Math.abs(list[best] - value) ? k : best), 0);

export class Chart {
  constructor(root) {
    this.root = root;
    this.plots = root.querySelector(".plots");
    this.off = new Set();
    this.labels = {};
    this.pinned = null;
    this.pictures = [...root.querySelectorAll(".plot")].map((svg) => {
      const panels = [...svg.querySelectorAll(".panel")].map((group, k) => new Panel(group, k));
      return { svg, panels };
    });
    this.panels = this.pictures.flatMap((p) => p.panels);
    if (!this.panels.length) return;
    this.loop = root.dataset.loop || "";
    this.legend();
    this.tools();
    this.readout = html("div", "readout");
    this.readout.setAttribute("role", "status");
    this.readout.hidden = true;
    root.append(this.readout);
    this.plots.tabIndex = 0;
    this.plots.setAttribute("role", "group");
    this.plots.setAttribute("aria-label", "Figure with read-out: arrow keys move the cursor, plus and minus zoom, shift and arrow keys pan, 0 shows everything");
    for (const picture of this.pictures) listen(this, picture);
    this.plots.addEventListener("keydown", (event) => key(this, event));
    this.plots.addEventListener("wheel", (event) => wheel(this, event), { passive: false });
    this.plots.addEventListener("blur", () => this.leave());
    root.addEventListener("chart:redraw", (event) => this.redraw(event.detail));
    root.addEventListener("chart:cells", (event) => this.cells(event.detail));
    root.addEventListener("chart:hold", (event) => holdCurve(this, event.detail));
    root.addEventListener("chart:marks", (event) => putMarks(this, event.detail));
    root.addEventListener("chart:cursor", (event) => this.show(event.detail));
    root.addEventListener("chart:axes", (event) => this.rescale(event.detail));
  }
  legend() {
    for (const list of this.root.querySelectorAll(".keys ul")) list.setAttribute("role", "presentation"); // its items are switches
    for (const item of this.root.querySelectorAll(".keys li")) {
      const key = item.dataset.k;
      this.labels[key] = item.textContent;
      item.tabIndex = 0;
      item.setAttribute("role", "button");
      item.setAttribute("aria-pressed", "true");
      const flip = () => {
        const off = this.off.has(key);
        if (off) this.off.delete(key); else this.off.add(key);
        item.setAttribute("aria-pressed", String(off));
        for (const node of this.root.querySelectorAll(`.plot [data-k="${key}"]`)) node.style.display = off ? "" : "none";
        this.hide();
      };
      item.addEventListener("click", flip);
      item.addEventListener("keydown", (event) => {
        if (event.key === "Enter" || event.key === " ") { event.preventDefault(); flip(); }
      });
    }
  }
  // a legend names no curve that is not there
  name(key) {
    const there = this.panels.some((p) => p.curves.some((curve) => curve.key === key && curve.points.length));
    this.root.querySelector(`.keys li[data-k="${key}"]`).hidden = !there;
  }
  tools() {
    const bar = html("div", "tools");
    const add = (text, words, run) => {
      const button = html("button", "", text);
      button.type = "button";
      button.title = words;
      button.setAttribute("aria-label", words);
      button.addEventListener("click", run);
      bar.append(button);
      return button;
    };
    add("+", "Zoom in", () => this.step(1.5));
    add("−", "Zoom out", () => this.step(1 / 1.5));
    add("⤢", "Show everything", () => this.reset());
    const menu = html("details", "save-as"), words = html("summary", "", "↓");
    words.title = "Save this figure";
    words.setAttribute("aria-label", words.title);
    menu.append(words);
    bar.append(menu);
    for (const kind in saveAs) menu.append(add(kind, `Save this figure as ${kind}`, () => { menu.open = false; saveAs[kind](this); }));
    this.root.append(bar);
  }
  step(factor) { for (const p of this.pictures) this.zoom(p.panels[0], (p.panels[0].left + p.panels[0].right) / 2, (p.panels[0].top + p.panels[0].bottom) / 2, factor); }
  linked(panel) { return this.panels.filter((p) => p === panel || (p.shared === panel.shared && !p.byPoint)); }
  zoom(panel, px, py, factor) {
    const scale = panel.view.sx * factor;
    if (scale < 0.2 || scale > 5000) return;
    for (const p of this.linked(panel)) {
      p.view.tx = px - factor * (px - p.view.tx);
      p.view.sx *= factor;
      if (p !== panel) p.update();
    }
    panel.view.ty = py - factor * (py - panel.view.ty);
    panel.view.sy *= factor;
    this.settle(panel);
  }
  pan(panel, dx, dy) {
    for (const p of this.linked(panel)) {
      p.view.tx += dx;
      if (p !== panel) p.update();
    }
    panel.view.ty += dy;
    this.settle(panel);
  }
  settle(panel) {
    panel.update();
    this.root.classList.toggle("moved", this.panels.some((p) => !p.whole));
    this.pinned = null;
    this.readout.hidden = true;
  }
  reset() {
    for (const p of this.panels) {
      p.view = { sx: 1, tx: 0, sy: 1, ty: 0 };
      p.update();
    }
    this.root.classList.remove("moved");
    this.hide();
  }
  hide() {
    this.pinned = null;
    this.readout.hidden = true;
    for (const p of this.panels) p.clear();
  }
  // nothing is pointed at any more, here and in what follows this figure
  leave() {
    this.hide();
    this.root.dispatchEvent(new CustomEvent("chart:at", { detail: {} }));
  }
  // shows what is pointed at elsewhere, in every panel: a frequency (in a step half its period), or a place along x
  show({ hertz = NaN, x = NaN }, look = "cursor") {
    if (this.pinned) return;
    for (const p of this.panels) {
      p.clear();
      const at = p.x.unit === "Hz" ? hertz : p.x.seconds && hertz ? 0.5 / (hertz * p.x.seconds) : x, px = p.x.px(at);
      if (Number.isFinite(px)) p.cursor(px, look);
      for (const curve of p.seen(this)) {
        const q = Number.isFinite(px) && !curve.parameter ? p.at(curve, px) : curve.parameter && hertz && curve.points[closest(curve.parameter, hertz)];
        if (q) p.dot(q);
      }
    }
  }
  // shows a crossing, a frequency
  mark(hertz) {
    const first = this.panels.find((p) => p.x.log && p.x.unit === "Hz"), [at] = first.place(first.x.px(hertz), 0);
    if (at < first.left || at > first.right) this.reset();
    this.pinned = null;
    this.show({ hertz }, "crossing");
  }
  // gives the axes of a panel new ends: {panel, x: [low, high], y: [low, high], words}; curves are redrawn after it
  rescale({ panel, x, y, words }) {
    const p = this.panels[panel];
    p.drawn ??= { x: [p.x.low, p.x.high], y: [p.y.low, p.y.high] };
    for (const [axis, ends] of [[p.x, x], [p.y, y]]) if (ends) [axis.low, axis.high] = ends;
    p.scaled = true;
    p.follow();
    p.update();
    if (words) {
      p.x.unit = words;
      const label = [...p.group.querySelectorAll("text")].find((node) => node.textContent.startsWith(p.x.name + ", "));
      if (label) label.textContent = `${p.x.name}, ${words}`;
    }
  }
  // lays coloured cells behind the curves: {panel, cells: [{x: [from, to], y: [from, to], colour, words}]}
  cells({ panel, cells }) {
    const p = this.panels[panel];
    let holder = p.world.querySelector(".cells");
    if (!holder) {
      holder = make("g", { class: "cells", opacity: 0.38 });
      p.world.prepend(holder);
    }
    holder.replaceChildren(...cells.map(({ x, y, colour, words }) => {
      const [left, right] = x.map((value) => p.x.px(value)), [bottom, top] = y.map((value) => p.y.px(value));
      const made = make("rect", { x: left.toFixed(2), y: top.toFixed(2), width: Math.max(right - left, 0).toFixed(2), height: Math.max(bottom - top, 0).toFixed(2) });
      made.style.fill = `var(--${colour})`;
      make("title", {}, made).textContent = words;
      return made;
    }));
  }
  // gives a curve new values, in the units of its axes: {panel, curve (its label), x, y, parameter}
  redraw({ panel, curve, x, y, parameter }) {
    const p = this.panels[panel];
    const key = Object.keys(this.labels).find((k) => this.labels[k] === curve);
    const known = p.curves.find((c) => !c.dots && (key === undefined ? p.curves.length === 1 || c.node.dataset.id === curve : c.key === key));
    if (!known) return;
    let pen = false, d = "";
    const points = [];
    for (let k = 0; k < x.length; k++) {
      const there = Number.isFinite(x[k]) && Number.isFinite(y[k]);
      if (there) {
        const at = p.x.px(x[k]), up = Math.max(-1e5, Math.min(1e5, p.y.px(y[k])));
        d += `${pen ? "L" : "M"}${at.toFixed(2)} ${up.toFixed(3)}`;
        points.push([at, up, !pen]);
      }
      pen = there;
    }
    known.node.setAttribute("d", d);
    known.points = points;
    if (key !== undefined) this.name(key);
    known.grab?.setAttribute("d", d);
    if (parameter) known.parameter = parameter.filter((_, k) => Number.isFinite(x[k]) && Number.isFinite(y[k]));
    this.hide();
  }
}
