// Where an axis has its ticks, and their words.
import { minus, raised, show } from "./words.js";

// a phase is read in quarters of a turn
const TURN = [15, 30, 45, 90, 180, 360, 720, 1440, 2880];
export const degreeTicks = (low, high, room) => {
  const step = TURN.find((s) => (high - low) / s <= room);
  if (!step || high - low < 60) return linearTicks(low, high, room);
  const ticks = [];
  for (let k = Math.ceil(low / step); k <= high / step; k++) ticks.push([k * step, minus(String(k * step))]);
  return ticks;
};
export const linearTicks = (low, high, room) => {
  const rough = (high - low) / room, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((f) => f * power).find((s) => s >= rough * (1 - 1e-9));
  const ticks = [];
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (Math.abs(step / power - 2.5) < 1e-6 ? 1 : 0));
  for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9; k++) {
    const value = k * step, big = Math.max(Math.abs(value), step);
    ticks.push([value, k === 0 ? "0" : big >= 1e6 || big < 1e-3 ? show(value, 4) : minus(value.toFixed(Math.min(places, 20)))]);
  }
  return ticks;
};
const decade = (value) => (value >= 1e6 && value < 1e9 ? value / 1e6 + "M" : value >= 1e3 && value < 1e9 ? value / 1e3 + "k" : value >= 1e-4 ? String(+value.toPrecision(6)) : "10" + raised(Math.round(Math.log10(value))));
export const logTicks = (low, high, room) => {
  const decades = Math.log10(high / low), ticks = [];
  if (decades < 0.7) return linearTicks(low, high, room).filter(([v]) => v > 0);
  const every = Math.max(1, Math.ceil(decades / room));
  for (let k = Math.floor(Math.log10(low)); k <= Math.ceil(Math.log10(high)); k++)
    for (const m of decades > 2.2 ? [1] : [1, 2, 5]) {
      const value = m * 10 ** k;
      if (k % every === 0 && value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) ticks.push([value, decade(value)]);
    }
  return ticks;
};
