// Pointer, wheel and keys on a figure: read, zoom, pan.
import { select, zoom } from "./d3.js";
import { placeOf, read, readAt } from "./readout.js";

const click = (chart, { panel, x, y }) => {
  const [px, py] = panel.back(x, y);
  chart.tell("click", { x: panel.x.value(px), y: panel.y.value(py) });
};
// what d3 takes for zoom and pan: a drag, two fingers, a double click, the wheel over a figure that has the focus or with a key
export const gestures = (chart, panel) => {
  const { x, y, group } = panel;
  const ours = (event) => !event.button && !event.target.closest(".grab")
    && (event.type !== "wheel" || event.ctrlKey || event.metaKey || document.activeElement === chart.plots)
    && !(event.touches?.length === 1 && panel.whole); // one finger moves the page
  panel.zoom = zoom().extent([[x.first, y.first], [x.last, y.last]]).scaleExtent([0.2, 5000]).duration(0).clickDistance(5).filter(ours)
    .wheelDelta((event) => -Math.max(-120, Math.min(120, event.deltaY)) / 277)
    .on("zoom", ({ transform }) => chart.move(panel, transform));
  select(group).call(panel.zoom);
};
export const listen = (chart, picture) => {
  const { svg } = picture;
  svg.addEventListener("pointermove", (event) => {
    if (event.pointerType === "mouse" && !event.buttons && !chart.pinned) read(chart, picture, event);
  });
  svg.addEventListener("click", (event) => {
    if (event.target.closest(".grab")) return;
    const pinned = chart.pinned, found = placeOf(picture, event);
    chart.hide();
    if (read(chart, picture, event) && !pinned) chart.pinned = true;
    if (found) click(chart, found);
  });
  svg.addEventListener("pointerleave", () => { if (!chart.pinned) chart.leave(); });
};
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }, ZOOMS = { "+": 1.25, "=": 1.25, "-": 0.8 };
export const key = (chart, event) => {
  if (event.target !== chart.plots) return;
  const panel = chart.panels[0], { x, y } = panel, arrow = ARROWS[event.key], within = (axis, value) => Math.min(axis.last, Math.max(axis.first, value));
  if (ZOOMS[event.key]) panel.zoom.scaleBy(select(panel.group), ZOOMS[event.key], [chart.spot ?? x.middle, y.middle]);
  else if (event.key === "0" || event.key === "Escape") chart.reset();
  else if (event.key === "Enter" && chart.spot !== undefined) click(chart, { panel, x: chart.spot, y: chart.rise });
  else if (arrow && event.shiftKey) panel.zoom.translateBy(select(panel.group), ...arrow.map((by) => -24 * by / x.view.k));
  else if (arrow) {
    chart.spot = within(x, (chart.spot ?? x.middle) + arrow[0] * (x.last - x.first) / 100);
    chart.rise = within(y, (chart.rise ?? y.middle) + arrow[1] * 4);
    readAt(chart, chart.pictures[0], panel, chart.spot, chart.rise);
  } else return;
  event.preventDefault();
};
