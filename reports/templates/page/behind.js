// What takes too long for a moving slider: once nothing has moved for a moment, one piece at a time.
import { limits } from "./limits.js";
import { BEHIND, PLACE, STABLE, chart, colourOf, data, desk, find, outer, root, tell } from "./desk.js";
import { moves } from "./history.js";
import { figures, judged, view, x } from "./module.js";
import { state } from "./requirements.js";
import { cell, linearAt, startUp, toneOf } from "./sines.js";
import { table } from "./table.js";
import { sideBySide } from "./variants.js";
import { html, swatch } from "./words.js";

const QUIET = 150, SLICE = 12; // ms
let pieces = [], waits = 0, inView = false;
const nextPiece = () => {
  const end = performance.now() + SLICE;
  while (pieces.length && performance.now() < end) pieces.shift()();
  if (!pieces.length) { root.dataset.behind = "done"; return; }
  waits = setTimeout(nextPiece, 0);
};
export const emptyBehind = () => {
  clearTimeout(waits);
  pieces = [];
  root.dataset.behind = "waits";
};
export const fillBehind = () => {
  emptyBehind();
  if (moves()) return; // listed once the page has followed
  pieces = [...(desk.late ? [runLate] : []), ...timed(desk.now), ...[...new Set([desk.before, desk.now])].flatMap(periodic), table, sideBySide, () => pieces.push(...mapPieces(desk.now))]; // the map waits as long as a step settles
  drawMap(desk.now.cells ?? []);
  waits = setTimeout(nextPiece, QUIET);
};
const runLate = () => { // taken when it runs: what waits may be listed anew before
  const late = desk.late;
  desk.late = null;
  late();
};
const mapPieces = (found) => {
  const loop = found.loops[outer];
  if (found.cells || !limits.map || !inView || !loop.figures || loop.figures[STABLE] !== 1) return [];
  const { hertz, amplitude } = limits.map, { row } = found, cells = [];
  const tones = hertz.map((f) => toneOf(f, row[data.places.outer] * row[data.places.period]));
  const settling = loop.figures[PLACE.settling_time], wait = 1.5 * (Number.isFinite(settling) ? settling : 400 * loop.period);
  const ticks = startUp(row, wait);
  let linear = null;
  const listed = [() => { linear = linearAt(row, tones.map((tone) => tone.hertz)); }];
  for (let j = amplitude.length - 1; j >= 0; j--) {
    for (let k = 0; k < tones.length; k++) listed.push(() => {
      const cause = linear && cell(row, tones[k], amplitude[j], linear[k], ticks);
      if (cause) cells.push({ j, k, cause, ticks, tone: tones[k], amplitude: amplitude[j] });
    });
    listed.push(() => drawMap(cells));
  }
  listed.push(() => { found.cells = cells; });
  return listed;
};
const drawMap = (cells) => {
  if (!limits.map) return;
  const edges = (list, k) => { const half = Math.sqrt(list[1] / list[0]); return [list[k] / half, list[k] * half]; };
  const { hertz, amplitude } = limits.map;
  tell("linear-limit", "cells", { panel: 0, cells: cells.filter(({ cause }) => cause !== "none").map(({ j, k, cause }) => ({
    x: edges(hertz, k), y: edges(amplitude, j).map((value) => value / data.step.factor), colour: colourOf(cause), words: data.map.words[cause],
  })) });
  const seen = [...new Set(cells.map(({ cause }) => cause))];
  find(".map-keys").replaceChildren(...(seen.length ? ["Sine from rest, simulated: "] : []), ...seen.map((cause) => (cause === "none" ? html("span", "map-key", data.map.words[cause]) : swatch(colourOf(cause), data.map.words[cause]))));
  root.dataset.cells = JSON.stringify(cells.map(({ cause, ticks, tone, amplitude }) => [cause, ticks, tone.hertz, tone.count, amplitude]));
};
// figures of the loops, or of the break points, that were left
const left = (found, of, waits, answer) => Object.keys(found[of]).filter((name) => waits(found[of][name])).map((name) => () => {
  view(x.p_at(), found.row.length).set(found.row);
  found[of][name] = answer(name);
  if (of === "loops") state();
});
const timed = (found) => left(found, "loops", ({ waits }) => waits, (name) => judged(found, name, 1));
const periodic = (found) => left(found, "points", ({ n }) => n === BEHIND, (name) => figures(data.points[name], 0));
// the map is computed only where somebody may see it
export const watchMap = () => {
  new IntersectionObserver((entries) => { // a busy page is told of several at once: the last is how it is
    const seen = entries[entries.length - 1].isIntersecting;
    if (seen === inView) return;
    inView = seen;
    if (inView) fillBehind();
  }, { rootMargin: "200px" }).observe(chart("linear-limit"));
};
