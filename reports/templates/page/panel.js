// One panel of a figure: its curves, its view, its ticks, and what is read from it.
import { Axis } from "./axis.js";
import { degreeTicks, linearTicks, logTicks } from "./ticks.js";
import { make } from "./words.js";

export class Panel {
  /** @type {any} */
  drawn = null; // ends of the axes as the SVG has them, once they are others
  scaled = false;
  /** @type {any} */
  again = null; // what is to be done once the view has changed
  /** @type {any} */
  live = null; // marks that are drawn anew with the curves
  constructor(group, index) {
    this.group = group;
    this.index = index;
    const d = group.dataset;
    this.shared = d.x;
    this.x = new Axis(d.x, d.xl, d.xfixed);
    this.y = new Axis(d.y, d.yl, d.yfixed);
    this.byPoint = d.mode === "xy";
    this.left = Math.min(this.x.from, this.x.to);
    this.right = Math.max(this.x.from, this.x.to);
    this.top = Math.min(this.y.from, this.y.to);
    this.bottom = Math.max(this.y.from, this.y.to);
    this.world = group.querySelector(".world");
    this.uses = [...group.querySelectorAll(".marks use")].map((node) => ({ node, x: +node.getAttribute("x"), y: +node.getAttribute("y") }));
    this.notes = [...group.querySelectorAll(".note[data-at]")].map((node) => ({ node, at: node.dataset.at.split(" ").map(Number) }));
    this.first = { grid: group.querySelector(".grid").getAttribute("d"), edge: group.querySelector(".edge").getAttribute("d"), xt: [...group.querySelector(".xt").childNodes], yt: [...group.querySelector(".yt").childNodes] };
    this.view = { sx: 1, tx: 0, sy: 1, ty: 0 };
    this.curves = [...group.querySelectorAll(".curve:not(.mute), .dots:not(.mute)")].map((node) => this.curve(node));
    this.over = make("g", { class: "over" }, group);
  }
  curve(node) {
    const dots = node.classList.contains("dots");
    const points = dots
      ? [...node.querySelectorAll("use")].map((u) => [+u.getAttribute("x"), +u.getAttribute("y"), false])
      : [...node.getAttribute("d").matchAll(/([ML])([-\d.]+) ([-\d.]+)/g)].map((m) => [+m[2], +m[3], m[1] === "M"]);
    const parameter = node.dataset.p ? node.dataset.p.split(" ").map(Number) : null;
    return { node, points, dots, parameter, key: node.dataset.k };
  }
  get whole() { return this.view.sx === 1 && this.view.sy === 1 && this.view.tx === 0 && this.view.ty === 0; }
  back(px, py) { return [(px - this.view.tx) / this.view.sx, (py - this.view.ty) / this.view.sy]; }
  holds(px, py) { return px >= this.left - 3 && px <= this.right + 3 && py >= this.top - 3 && py <= this.bottom + 3; }
  place(x, y) { return [this.view.sx * x + this.view.tx, this.view.sy * y + this.view.ty]; }
  update() {
    const { sx, tx, sy, ty } = this.view;
    this.group.classList.toggle("zoomed", !this.whole);
    if (this.whole) this.world.removeAttribute("transform");
    else this.world.setAttribute("transform", `matrix(${sx} 0 0 ${sy} ${tx} ${ty})`);
    for (const use of this.uses) {
      const [x, y] = this.place(use.x, use.y);
      use.node.setAttribute("x", x.toFixed(2));
      use.node.setAttribute("y", y.toFixed(2));
    }
    for (const note of this.notes) {
      const [x, y] = this.place(...note.at);
      note.node.setAttribute("transform", `translate(${(x - note.at[0]).toFixed(2)} ${(y - note.at[1]).toFixed(2)})`);
      note.node.style.display = this.holds(x, y) ? "" : "none";
    }
    this.ticks();
    this.clear();
    this.again?.();
  }
  // what is no curve goes to its place on axes with new ends
  follow() {
    const map = (axis, [low, high]) => {
      const stretch = (axis.px(high) - axis.px(low)) / (axis.to - axis.from);
      return [stretch, axis.px(low) - stretch * axis.from];
    };
    const [sx, tx] = map(this.x, this.drawn.x), [sy, ty] = map(this.y, this.drawn.y);
    const known = new Set(this.curves.map((curve) => curve.node));
    for (const node of this.world.children) {
      if (known.has(node) || node.classList.contains("cells") || node.classList.contains("grab")) continue; // these are drawn anew
      node.setAttribute("transform", `matrix(${sx} 0 0 ${sy} ${tx} ${ty})`);
      node.style.vectorEffect = "non-scaling-stroke";
    }
  }
  ticks() {
    const xt = this.group.querySelector(".xt"), yt = this.group.querySelector(".yt"), grid = this.group.querySelector(".grid");
    const edge = this.group.querySelector(".edge");
    if (this.whole && !this.scaled) {
      xt.replaceChildren(...this.first.xt);
      yt.replaceChildren(...this.first.yt);
      grid.setAttribute("d", this.first.grid);
      edge.setAttribute("d", this.first.edge);
      return;
    }
    edge.setAttribute("d", `M${this.left} ${this.top}V${this.bottom}H${this.right}`);
    let lines = "";
    const put = (axis, room, holder, place) => {
      const a = axis.value(place(axis.from, true)), b = axis.value(place(axis.to, true));
      const low = Math.min(a, b), high = Math.max(a, b);
      const named = (axis.log ? logTicks : axis.unit === "deg" ? degreeTicks : linearTicks)(low, high, room);
      holder.replaceChildren();
      return named.map(([value, words]) => [place(axis.px(value), false), words]);
    };
    if (!this.x.fixed) {
      const place = (p, back) => (back ? (p - this.view.tx) / this.view.sx : p * this.view.sx + this.view.tx);
      for (const [p, words] of put(this.x, Math.max(3, Math.floor((this.right - this.left) / (this.x.log ? 45 : 58))), xt, place)) {
        lines += `M${p.toFixed(1)} ${this.top}V${this.bottom}`;
        if (!this.group.dataset.hide) this.word(xt, words, p, this.bottom + 14, "middle");
      }
    } else this.slide(xt, this.first.xt, true);
    if (!this.y.fixed || this.y.unit === "deg") {
      const place = (p, back) => (back ? (p - this.view.ty) / this.view.sy : p * this.view.sy + this.view.ty);
      for (const [p, words] of put(this.y, Math.max(2, Math.floor((this.bottom - this.top) / 30)), yt, place)) {
        lines += `M${this.left} ${p.toFixed(1)}H${this.right}`;
        this.word(yt, words, this.left - 5, p + 3.7, "end");
      }
    } else this.slide(yt, this.first.yt, false);
    grid.setAttribute("d", lines);
  }
  slide(holder, nodes, across) {
    holder.replaceChildren(...nodes.map((node) => {
      const copy = node.cloneNode(true), key = across ? "x" : "y", extra = across ? 0 : 3.7;
      const p = +node.getAttribute(key) - extra;
      const to = across ? this.view.sx * p + this.view.tx : this.view.sy * p + this.view.ty;
      copy.setAttribute(key, (to + extra).toFixed(1));
      copy.style.display = across ? (to < this.left || to > this.right ? "none" : "") : (to < this.top || to > this.bottom ? "none" : "");
      return copy;
    }));
  }
  word(holder, words, x, y, anchor) {
    const node = make("text", { x: x.toFixed(1), y: y.toFixed(1), "font-size": "10.5", "text-anchor": anchor, style: "fill:var(--ink)" }, holder);
    node.textContent = words;
  }
  clear() { this.over.replaceChildren(); }
  seen(chart) { return this.curves.filter((c) => !chart.off.has(c.key)); }
  // the value of a curve at a place along x, in original pixels
  at(curve, px) {
    const p = curve.points;
    if (!p.length) return null;
    if (curve.dots) {
      let best = null;
      for (const q of p) if (best === null || Math.abs(q[0] - px) < Math.abs(best[0] - px)) best = q;
      return Math.abs(best[0] - px) * this.view.sx < 9 ? best : null;
    }
    let low = 0, high = p.length - 1;
    if (px < p[0][0] - 0.6 || px > p[high][0] + 0.6) return null;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (p[middle][0] <= px) low = middle; else high = middle;
    }
    const a = p[low], b = p[high];
    if (b[2]) return Math.abs(a[0] - px) < 1 ? a : null;
    const t = b[0] === a[0] ? 0 : Math.min(1, Math.max(0, (px - a[0]) / (b[0] - a[0])));
    return [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
  }
  nearest(chart, px, py) {
    let best = null;
    for (const curve of this.seen(chart))
      curve.points.forEach((q, k) => {
        const [x, y] = this.place(q[0], q[1]);
        if (!this.holds(x, y)) return;
        const d = Math.hypot(x - px, y - py);
        if (best === null || d < best.d) best = { curve, q, k, d };
      });
    return best;
  }
  cursor(px, className) {
    const [at] = this.place(px, 0);
    if (at < this.left - 0.5 || at > this.right + 0.5) return;
    make("path", { class: className, d: `M${at.toFixed(2)} ${this.top}V${this.bottom}` }, this.over);
  }
  dot(q) {
    const [x, y] = this.place(q[0], q[1]);
    if (this.holds(x, y)) make("circle", { class: "probe", cx: x.toFixed(2), cy: y.toFixed(2), r: 3.6 }, this.over);
  }
}
