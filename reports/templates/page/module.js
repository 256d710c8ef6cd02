// The module: loops, their figures and responses, limits and runs, all computed in WebAssembly.
import { BEHIND, DOUBT, STABLE, data, desk, outer } from "./desk.js";
import { driveOf, rowOf } from "./row.js";

const TOO_SLOW = 6; // ms
// its exports, once it is there
/** @type {any} */
export const x = {};
export const load = (instance) => { Object.assign(x, instance.exports); x._initialize(); };
export const view = (at, count) => new Float64Array(x.memory.buffer, at, count);
export const stageOf = (name) => data.stages[name];

export const slow = new Set(); // loops whose step takes too long for a moving slider: a slow pole beside a short period
const inwards = [...data.loops].reverse();
// the loops where cogging and gear error are steepest, and in a motion that averages them
const turnedOf = (row) => Object.fromEntries(Object.entries(data.turned).map(([where, puts]) => {
  const there = { row: row.slice(), loops: {} };
  for (const [place, value] of puts) there.row[place] = value;
  for (const name of inwards) there.loops[name] = judged(there, name, 0);
  return [where, there.loops];
}));
export const compute = (values, whole) => {
  const row = rowOf(values);
  if (!row) return null;
  const found = { row, drive: driveOf(values), loops: {}, points: {}, turned: turnedOf(row) };
  for (const name of inwards) {
    const began = performance.now(), timed = whole || !slow.has(name);
    found.loops[name] = judged(found, name, timed ? 1 : 0);
    found.loops[name].waits = !timed;
    if (performance.now() - began > TOO_SLOW) slow.add(name);
  }
  for (const name in data.points) found.points[name] = x.phases_of(data.points[name]) > 1 ? { n: BEHIND } : figures(data.points[name], 0);
  return found;
};

export const figures = (stage, timed) => {
  const n = x.loop(stage, timed);
  if (n <= 0) return { n };
  if (x.doubtful(stage)) return { n: DOUBT };
  const found = Array.from(view(x.figures_at(stage), STABLE + 1));
  return { n, figures: found, period: x.period_of(stage), phases: x.phases_of(stage) };
};

const sound = (loop) => loop.figures?.[STABLE] === 1;
// a loop as the report judges it (analyses.linear.loop_figures): one that, inside a stable drive, only torques over the
// angle or falling friction make unstable is held: without their slopes; the current loop with a rotor that has no torque
export const judged = ({ row, loops }, name, timed) => {
  const p = view(x.p_at(), row.length), at = data.places, own = (p.set(row), figures(stageOf(name), timed));
  if (name === outer || !own.figures || sound(own) || !sound(loops[outer])) return own;
  for (const [slope, ...waves] of data.slopes) p[slope] = -waves.reduce((sum, [peak, order, phase]) => sum + p[peak] * p[order] * Math.cos(p[phase]), 0);
  if (name === "current") p[at.friction_map] = Math.min(p[at.friction_map], 1);
  let held = figures(stageOf(name), timed);
  if (sound(held) && name === "current") { p[at.torque] = 0; held = figures(stageOf(name), timed); }
  p.set(row);
  return sound(held) ? { ...held, held: true } : figures(stageOf(name), timed);
};

export const respond = (name, hertz) => {
  const stage = stageOf(name), angle = 2 * Math.PI * x.period_of(stage);
  view(x.x_at(), hertz.length).set(hertz.map((f) => f * angle));
  if (x.respond(stage, hertz.length) <= 0) return null;
  const pairs = view(x.y_at(), 2 * hertz.length), re = [], im = [];
  for (let k = 0; k < hertz.length; k++) { re.push(pairs[2 * k]); im.push(pairs[2 * k + 1]); }
  return { re, im };
};

export const stepOf = (name, count) => (x.step_of(stageOf(name), count) > 0 ? Array.from(view(x.y_at(), count)) : null);

export const meanAt = (row, turns) => { // gain and phase of the mean over n samples that limits the jerk
  const n = row[data.places.mean], half = Math.PI * turns;
  return n > 1 ? [Math.sin(n * half) / (n * Math.sin(half)), -half * (n - 1)] : [1, 0];
};
// command amplitude at which each limit is just reached, over frequency
export const limitsOf = (row, hertz) => {
  const ratio = row[data.places.ratio], T = row[data.places.outer], count = hertz.length;
  const period = T * row[data.places.period];
  view(x.p_at(), row.length).set(row);
  view(x.x_at(), count).set(hertz.map((f) => Math.min(2 * Math.PI * f * period, Math.PI)));
  if (x.limiters(count) <= 0) return null;
  const sizes = view(x.y_at(), 6 * count), input = data.step.of === "speed" ? ratio : 1;
  const each = data.limits.map(([name, place, line]) => [name, hertz.map((f, k) => row[place] / (input * sizes[line * count + k]) / data.step.factor / (data.map ? Math.abs(meanAt(row, f * period)[0]) : 1))]);
  return { each, lowest: hertz.map((_, k) => Math.min(...each.map(([, values]) => values[k]))) };
};
const SEEN = ["output", "angle", "speed", "current", "voltage", "flags"];
// the drive with all its limits and its friction, from rest, `before` ticks before the first that is kept: what is
// seen at every tick (angle: the motor's), and y, what follows the command as a share of the scale; ends where it fails
export const run = (count, command, scale, moment, before = 0) => {
  desk.acted = 0;
  if (!x.start()) return null;
  const at = data.places, io = view(x.io_at(), x.io_length()), places = SEEN.map((name) => at[name]), lists = SEEN.map(() => new Float64Array(count));
  const over = scale * (data.step.of === "speed" ? view(x.p_at(), at.ratio + 1)[at.ratio] : 1);
  let k = -before;
  for (; k < count; k++) {
    io[at.command] = command(k);
    io[at.moment] = moment;
    if (x.tick() !== 0) break;
    if (k < 0) continue;
    desk.acted |= io[at.flags];
    for (let n = 0; n < places.length; n++) lists[n][k] = io[places[n]];
  }
  const part = Object.fromEntries(SEEN.map((name, n) => [name, lists[n].subarray(0, Math.max(k, 0))]));
  return { ...part, y: part[data.step.of].map((value) => value / over) };
};
