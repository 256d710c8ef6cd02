// The amplitude at which each limit is just reached, over frequency.
import { range } from "./curves.js";
import { PLACE, chart, data, desk, outer, tell } from "./desk.js";
import { limitsOf } from "./module.js";
import { gridOf } from "./sines.js";
import { trial } from "./trial.js";

/** @type {any} */
export const limits = { grid: [], map: null };
export const drawLimits = (label, part) => {
  if (!part) return;
  tell("linear-limit", "redraw", { panel: 0, curve: `lowest, ${label}`, x: limits.grid, y: part.lowest });
  if (label === "as changed") for (const name of data.onsets) {
    const own = part.each.find(([known]) => known === name);
    tell("linear-limit", "redraw", { panel: 0, curve: name, x: own ? limits.grid : [], y: own ? own[1] : [] });
  }
};
export const limitsStart = () => {
  const row = desk.before.row, top = 0.5 / (row[data.places.outer] * row[data.places.period]), band = desk.before.loops[outer].figures;
  const low = band && Number.isFinite(band[PLACE.bandwidth]) ? Math.min(band[PLACE.bandwidth] / 30, top / 30) : top / 1e3;
  limits.grid = [];
  for (let k = 0; k <= 90; k++) limits.grid.push(low * (0.98 * top / low) ** (k / 90));
  const part = limitsOf(row, limits.grid);
  if (!part) { chart("linear-limit").closest(".four > div").hidden = true; return; }
  if (data.map && Number.isFinite(band[PLACE.bandwidth])) limits.map = gridOf(Math.max(low, band[PLACE.bandwidth] / 25), Math.min(band[PLACE.bandwidth] * 8, 0.8 * top), data.map.full);
  const [, high] = range([...part.lowest.slice(0, 1), trial.size / data.step.factor], 0, 1e30), [bottom] = range(part.lowest, 0, 1e30);
  const ends = limits.map ? limits.map.amplitude.map((value) => value / data.step.factor) : [bottom];
  tell("linear-limit", "axes", { panel: 0, x: [limits.grid[0], limits.grid[90]], y: [Math.max(Math.min(bottom, ends[0]) / 4, high / 1e7), Math.max(high * 8, ends[ends.length - 1] * 2)] });
  drawLimits("as designed", part);
};
