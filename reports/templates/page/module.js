// The module: loops, their figures and responses, limits and runs, all computed in WebAssembly.
import { BEHIND, DOUBT, STABLE, data, desk } from "./desk.js";
import { driveOf, rowOf } from "./row.js";
import { meanAt } from "./mean.js";

const TOO_SLOW = 6; // ms
// its exports, once it is there
/** @type {any} */
export const x = {};
export const load = (instance) => { Object.assign(x, instance.exports); x._initialize(); };
export const view = (at, count) => new Float64Array(x.memory.buffer, at, count);
export const stageOf = (name) => data.stages[name];

export const slow = new Set(); // loops whose step takes too long for a moving slider: a slow pole beside a short period
export const compute = (values, whole) => {
  const row = rowOf(values);
  if (!row) return null;
  view(x.p_at(), row.length).set(row);
  const found = { row, drive: driveOf(values), loops: {}, points: {} };
  for (const name of data.loops) {
    const began = performance.now(), timed = whole || !slow.has(name);
    found.loops[name] = figures(stageOf(name), timed ? 1 : 0);
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
  return { n, figures: found, period: x.period_of(stage) };
};

export const respond = (name, hertz) => {
  const stage = stageOf(name), angle = 2 * Math.PI * x.period_of(stage);
  view(x.x_at(), hertz.length).set(hertz.map((f) => f * angle));
  if (x.respond(stage, hertz.length) <= 0) return null;
  const pairs = view(x.y_at(), 2 * hertz.length), re = [], im = [];
  for (let k = 0; k < hertz.length; k++) { re.push(pairs[2 * k]); im.push(pairs[2 * k + 1]); }
  return { re, im };
};

export const stepOf = (name, count) => {
  let stage = stageOf(name);
  if (name === "position" && Number.isNaN(x.lead_of(stage))) stage = 3; // the whole path from the command
  return x.step_of(stage, count) > 0 ? Array.from(view(x.y_at(), count)) : null;
};

// command amplitude at which each limit is just reached, over frequency
export const borderOf = (row, hertz) => {
  const ratio = row[data.places.ratio], T = row[data.places.outer], count = hertz.length;
  const period = T * row[data.places.period];
  view(x.p_at(), row.length).set(row);
  view(x.x_at(), count).set(hertz.map((f) => Math.min(2 * Math.PI * f * period, Math.PI)));
  if (x.limiters(count) <= 0) return null;
  const sizes = view(x.y_at(), 6 * count), input = data.step.of === "speed" ? ratio : 1;
  const each = data.limits.map(([name, place, line]) => [name, hertz.map((f, k) => row[place] / (input * sizes[line * count + k]) / data.step.factor / (data.map ? Math.abs(meanAt(row, f * period)[0]) : 1))]);
  return { each, lowest: hertz.map((_, k) => Math.min(...each.map(([, values]) => values[k]))) };
};
// the drive with all its limits and its friction, from rest: y, the output as a share of the scale; motor speed,
// current, voltage, and the flags of every tick
export const run = (count, command, scale, moment) => {
  desk.acted = 0;
  if (!x.start()) return null;
  const at = data.places, io = view(x.io_at(), x.io_length()), flags = new Int32Array(count);
  const [y, speed, current, voltage] = [0, 1, 2, 3].map(() => new Float64Array(count));
  const ratio = view(x.p_at(), at.ratio + 1)[at.ratio];
  const place = { output: at.output, speed: at.speed, current: at.current }[data.step.of];
  const over = data.step.of === "speed" ? ratio * scale : scale;
  for (let k = 0; k < count; k++) {
    io[at.command] = command(k);
    io[at.moment] = moment;
    if (x.tick() !== 0) return { y: y.subarray(0, k), speed: speed.subarray(0, k), current: current.subarray(0, k), voltage: voltage.subarray(0, k), flags: flags.subarray(0, k) };
    desk.acted |= io[at.flags];
    flags[k] = io[at.flags];
    y[k] = io[place] / over;
    speed[k] = io[at.speed];
    current[k] = io[at.current];
    voltage[k] = io[at.voltage];
  }
  return { y, speed, current, voltage, flags };
};
