// Pointer, wheel and keys on a figure: read, zoom, pan.
import { placeOf, read, readAt } from "./readout.js";

const click = (chart, { panel, x, y }) => {
  const [px, py] = panel.back(x, y);
  chart.tell("click", { x: panel.x.value(px), y: panel.y.value(py) });
};
// the middle of the pointers that are down, and how far they are from it
const gauge = (held) => {
  const all = [...held.values()], mean = (name) => all.reduce((sum, event) => sum + event[name] / all.length, 0);
  const clientX = mean("clientX"), clientY = mean("clientY");
  return { clientX, clientY, apart: Math.hypot(all[0].clientX - clientX, all[0].clientY - clientY) };
};
export const listen = (chart, picture) => {
  const held = new Map(), svg = picture.svg;
  let moved = false;
  svg.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    held.set(event.pointerId, event);
    moved = held.size > 1;
  });
  svg.addEventListener("pointermove", (event) => {
    if (!held.has(event.pointerId)) {
      if (event.pointerType === "mouse" && !chart.pinned) read(chart, picture, event);
      return;
    }
    const was = gauge(held), last = held.get(event.pointerId);
    if (!moved && Math.hypot(event.clientX - last.clientX, event.clientY - last.clientY) < 5) return;
    if (!moved) { try { svg.setPointerCapture(event.pointerId); } catch { /* the pointer is gone */ } }
    moved = true;
    held.set(event.pointerId, event);
    const now = gauge(held), found = placeOf(picture, was) || placeOf(picture, now);
    if (found) chart.move(found.panel, found.x, found.y, was.apart ? now.apart / was.apart : 1, (now.clientX - was.clientX) / found.scale, (now.clientY - was.clientY) / found.scale);
  });
  const release = (event) => {
    const was = held.delete(event.pointerId);
    if (!was || moved || event.type !== "pointerup") return;
    const pinned = chart.pinned, found = placeOf(picture, event);
    chart.hide();
    if (read(chart, picture, event) && !pinned) chart.pinned = true;
    if (found) click(chart, found);
  };
  for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, release);
  svg.addEventListener("pointerleave", () => { if (!chart.pinned) chart.leave(); });
  svg.addEventListener("mousedown", (event) => { if (event.detail > 1) event.preventDefault(); }); // no text is selected
  svg.addEventListener("dblclick", (event) => {
    const found = placeOf(picture, event);
    if (found) chart.move(found.panel, found.x, found.y, 2);
  });
};
export const wheel = (chart, event) => {
  if (!event.ctrlKey && !event.metaKey && document.activeElement !== chart.plots) return;
  for (const picture of chart.pictures) {
    const found = picture.svg.contains(event.target) && placeOf(picture, event);
    if (!found) continue;
    event.preventDefault();
    chart.move(found.panel, found.x, found.y, Math.exp(-Math.max(-120, Math.min(120, event.deltaY)) / 400));
  }
};
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }, ZOOMS = { "+": 1.25, "=": 1.25, "-": 0.8 };
export const key = (chart, event) => {
  if (event.target !== chart.plots) return;
  const panel = chart.panels[0], { x, y } = panel, arrow = ARROWS[event.key], within = (axis, value) => Math.min(axis.last, Math.max(axis.first, value));
  if (ZOOMS[event.key]) chart.move(panel, chart.spot ?? x.middle, y.middle, ZOOMS[event.key]);
  else if (event.key === "0" || event.key === "Escape") chart.reset();
  else if (event.key === "Enter" && chart.spot !== undefined) click(chart, { panel, x: chart.spot, y: chart.rise });
  else if (arrow && event.shiftKey) chart.move(panel, 0, 0, 1, -24 * arrow[0], -24 * arrow[1]);
  else if (arrow) {
    chart.spot = within(x, (chart.spot ?? x.middle) + arrow[0] * (x.last - x.first) / 100);
    chart.rise = within(y, (chart.rise ?? y.middle) + arrow[1] * 4);
    readAt(chart, chart.pictures[0], panel, chart.spot, chart.rise);
  } else return;
  event.preventDefault();
};
