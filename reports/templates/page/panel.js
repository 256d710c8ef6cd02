// One panel of a figure: its curves, its view, its ticks, and what is read from it.
import { Axis } from "./axis.js";
import { bisector } from "./d3.js";
import { make } from "./words.js";

// the points of a path, each with whether the pen comes down there; from one to the next it is said how far
const pointsOf = (path) => {
  let x = 0, y = 0;
  return [...path.matchAll(/([Ml])([-\d.]+) ([-\d.]+)/g)].map(([, does, a, b]) => {
    [x, y] = does === "M" ? [+a, +b] : [x + +a, y + +b];
    return [x, y, does === "M"];
  });
};
const after = bisector((/** @type {number[]} */ q) => q[0]).right;

export class Panel {
  /** @type {any} */
  again = null; // what is to be done once the view has changed
  /** @type {any} */
  live = null; // marks that are drawn anew with the curves
  /** @type {any} */
  zoom = null; // d3's zoom of it
  constructor(group) {
    this.group = group;
    const d = group.dataset, part = (name) => group.querySelector(`.${name}`);
    this.shared = d.x;
    this.x = new Axis(d.x, d.xl, d.xfixed);
    this.y = new Axis(d.y, d.yl, d.yfixed);
    this.byPoint = d.mode === "xy";
    this.world = part("world");
    this.uses = [...group.querySelectorAll(".marks use")].map((node) => ({ node, at: [+node.getAttribute("x"), +node.getAttribute("y")] }));
    this.notes = [...group.querySelectorAll(".note[data-at]")].map((node) => ({ node, at: node.dataset.at.split(" ").map(Number) }));
    this.lines = ["grid", "edge"].map((name) => ({ node: part(name), first: part(name).getAttribute("d") }));
    this.words = [this.x, this.y].map((axis, k) => ({ holder: part(k ? "yt" : "xt"), axis, across: !k })).map((one) => ({ ...one, first: [...one.holder.childNodes] }));
    this.curves = [...group.querySelectorAll(".curve:not(.mute), .dots:not(.mute)")].map((node) => this.curve(node));
    this.over = make("g", { class: "over" }, group);
    const { x, y } = this;
    group.prepend(make("rect", { x: x.first, y: y.first, width: x.last - x.first, height: y.last - y.first, fill: "none", "pointer-events": "all" })); // what a hand is over
  }
  curve(node) {
    const dots = node.classList.contains("dots");
    const points = dots
      ? [...node.querySelectorAll("use")].map((u) => [+u.getAttribute("x"), +u.getAttribute("y"), false])
      : pointsOf(node.getAttribute("d"));
    const parameter = node.dataset.p ? node.dataset.p.split(" ").map(Number) : null;
    return { node, points, dots, parameter, key: node.dataset.k };
  }
  get whole() { return this.x.whole && this.y.whole; }
  back(px, py) { return [this.x.back(px), this.y.back(py)]; }
  /** @type {(at: any) => [number, number]} */
  place([x, y]) { return [this.x.seen(x), this.y.seen(y)]; }
  holds(px, py) { return this.x.holds(px) && this.y.holds(py); }
  update() {
    const { x, y } = this;
    this.group.classList.toggle("zoomed", !this.whole);
    if (this.whole) this.world.removeAttribute("transform");
    else this.world.setAttribute("transform", `matrix(${x.view.k} 0 0 ${y.view.k} ${x.view.x} ${y.view.x})`);
    for (const { node, at } of this.uses) this.place(at).forEach((value, k) => node.setAttribute("xy"[k], value.toFixed(2)));
    for (const { node, at } of this.notes) {
      const place = this.place(at);
      node.setAttribute("transform", `translate(${place.map((value, k) => (value - at[k]).toFixed(2)).join(" ")})`);
      node.style.display = this.holds(...place) ? "" : "none";
    }
    this.ticks();
    this.clear();
    this.again?.();
  }
  // what is no curve goes to its place on axes with new ends
  follow() {
    const [[sx, tx], [sy, ty]] = [this.x.moved, this.y.moved];
    const known = new Set(this.curves.map((curve) => curve.node));
    for (const node of this.world.children) {
      if (known.has(node) || node.classList.contains("cells") || node.classList.contains("grab")) continue; // these are drawn anew
      node.setAttribute("transform", `matrix(${sx} 0 0 ${sy} ${tx} ${ty})`);
      node.style.vectorEffect = "non-scaling-stroke";
    }
  }
  ticks() {
    const { x, y, lines, words } = this;
    if (this.whole && !x.drawn && !y.drawn) {
      for (const { node, first } of lines) node.setAttribute("d", first);
      for (const { holder, first } of words) holder.replaceChildren(...first);
      return;
    }
    let grid = "";
    for (const { holder, axis, first, across } of words) {
      if (axis.fixed) {
        holder.replaceChildren(...first.map((node) => this.slide(node, axis, across)));
        continue;
      }
      const ticks = across ? axis.ticks(axis.log ? 60 : 80, 3) : axis.ticks(36, 3);
      grid += ticks.map(([p]) => (across ? `M${p.toFixed(1)} ${y.first}V${y.last}` : `M${x.first} ${p.toFixed(1)}H${x.last}`)).join("");
      const named = across && this.group.dataset.hide ? [] : ticks;
      holder.replaceChildren(...named.map(([p, text]) => {
        const place = across ? { x: p.toFixed(1), y: (y.last + 14).toFixed(1), "text-anchor": "middle" } : { x: (x.first - 5).toFixed(1), y: (p + 3.7).toFixed(1), "text-anchor": "end" };
        const node = make("text", { ...place, "font-size": "10.5", style: "fill:var(--ink)" });
        node.textContent = text;
        return node;
      }));
    }
    lines[0].node.setAttribute("d", grid);
    lines[1].node.setAttribute("d", `M${x.first} ${y.first}V${y.last}H${x.last}`);
  }
  slide(node, axis, across) {
    const copy = node.cloneNode(true), key = across ? "x" : "y", extra = across ? 0 : 3.7, to = axis.seen(+node.getAttribute(key) - extra);
    copy.setAttribute(key, (to + extra).toFixed(1));
    copy.style.display = axis.holds(to, 0) ? "" : "none";
    return copy;
  }
  clear() { this.over.replaceChildren(); }
  seen(chart) { return this.curves.filter((c) => !chart.off.has(c.key)); }
  // the value of a curve at a place along x, in original pixels
  at(curve, px) {
    const p = curve.points;
    if (!p.length) return null;
    if (curve.dots) {
      const best = p.reduce((near, q) => (Math.abs(q[0] - px) < Math.abs(near[0] - px) ? q : near));
      return Math.abs(best[0] - px) * this.x.view.k < 9 ? best : null;
    }
    const last = p.length - 1, right = Math.min(after(p, px, 1), last), a = p[Math.max(right - 1, 0)], b = p[right];
    if (px < p[0][0] - 0.6 || px > p[last][0] + 0.6) return null;
    if (b[2]) return Math.abs(a[0] - px) < 1 ? a : null;
    const t = b[0] === a[0] ? 0 : Math.min(1, Math.max(0, (px - a[0]) / (b[0] - a[0])));
    return [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
  }
  nearest(chart, px, py) {
    let best = null;
    for (const curve of this.seen(chart))
      curve.points.forEach((q, k) => {
        const [x, y] = this.place(q);
        if (!this.holds(x, y)) return;
        const d = Math.hypot(x - px, y - py);
        if (best === null || d < best.d) best = { curve, q, k, d };
      });
    return best;
  }
  cursor(px, className) {
    const at = this.x.seen(px);
    if (this.x.holds(at, 0.5)) make("path", { class: className, d: `M${at.toFixed(2)} ${this.y.first}V${this.y.last}` }, this.over);
  }
  dot(q) {
    const [x, y] = this.place(q);
    if (this.holds(x, y)) make("circle", { class: "probe", cx: x.toFixed(2), cy: y.toFixed(2), r: 3.6 }, this.over);
  }
}
