// Pointer, wheel and keys on a figure: read, zoom, pan.
import { placeOf, read, readAt } from "./readout.js";

const click = (chart, { panel, x, y }) => {
  const [px, py] = panel.back(x, y);
  chart.root.dispatchEvent(new CustomEvent("chart:click", { detail: { x: panel.x.value(px), y: panel.y.value(py) } }));
};
export const listen = (chart, picture) => {
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
      if (event.pointerType === "mouse" && !chart.pinned) read(chart, picture, event);
      return;
    }
    if (held.size === 2) {
      held.set(event.pointerId, event);
      const [a, b] = [...held.values()];
      const now = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
      const middle = placeOf(picture, { clientX: (a.clientX + b.clientX) / 2, clientY: (a.clientY + b.clientY) / 2 });
      if (middle && gap > 0) chart.zoom(middle.panel, middle.x, middle.y, now / gap);
      gap = now;
      moved = true;
      return;
    }
    const dx = event.clientX - last.clientX, dy = event.clientY - last.clientY;
    if (!moved && Math.hypot(dx, dy) < 5) return;
    if (!moved) { try { svg.setPointerCapture(event.pointerId); } catch { /* the pointer is gone */ } }
    moved = true;
    held.set(event.pointerId, event);
    const found = placeOf(picture, event) || placeOf(picture, last);
    if (found) chart.pan(found.panel, dx / found.scale, dy / found.scale);
  });
  const release = (event) => {
    const was = held.delete(event.pointerId);
    if (!was || moved || event.type !== "pointerup") return;
    const pinned = chart.pinned;
    chart.hide();
    if (read(chart, picture, event) && !pinned) chart.pinned = true;
    const found = placeOf(picture, event);
    if (found) click(chart, found);
  };
  for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, release);
  svg.addEventListener("pointerleave", () => {
    if (!chart.pinned) chart.leave();
  });
  svg.addEventListener("mousedown", (event) => { if (event.detail > 1) event.preventDefault(); }); // no text is selected
  svg.addEventListener("dblclick", (event) => {
    const found = placeOf(picture, event);
    if (found) chart.zoom(found.panel, found.x, found.y, 2);
  });
};
export const wheel = (chart, event) => {
  if (!event.ctrlKey && !event.metaKey && document.activeElement !== chart.plots) return;
  for (const picture of chart.pictures) {
    const found = picture.svg.contains(event.target) && placeOf(picture, event);
    if (!found) continue;
    event.preventDefault();
    chart.zoom(found.panel, found.x, found.y, Math.exp(-Math.max(-120, Math.min(120, event.deltaY)) / 400));
  }
};
export const key = (chart, event) => {
  if (event.target !== chart.plots) return;
  const panel = chart.panels[0];
  const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const middle = [(panel.left + panel.right) / 2, (panel.top + panel.bottom) / 2];
  if (event.key === "+" || event.key === "=") chart.zoom(panel, chart.spot ?? middle[0], middle[1], 1.25);
  else if (event.key === "-") chart.zoom(panel, chart.spot ?? middle[0], middle[1], 0.8);
  else if (event.key === "0" || event.key === "Escape") chart.reset();
  else if (event.key === "Enter" && chart.spot !== undefined) click(chart, { panel, x: chart.spot, y: chart.rise });
  else if (keys[event.key] && event.shiftKey) chart.pan(panel, -24 * keys[event.key][0], -24 * keys[event.key][1]);
  else if (keys[event.key]) {
    const size = panel.right - panel.left;
    chart.spot = Math.min(panel.right, Math.max(panel.left, (chart.spot ?? middle[0]) + keys[event.key][0] * size / 100));
    chart.rise = Math.min(panel.bottom, Math.max(panel.top, (chart.rise ?? middle[1]) + keys[event.key][1] * 4));
    readAt(chart, chart.pictures[0], panel, chart.spot, chart.rise);
  } else return;
  event.preventDefault();
};
