// Hands on the curves: the loop's gain on Bode and Nyquist, the corner of a PI, the filters; marks of the margins.
import { PLACE, STABLE, data, desk, tell } from "./desk.js";
import { commit, keys, past, preview } from "./history.js";
import { unmet } from "./requirements.js";
import { digits } from "./words.js";

const find = (path) => keys.findIndex((key) => key.path === path);
const gainOf = () => find(`control.${desk.shown}.gain`);
const held = new WeakMap(); // values as they were when something was taken hold of, by the place it was taken at
const factor = (from, k, by) => {
  if (k < 0) return;
  if (!held.has(from)) held.set(from, past.values);
  const { low, high } = keys[k];
  preview(k, Math.min(Math.max(held.get(from)[k] * by, low), high));
};
const decibels = (from, by) => factor(from, gainOf(), 10 ** (by / 20));
export const stepGain = (by) => {
  decibels({}, by);
  commit();
};
export const holdCurves = () => {
  tell("bode", "hold", { panel: 0, curve: "as changed", words: "drag up or down: gain of the loop", moved: (from, to) => decibels(from, to.y - from.y), done: commit });
  tell("nyquist", "hold", { panel: 0, curve: "as changed", across: true, words: "drag out or in: gain of the loop",
    moved: (from, to) => factor(from, gainOf(), Math.hypot(to.x, to.y) / Math.hypot(from.x, from.y)), done: commit });
};

// where a curve passes a level, as [hertz, other curve there]
const crossings = (hertz, curve, level, other) => {
  const found = [];
  for (let k = 1; k < curve.length; k++) {
    const a = curve[k - 1] - level, b = curve[k] - level;
    if (a === b || a * b > 0) continue;
    const t = a / (a - b);
    found.push([hertz[k - 1] * (hertz[k] / hertz[k - 1]) ** t, other[k - 1] + t * (other[k] - other[k - 1])]);
  }
  return found;
};
const nearest = (found, value) => found.reduce((best, one) => (best === null || Math.abs(one[1] - value) < Math.abs(best[1] - value) ? one : best), null);
const turned = (phase) => -180 + 360 * Math.round((phase + 180) / 360);

// the quoted margins on the curves as changed: found on the curves where the figures say how large they are
export const marginMarks = (hertz, { gain, phase }) => {
  const own = desk.now.loops[desk.shown].figures, top = [], bottom = [], bad = unmet(desk.now);
  const mark = (list, name, x, y, to) => {
    const value = own[PLACE[name]], { label, unit } = data.figures.find((one) => one.name === name);
    if (Number.isFinite(value)) list.push({ x, y, to, colour: bad(desk.shown, name) ? "fail" : "pass", words: `${label.toLowerCase()} ${digits(value, 3)} ${unit} at ${digits(x, 3)} Hz` });
  };
  if (own[STABLE] === 1) {
    const level = Math.round((Math.min(...phase) + 180) / 360);
    const across = [...Array(1 - Math.min(level, 0)).keys()].flatMap((turn) => crossings(hertz, phase, -180 - 360 * turn, gain));
    const gm = nearest(across, -own[PLACE.gain_margin]), pm = nearest(crossings(hertz, gain, 0, phase).map(([f, at]) => [f, at - turned(at), at]), own[PLACE.phase_margin]);
    if (gm) mark(top, "gain_margin", gm[0], gm[1], 0);
    if (pm) mark(bottom, "phase_margin", pm[0], pm[2], turned(pm[2]));
  }
  tell("bode", "marks", { panel: 0, marks: [...top, ...handles(hertz, gain)] });
  tell("bode", "marks", { panel: 1, marks: bottom });
};

// handles on the magnitude: the corner of the loop's PI, and each filter of the velocity loop
const handles = (hertz, gain) => {
  const at = (f) => {
    const k = hertz.findIndex((one) => one >= f);
    return k > 0 ? gain[k - 1] + (gain[k] - gain[k - 1]) * Math.log(f / hertz[k - 1]) / Math.log(hertz[k] / hertz[k - 1]) : NaN;
  };
  const made = [], corner = find(`control.${desk.shown}.integral_time`);
  if (corner >= 0 && past.values[corner] > 0) {
    const f = 1 / (2 * Math.PI * past.values[corner]);
    made.push({ x: f, y: at(f), name: `corner of ${desk.shown}`, colour: "c3", words: `corner of the PI, ${digits(f, 3)} Hz: drag left or right`, moved: (from, to) => factor(from, corner, from.x / to.x), done: commit });
  }
  if (desk.shown !== "velocity") return made;
  keys.forEach((key, k) => {
    const own = /^(control\.velocity\.filter\.[^.]+)\.frequency$/.exec(key.path);
    if (!own) return;
    const f = past.values[k] / (2 * Math.PI), depth = find(`${own[1]}.depth`), width = find(`${own[1]}.width`);
    made.push({ x: f, y: at(f), name: own[1], colour: "c4", words: `filter, ${digits(f, 3)} Hz: drag left or right; up or down its depth; with shift its width`, done: commit,
      moved: (from, to) => {
        if (to.shift) { factor(from, width, to.x / from.x); return; }
        factor(from, k, to.x / from.x);
        factor(from, depth, 10 ** ((to.y - from.y) / 20));
      } });
  });
  return made;
};
