// Sines from rest over frequency and amplitude, each run in the module with all limits and friction.
// What a cell shows is named by the rule of analyses.large_signal.classify: the limit that acts most, stiction,
// friction (of a drive that has any) or what else is not linear, linear.
import { data } from "./desk.js";
import { meanAt, view, x } from "./module.js";

const { columns, levels, updates, lowest, stick, decibel, degrees, longest } = data.map || {};
const at = data.places;
const spread = (low, high, count) => Array.from({ length: count }, (_, k) => low * (high / low) ** (k / (count - 1)));
// whole periods fill whole updates of the position loop
export const toneOf = (hertz, T) => {
  const cycles = Math.max(1, Math.ceil(updates * hertz * T)), count = Math.round(cycles / (hertz * T));
  return { hertz: cycles / (count * T), count };
};
export const gridOf = (low, high, full) => ({ hertz: spread(low, high, columns), amplitude: spread(full * lowest, full, levels) });
export const linearAt = (row, hertz) => { // command to output, linear, at each frequency
  view(x.p_at(), row.length).set(row);
  if (x.loop(3, 0) <= 0) return null;
  view(x.x_at(), hertz.length).set(hertz.map((f) => 2 * Math.PI * f * x.period_of(3)));
  x.respond(3, hertz.length);
  const pairs = Array.from(view(x.y_at(), 2 * hertz.length));
  return hertz.map((f, k) => {
    const [size, turn] = meanAt(row, f * x.period_of(3)), re = size * Math.cos(turn), im = size * Math.sin(turn);
    return [pairs[2 * k] * re - pairs[2 * k + 1] * im, pairs[2 * k] * im + pairs[2 * k + 1] * re];
  });
};
const rubs = (row) => [at.dry, at.dry_reverse, at.load_dry, at.load_coefficient, at.friction_map].some((place) => row[place] > 0);
export const startUp = (row, settling) => { // ticks before a cell is looked at
  const every = row[at.outer];
  return Math.min((Math.ceil(settling / row[at.period] / every) + Math.max(row[at.mean], 1) - 1) * every, Math.floor(longest / every) * every);
};
export const cell = (row, tone, amplitude, linear, before) => {
  view(x.p_at(), row.length).set(row);
  if (!x.start()) return null;
  const every = row[at.outer], window = tone.count * every;
  const io = view(x.io_at(), x.io_length()), turn = 2 * Math.PI * tone.hertz * row[at.period], acted = data.limiters.map(() => 0);
  let rests = 0, inPhase = 0, across = 0;
  for (let k = 0; k < before + window; k++) {
    io[at.command] = amplitude * Math.sin(turn * k);
    io[at.moment] = 0;
    if (x.tick() !== 0) return null;
    if (k < before) continue;
    const flags = io[at.flags];
    if (flags & at.stick) rests++;
    if (flags) data.limiters.forEach(([, bit], n) => { if (flags & bit) acted[n]++; });
    if ((k - before) % every) continue;
    inPhase += io[at.output] * Math.sin(turn * k);
    across += io[at.output] * Math.cos(turn * k);
  }
  const most = Math.max(...acted);
  if (most > 0) return data.limiters[acted.indexOf(most)][0];
  if (rests >= stick * window) return "stiction";
  const scale = 2 / (tone.count * amplitude), size = linear[0] ** 2 + linear[1] ** 2;
  const re = (inPhase * linear[0] + across * linear[1]) * scale / size, im = (across * linear[0] - inPhase * linear[1]) * scale / size;
  const off = Math.abs(20 * Math.log10(Math.max(Math.hypot(re, im), 1e-300))) > decibel || Math.abs(Math.atan2(im, re) * 180 / Math.PI) > degrees;
  return off ? (rubs(row) ? "friction" : "other") : "none";
};
