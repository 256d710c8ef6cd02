"use strict";
// Keeps the figures of a page alive: read-out, zoom, pan, curves on and off, crossings shown, curves redrawn.
// The SVG is the data: a panel says its axes (data-x, data-y: kind, ends, pixels), a curve is its path.
(() => {
  const first = document.querySelector(".plot");
  if (!first) return;
  const NS = first.namespaceURI;
  const make = (name, attributes, parent) => {
    const made = document.createElementNS(NS, name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    if (parent) parent.append(made);
    return made;
  };
  const html = (name, className, text) => {
    const made = document.createElement(name);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const minus = (text) => text.replace(/-/g, "−");
  const raised = (power) => minus(String(power)).replace(/[−\d]/g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["−0123456789".indexOf(c)]);
  const show = (value, digits = 4) => {
    if (value === 0) return "0";
    const size = Math.floor(Math.log10(Math.abs(value)));
    if (size >= -4 && size < 6) return minus(value.toFixed(Math.max(digits - 1 - Math.max(size, -4), 0)));
    return minus((value / 10 ** size).toFixed(2)) + "×10" + raised(size);
  };
  const reading = (value, unit) => (unit === "dB" || unit === "deg" || unit === "°" ? minus(value.toFixed(2)) : show(value));

  class Axis {
    constructor(words, label, fixed) {
      const [kind, ...ends] = words.split(" ");
      this.log = kind === "log";
      this.days = kind === "days"; // since 1970
      [this.low, this.high, this.from, this.to] = ends.map(Number);
      this.fixed = fixed;
      const cut = label.lastIndexOf(", ");
      this.name = cut < 0 ? label : label.slice(0, cut);
      this.unit = cut < 0 ? "" : label.slice(cut + 2).split(" (")[0];
    }
    px(value) {
      const part = this.log ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
      return this.from + part * (this.to - this.from);
    }
    value(px) {
      const part = (px - this.from) / (this.to - this.from);
      return this.log ? this.low * (this.high / this.low) ** part : this.low + part * (this.high - this.low);
    }
    words(value) {
      if (this.days) return new Date(Math.round(value * 1440) * 6e4).toISOString().slice(0, 10);
      return reading(value, this.unit) + (this.unit ? " " + this.unit : "");
    }
  }

  const linearTicks = (low, high, room) => {
    const rough = (high - low) / room, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 2.5, 5, 10].map((f) => f * power).find((s) => s >= rough * (1 - 1e-9));
    const ticks = [];
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (Math.abs(step / power - 2.5) < 1e-6 ? 1 : 0));
    for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9; k++) {
      const value = k * step, big = Math.max(Math.abs(value), step);
      ticks.push([value, k === 0 ? "0" : big >= 1e6 || big < 1e-3 ? show(value, 4) : minus(value.toFixed(Math.min(places, 20)))]);
    }
    return ticks;
  };
  const decade = (value) => (value >= 1e6 && value < 1e9 ? value / 1e6 + "M" : value >= 1e3 && value < 1e9 ? value / 1e3 + "k" : value >= 1e-4 ? String(+value.toPrecision(6)) : "10" + raised(Math.round(Math.log10(value))));
  const logTicks = (low, high, room) => {
    const decades = Math.log10(high / low), ticks = [];
    if (decades < 0.7) return linearTicks(low, high, room).filter(([v]) => v > 0);
    const every = Math.max(1, Math.ceil(decades / room));
    for (let k = Math.floor(Math.log10(low)); k <= Math.ceil(Math.log10(high)); k++)
      for (const m of decades > 2.2 ? [1] : [1, 2, 5]) {
        const value = m * 10 ** k;
        if (k % every === 0 && value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) ticks.push([value, decade(value)]);
      }
    return ticks;
  };

  class Panel {
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
      this.sample = group.querySelector(".xt text, .yt text");
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
        if (known.has(node) || node.classList.contains("cells")) continue; // these are drawn anew
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
        const named = (axis.log ? logTicks : linearTicks)(low, high, room);
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

  class Chart {
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
      for (const picture of this.pictures) this.listen(picture);
      this.plots.addEventListener("keydown", (event) => this.key(event));
      this.plots.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
      this.plots.addEventListener("blur", () => this.hide());
      root.addEventListener("chart:redraw", (event) => this.redraw(event.detail));
      root.addEventListener("chart:cells", (event) => this.cells(event.detail));
      root.addEventListener("chart:axes", (event) => this.rescale(event.detail));
    }
    legend() {
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
    // pointer to panel and place in the picture's own units
    find(picture, event) {
      const matrix = picture.svg.getScreenCTM();
      if (!matrix) return null;
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
      const panel = picture.panels.find((p) => p.holds(point.x, point.y));
      return panel ? { panel, x: point.x, y: point.y, scale: matrix.a } : null;
    }
    listen(picture) {
      const held = new Map();
      let moved = false, gap = 0;
      const svg = picture.svg;
      svg.addEventListener("pointerdown", (event) => {
        if (event.button) return;
        held.set(event.pointerId, event);
        moved = false;
        if (held.size === 2) {
          const [a, b] = [...held.values()];
          gap = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        }
      });
      svg.addEventListener("pointermove", (event) => {
        const last = held.get(event.pointerId);
        if (!last) {
          if (event.pointerType === "mouse" && !this.pinned) this.read(picture, event);
          return;
        }
        if (held.size === 2) {
          held.set(event.pointerId, event);
          const [a, b] = [...held.values()];
          const now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
          const middle = this.find(picture, { clientX: (a.clientX + b.clientX) / 2, clientY: (a.clientY + b.clientY) / 2 });
          if (middle && gap > 0) this.zoom(middle.panel, middle.x, middle.y, now / gap);
          gap = now;
          moved = true;
          return;
        }
        const dx = event.clientX - last.clientX, dy = event.clientY - last.clientY;
        if (!moved && Math.hypot(dx, dy) < 5) return;
        if (!moved) { try { svg.setPointerCapture(event.pointerId); } catch { /* the pointer is gone */ } }
        moved = true;
        held.set(event.pointerId, event);
        const found = this.find(picture, event) || this.find(picture, last);
        if (found) this.pan(found.panel, dx / found.scale, dy / found.scale);
      });
      const release = (event) => {
        const was = held.delete(event.pointerId);
        if (!was || moved || event.type !== "pointerup") return;
        const pinned = this.pinned;
        this.hide();
        if (this.read(picture, event) && !pinned) this.pinned = true;
      };
      for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, release);
      svg.addEventListener("pointerleave", () => { if (!this.pinned) this.hide(); });
      svg.addEventListener("dblclick", (event) => {
        const found = this.find(picture, event);
        if (found) this.zoom(found.panel, found.x, found.y, 2);
      });
    }
    wheel(event) {
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== this.plots) return;
      for (const picture of this.pictures) {
        const found = picture.svg.contains(event.target) && this.find(picture, event);
        if (!found) continue;
        event.preventDefault();
        this.zoom(found.panel, found.x, found.y, Math.exp(-Math.max(-120, Math.min(120, event.deltaY)) / 400));
      }
    }
    key(event) {
      if (event.target !== this.plots) return;
      const panel = this.panels[0];
      const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
      const middle = [(panel.left + panel.right) / 2, (panel.top + panel.bottom) / 2];
      if (event.key === "+" || event.key === "=") this.zoom(panel, this.spot ?? middle[0], middle[1], 1.25);
      else if (event.key === "-") this.zoom(panel, this.spot ?? middle[0], middle[1], 0.8);
      else if (event.key === "0" || event.key === "Escape") this.reset();
      else if (keys[event.key] && event.shiftKey) this.pan(panel, -24 * keys[event.key][0], -24 * keys[event.key][1]);
      else if (keys[event.key]) {
        const size = panel.right - panel.left;
        this.spot = Math.min(panel.right, Math.max(panel.left, (this.spot ?? middle[0]) + keys[event.key][0] * size / 100));
        this.rise = Math.min(panel.bottom, Math.max(panel.top, (this.rise ?? middle[1]) + keys[event.key][1] * 4));
        this.readAt(this.pictures[0], panel, this.spot, this.rise);
      } else return;
      event.preventDefault();
    }
    read(picture, event) {
      const found = this.find(picture, event);
      if (!found) { this.hide(); return false; }
      return this.readAt(picture, found.panel, found.x, found.y);
    }
    readAt(picture, panel, px, py) {
      for (const p of this.panels) p.clear();
      const rows = panel.byPoint ? this.point(panel, px, py) : this.level(picture, panel, px);
      if (rows.length < 2) { this.readout.hidden = true; return false; }
      this.fill(rows);
      const box = picture.svg.getBoundingClientRect(), own = this.root.getBoundingClientRect();
      const scale = box.width / picture.svg.viewBox.baseVal.width;
      const x = box.left - own.left + px * scale, y = box.top - own.top + py * scale;
      const width = this.readout.offsetWidth;
      this.readout.style.left = `${Math.max(0, x + 14 + width > own.width ? x - width - 14 : x + 14)}px`;
      this.readout.style.top = `${Math.max(0, y - this.readout.offsetHeight - 10)}px`;
      return true;
    }
    level(picture, panel, px) {
      const [origin] = panel.back(px, 0);
      const value = panel.x.value(origin);
      const rows = [["", panel.x.name || "x", panel.x.words(value)]];
      for (const p of this.linked(panel)) {
        p.cursor(origin, "cursor");
        if (!picture.panels.includes(p)) continue;
        for (const curve of p.seen(this)) {
          const q = p.at(curve, origin);
          if (!q) continue;
          p.dot(q);
          rows.push([curve.node.style.stroke, this.name(curve, p), p.y.words(p.y.value(q[1]))]);
        }
      }
      return rows;
    }
    point(panel, px, py) {
      const best = panel.nearest(this, px, py);
      if (!best || best.d > 60) return [];
      panel.dot(best.q);
      const rows = [[best.curve.node.style.stroke, this.labels[best.curve.key] || "curve", ""]];
      if (best.curve.parameter) rows.push(["", "frequency", show(best.curve.parameter[best.k]) + " Hz"]);
      for (const [axis, k] of [[panel.x, 0], [panel.y, 1]])
        if (!axis.fixed) rows.push(["", axis.name, axis.words(axis.value(best.q[k]))]);
      return rows;
    }
    name(curve, panel) {
      const label = this.labels[curve.key];
      return label ? `${label}: ${panel.y.name}` : panel.y.name;
    }
    fill(rows) {
      const table = html("table");
      for (const [colour, name, value] of rows) {
        const row = html("tr"), dot = html("td", "bead");
        if (colour) dot.style.color = colour;
        dot.textContent = colour ? "●" : "";
        row.append(dot, html("td", "", name), html("td", "value", value));
        table.append(row);
      }
      this.readout.replaceChildren(table);
      this.readout.hidden = false;
    }
    // shows a crossing: a frequency in every panel that has one
    mark(hertz) {
      const first = this.panels.find((p) => p.x.log && p.x.unit === "Hz");
      const [at] = first.place(first.x.px(hertz), 0);
      if (at < first.left || at > first.right) this.reset();
      for (const p of this.panels) {
        p.clear();
        if (p.x.log && p.x.unit === "Hz") p.cursor(p.x.px(hertz), "crossing");
      }
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
      if (parameter) known.parameter = parameter.filter((_, k) => Number.isFinite(x[k]) && Number.isFinite(y[k]));
      this.hide();
    }
  }

  const charts = [...document.querySelectorAll(".chart")].map((root) => new Chart(root));
  for (const row of document.querySelectorAll("tr[data-loop][data-hz]")) {
    const own = charts.filter((c) => c.loop === row.dataset.loop && c.panels.some((p) => p.x.log && p.x.unit === "Hz"));
    if (!own.length) continue;
    let kept = false;
    const show = () => own.forEach((c) => c.mark(+row.dataset.hz));
    const hide = () => { if (!kept) own.forEach((c) => c.hide()); };
    const button = html("button", "find", "show");
    button.type = "button";
    button.setAttribute("aria-label", "Show this crossing in the figures");
    row.querySelector("th").append(" ", button);
    row.addEventListener("pointerenter", () => { kept = false; show(); });
    row.addEventListener("pointerleave", hide);
    button.addEventListener("focus", show);
    button.addEventListener("click", () => {
      kept = true;
      const main = own.find((c) => c.root.closest("section[id^=loop]")) || own[0];
      main.root.scrollIntoView({ block: "center", behavior: "auto" });
      show();
    });
  }
  document.documentElement.classList.add("live");
})();
