// A figure that lives: curves on and off, zoom and pan of linked panels, curves redrawn, crossings shown.
// The SVG is the data: a panel says its axes (data-x, data-y: kind, ends, pixels), a curve is its path.
import { select, zoomIdentity } from "./d3.js";
import { holdCurve, putMarks } from "./grips.js";
import { Panel } from "./panel.js";
import { saveAs } from "./picture.js";
import { gestures, key, listen } from "./pointer.js";
import { all, button, html, make } from "./words.js";

export const closest = (list, value) => list.reduce((best, one, k) => (Math.abs(one - value) < Math.abs(list[best] - value) ? k : best), 0);

export class Chart {
  constructor(root) {
    this.root = root;
    this.plots = root.querySelector(".plots");
    this.off = new Set();
    this.labels = {};
    this.pinned = null;
    this.pictures = all(".plot", root).map((svg) => ({ svg, panels: all(".panel", svg).map((group) => new Panel(group)) }));
    this.panels = this.pictures.flatMap((p) => p.panels);
    if (!this.panels.length) return;
    this.loop = root.dataset.loop || "";
    this.legend();
    this.tools();
    this.readout = html("div", { className: "readout", role: "status", hidden: true });
    root.append(this.readout);
    Object.assign(this.plots, { tabIndex: 0, role: "group", ariaLabel: "Figure with read-out: arrow keys move the cursor, plus and minus zoom, shift and arrow keys pan, 0 shows everything" });
    for (const picture of this.pictures) listen(this, picture);
    this.plots.addEventListener("keydown", (event) => key(this, event));
    for (const panel of this.panels) gestures(this, panel);
    this.plots.addEventListener("blur", () => this.leave());
    const does = { redraw: this.redraw, cells: this.cells, hold: holdCurve, marks: putMarks, cursor: this.show, axes: this.rescale };
    for (const name in does) root.addEventListener(`chart:${name}`, (event) => does[name].call(this, event.detail, this));
  }
  legend() {
    for (const list of all(".keys ul", this.root)) list.role = "presentation"; // its items are switches
    for (const item of all(".keys li", this.root)) {
      const key = item.dataset.k;
      this.labels[key] = item.textContent;
      Object.assign(item, { tabIndex: 0, role: "button", ariaPressed: "true" });
      const flip = () => {
        const off = this.off.delete(key);
        if (!off) this.off.add(key);
        item.ariaPressed = String(off);
        for (const node of all(`.plot [data-k="${key}"]`, this.root)) node.style.display = off ? "" : "none";
        this.hide();
      };
      item.addEventListener("click", flip);
      item.addEventListener("keydown", (event) => {
        if (event.key === "Enter" || event.key === " ") { event.preventDefault(); flip(); }
      });
    }
  }
  tools() {
    const named = (text, words, run) => button(text, run, { title: words, ariaLabel: words });
    const menu = html("details", "save-as", html("summary", { title: "Save this figure", ariaLabel: "Save this figure" }, "↓"));
    for (const kind in saveAs) menu.append(named(kind, `Save this figure as ${kind}`, () => { menu.open = false; saveAs[kind](this); }));
    this.root.append(html("div", "tools", named("+", "Zoom in", () => this.step(1.5)), named("−", "Zoom out", () => this.step(1 / 1.5)), named("⤢", "Show everything", () => this.reset()), menu));
  }
  step(factor) { for (const { panels: [p] } of this.pictures) p.zoom.scaleBy(select(p.group), factor); }
  linked(panel) { return this.panels.filter((p) => p === panel || (p.shared === panel.shared && !p.byPoint)); }
  // gives a panel d3's view of it; panels on the same axis follow along it
  move(panel, to) {
    const was = panel.x.view, { view } = panel.y, by = to.k / was.k;
    panel.y.view = zoomIdentity.translate(by * view.x + to.y - by * was.y, 0).scale(by * view.k);
    for (const p of this.linked(panel)) {
      p.x.view = p.group.__zoom = to;
      p.update();
    }
    this.root.classList.toggle("moved", this.panels.some((p) => !p.whole));
    this.pinned = null;
    this.readout.hidden = true;
  }
  reset() {
    for (const p of this.panels) {
      p.x.view = p.y.view = p.group.__zoom = zoomIdentity;
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
  tell(name, detail) { this.root.dispatchEvent(new CustomEvent(`chart:${name}`, { detail })); }
  // nothing is pointed at any more, here and in what follows this figure
  leave() {
    this.hide();
    this.tell("at", {});
  }
  // shows what is pointed at elsewhere, in every panel: a frequency (in a step half its period), or a place along x
  show({ hertz = NaN, x = NaN, look = "cursor" }) {
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
    const { x } = this.panels.find((p) => p.x.log && p.x.unit === "Hz");
    if (!x.holds(x.seen(x.px(hertz)), 0)) this.reset();
    this.pinned = null;
    this.show({ hertz, look: "crossing" });
  }
  // gives the axes of a panel new ends: {panel, x: [low, high], y: [low, high], words}; curves are redrawn after it
  rescale({ panel, x, y, words }) {
    const p = this.panels[panel];
    p.x.rescale(x);
    p.y.rescale(y);
    p.follow();
    p.update();
    if (!words) return;
    p.x.unit = words;
    const label = all("text", p.group).find((node) => node.textContent.startsWith(p.x.name + ", "));
    if (label) label.textContent = `${p.x.name}, ${words}`;
  }
  // lays coloured cells behind the curves: {panel, cells: [{x: [from, to], y: [from, to], colour, words}]}
  cells({ panel, cells }) {
    const { world, x: across, y: up } = this.panels[panel];
    if (!world.querySelector(".cells")) world.prepend(make("g", { class: "cells", opacity: 0.38 }));
    world.querySelector(".cells").replaceChildren(...cells.map(({ x, y, colour, words }) => {
      const [left, right] = x.map((value) => across.px(value)), [bottom, top] = y.map((value) => up.px(value));
      const made = make("rect", { x: left.toFixed(2), y: top.toFixed(2), width: Math.max(right - left, 0).toFixed(2), height: Math.max(bottom - top, 0).toFixed(2), style: `fill:var(--${colour})` });
      make("title", {}, made).textContent = words;
      return made;
    }));
  }
  // gives a curve new values, in the units of its axes: {panel, curve (its label), x, y, parameter}
  redraw({ panel, curve, x, y, parameter }) {
    const p = this.panels[panel], key = this.keyOf(curve);
    const known = p.curves.find((c) => !c.dots && (key === undefined ? p.curves.length === 1 : c.key === key));
    if (!known) return;
    let d = "";
    known.points = [];
    for (let k = 0, pen = false; k < x.length; k++) {
      const there = Number.isFinite(x[k]) && Number.isFinite(y[k]);
      if (there) {
        const at = p.x.px(x[k]), up = Math.max(-1e5, Math.min(1e5, p.y.px(y[k])));
        d += `${pen ? "L" : "M"}${at.toFixed(2)} ${up.toFixed(3)}`;
        known.points.push([at, up, !pen]);
      }
      pen = there;
    }
    for (const node of [known.node, known.grab]) node?.setAttribute("d", d);
    if (key !== undefined) { // a legend names no curve that is not there
      const there = this.panels.some(({ curves }) => curves.some((one) => one.key === key && one.points.length));
      this.root.querySelector(`.keys li[data-k="${key}"]`).hidden = !there;
    }
    if (parameter) known.parameter = parameter.filter((_, k) => Number.isFinite(x[k]) && Number.isFinite(y[k]));
    this.hide();
  }
  keyOf(label) { return Object.keys(this.labels).find((key) => this.labels[key] === label); }
}
