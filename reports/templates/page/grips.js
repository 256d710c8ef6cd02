// What can be taken hold of in a figure: a curve, or a handle on it; and marks that are drawn anew with the curves.
import { make } from "./words.js";

// moved(from, to) is told at every move, in values of the axes, inside the frame or not; done() at the end
const listenTo = (panel, node, { moved, done }) => {
  // the page above may grow while something is moved: the screen is measured once
  let from = null, back = null;
  const values = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(back), [px, py] = panel.back(point.x, point.y);
    return { x: panel.x.value(px), y: panel.y.value(py), shift: event.shiftKey };
  };
  const release = () => {
    from = null;
    done();
  };
  // a handle that is drawn no more is let go
  const lost = () => { if (from && !node.isConnected) release(); };
  const does = {
    pointerdown: (event) => {
      event.preventDefault();
      node.setPointerCapture(event.pointerId);
      back = node.ownerSVGElement.getScreenCTM().inverse();
      from = values(event);
      document.addEventListener("lostpointercapture", lost, { once: true });
    },
    pointermove: (event) => moved(from, values(event)), pointerup: release, pointercancel: release,
  };
  for (const name in does) node.addEventListener(name, (event) => {
    if (name === "pointerdown" ? event.button : !from) return;
    event.stopPropagation();
    does[name](event);
  });
  node.addEventListener("dblclick", (event) => event.stopPropagation());
};

// a curve that is dragged: {panel, curve (its label), words, across, moved, done}
export const holdCurve = ({ panel, curve, words, across, moved, done }, chart) => {
  const p = chart.panels[panel], key = chart.keyOf(curve), known = p.curves.find((one) => one.key === key);
  if (!known) return;
  known.grab = make("path", { class: `grab ${across ? "both" : "up"}`, d: known.node.getAttribute("d") }, p.world);
  make("title", {}, known.grab).textContent = words;
  listenTo(p, known.grab, { moved, done });
};

// marks of a panel: [{x, y, to (the other end of a stem along y), colour, words, name, moved, done}]; one with moved is a handle
export const putMarks = ({ panel, marks }, chart) => {
  const p = chart.panels[panel];
  p.live ??= make("g", { class: "live-marks" }, p.group);
  p.again = () => putMarks({ panel, marks }, chart);
  const before = [...p.live.children], known = new Map(before.map((node) => [node.dataset.name, node]));
  const made = marks.flatMap((mark) => nodesOf(p, mark, mark.name && known.get(mark.name)));
  for (const node of before) if (!made.includes(node)) node.remove();
  p.live.append(...made.filter((node) => !before.includes(node))); // one that is held stays where it is
};
const nodesOf = (panel, mark, known) => {
  const [x, y] = panel.place([panel.x.px(mark.x), panel.y.px(mark.y)]), end = panel.y.seen(panel.y.px(mark.to ?? mark.y));
  if (![x, y, end].every(Number.isFinite) || !panel.holds(x, y)) return [];
  const inside = Math.min(Math.max(end, panel.y.first), panel.y.last), made = [];
  if (mark.to !== undefined) made.push(make("path", { class: "stem", d: `M${x.toFixed(2)} ${y.toFixed(2)}V${inside.toFixed(2)}`, style: `stroke:var(--${mark.colour})` }));
  const dot = known ?? make("circle", mark.moved ? { class: "grab handle", r: 6.5, "data-name": mark.name } : { class: "point", r: 3.4 });
  dot.setAttribute("cx", x.toFixed(2));
  dot.setAttribute("cy", y.toFixed(2));
  dot.style.fill = `var(--${mark.colour})`;
  if (!dot.firstChild) make("title", {}, dot);
  dot.firstChild.textContent = mark.words;
  if (mark.moved && !known) listenTo(panel, dot, mark);
  return [...made, dot];
};
