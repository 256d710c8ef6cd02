// Bode, Nyquist, sensitivity and step of one loop, as designed and as changed.
import { PLACE, desk, tell } from "./desk.js";
import { respond, stepOf } from "./module.js";

const grid = (name) => {
  const own = desk.before.loops[name], top = 0.5 / own.period * (1 - 1e-4), band = own.figures[PLACE.bandwidth];
  const low = Math.min(Number.isFinite(band) && band > 0 ? band / 100 : top / 1e4, top / 30), points = [];
  for (let k = 0; k <= 320; k++) points.push(low * (top / low) ** (k / 320));
  return points;
};
export const unwrapped = (re, im, hertz) => {
  const phase = [];
  let last = null, turn = 0;
  const slope = Math.round(Math.log(Math.hypot(re[1], im[1]) / Math.hypot(re[0], im[0])) / Math.log(hertz[1] / hertz[0])) || 0;
  for (let k = 0; k < re.length; k++) {
    let angle = Math.atan2(im[k], re[k]) * 180 / Math.PI;
    if (last === null) turn = -360 * Math.ceil((angle - 90 * slope - 90) / 360); // as actuator_lti.systems.phase's branch
    if (last !== null) turn -= 360 * Math.round((angle + turn - last) / 360);
    angle += turn;
    phase.push(angle);
    last = angle;
  }
  return phase;
};
const db = (value) => 20 * Math.log10(value);
const curvesOf = (name, hertz) => {
  const found = respond(name, hertz);
  if (!found) return null;
  const { re, im } = found, s = [], t = [];
  for (let k = 0; k < re.length; k++) {
    const distance = Math.hypot(1 + re[k], im[k]);
    s.push(-db(distance));
    t.push(db(Math.hypot(re[k], im[k]) / distance));
  }
  return { re, im, gain: re.map((_, k) => db(Math.hypot(re[k], im[k]))), phase: unwrapped(re, im, hertz), s, t };
};
const CUT = 2.5 * 1.6; // of a Nyquist curve nothing is drawn farther from -1
export const kept = {}; // the curves as designed, by loop
const LONGEST = 3000; // periods of a step
export const designed = (name) => {
  if (kept[name]) return kept[name];
  const hertz = grid(name), own = desk.before.loops[name];
  const settling = own.figures[PLACE.settling_time], end = Number.isFinite(settling) && settling > 0 ? 2.2 * settling : 400 * own.period;
  const count = Math.min(Math.max(Math.ceil(end / own.period), 40), LONGEST);
  kept[name] = { hertz, curves: curvesOf(name, hertz), step: stepOf(name, count), count, period: own.period };
  return kept[name];
};
// curves of another drive beside it, whose loops the module has just computed
export const beside = (label, name, { period }) => {
  const { hertz, count } = kept[name], curves = curvesOf(name, hertz);
  draw(label, { curves, step: stepOf(name, Math.min(Math.ceil(count * kept[name].period / period), LONGEST)), period }, name);
  return curves;
};
export const thinned = (count, most = 700) => Math.max(1, Math.ceil(count / most));
// every curve: figure, panel, what stands before its label, and its values
/** @type {any[]} */
const CURVES = [
  ["bode", 0, "", (hertz, { gain }) => ({ x: hertz, y: gain })],
  ["bode", 1, "", (hertz, { phase }) => ({ x: hertz, y: phase })],
  ["nyquist", 0, "", (hertz, { re, im }) => ({ x: re.map((value, k) => (Math.hypot(1 + value, im[k]) < CUT ? value : NaN)), y: im, parameter: hertz })],
  ["sensitivity", 0, "S ", (hertz, { s }) => ({ x: hertz, y: s })],
  ["sensitivity", 0, "T ", (hertz, { t }) => ({ x: hertz, y: t })],
];
const put = (label, /** @type {any} */ [figure, panel, of], values) => tell(figure, "redraw", { panel, curve: of + label, ...values });
const STEP = ["step", 0, ""];
export const without = (label) => { for (const each of [...CURVES, STEP]) put(label, each, { x: [], y: [] }); };
export const draw = (label, { curves, step, period }, name) => {
  if (curves) for (const each of CURVES) put(label, each, each[3](kept[name].hertz, curves));
  if (!step) return;
  const T = period * 1e3, stride = thinned(step.length), at = step.map((_, k) => k).filter((k) => k % stride === 0);
  put(label, STEP, { x: at.map((k) => k * T), y: at.map((k) => step[k]) });
};
export const range = (list, low, high) => [Math.max(low, Math.min(...list.filter(Number.isFinite))), Math.min(high, Math.max(...list.filter(Number.isFinite)))];
export const frame = (name) => {
  const part = kept[name], ends = [part.hertz[0], part.hertz[part.hertz.length - 1]], { gain, phase, s, t } = part.curves;
  const [low, high] = range(gain, -90, 90), [lag, lead] = range(phase, -900, 180), [, peak] = range([...s, ...t], -60, 60);
  tell("bode", "axes", { panel: 0, x: ends, y: [Math.max(low, high - 100) - 6, high + 12] });
  tell("bode", "axes", { panel: 1, x: ends, y: [lag - 60, lead + 30] });
  tell("sensitivity", "axes", { panel: 0, x: ends, y: [-45, Math.max(peak, 3) + 9] });
  const end = part.count * desk.before.loops[name].period * 1e3;
  tell("step", "axes", { panel: 0, x: [0, end], y: [-0.1, Math.max(1.5, Math.max(...(part.step || [1])) + 0.2)] });
  tell("step", "redraw", { panel: 0, curve: "command", x: [0, end], y: [1, 1] });
};
