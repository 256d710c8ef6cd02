// The run with limits and friction: a step, or the command of a record.
import { data, desk, find, tell } from "./desk.js";
import { thinned } from "./curves.js";
import { start } from "./history.js";
import { compute, run, view, x } from "./module.js";
import { digits, html } from "./words.js";

/** @type {any} */
export const trial = { size: data.step.size, moment: 0, length: 0, designed: null };
const held = (rec, T) => {
  let place = 0;
  return (k) => {
    if (k === 0) place = 0;
    while (place + 1 < rec.time.length && rec.time[place + 1] <= k * T + 1e-12) place++;
    return rec.command[place];
  };
};
export const tried = (row) => {
  view(x.p_at(), row.length).set(row);
  const T = row[data.places.period], scale = desk.record ? desk.record.scale : trial.size;
  const count = Math.min(Math.max(Math.ceil(trial.length / T), 2), 60000);
  return { T, y: run(count, desk.record ? held(desk.record, T) : () => trial.size, scale, trial.moment) };
};
const measure = () => { // how long the run as designed takes
  const T = desk.before.row[data.places.period];
  if (desk.record) { trial.length = desk.record.time[desk.record.time.length - 1]; return; }
  view(x.p_at(), desk.before.row.length).set(desk.before.row);
  const y = run(Math.min(Math.ceil(6 / T), 6000), () => trial.size, trial.size, trial.moment) || [];
  let last = 0;
  for (let k = 0; k < y.length; k++) if (Math.abs(y[k] - 1) > 0.02) last = k;
  trial.length = Math.max(1.4 * last, 60) * T;
};
export const drawRun = (label, part, unit) => {
  if (!part.y) return;
  const stride = thinned(part.y.length, 900), at = [];
  for (let k = 0; k < part.y.length; k += stride) at.push(k);
  tell("run", "chart:redraw", { panel: 0, curve: label, x: at.map((k) => k * part.T * unit), y: at.map((k) => part.y[k]) });
};
/** @type {() => [number, string]} */
export const unitOf = () => (trial.length < 2 ? [1e3, "ms"] : [1, "s"]);
export const runStart = () => {
  measure();
  trial.designed = tried(desk.before.row);
  const [unit, words] = unitOf(), top = desk.record ? 1.35 : Math.max(1.3, ...(trial.designed.y || [1])) + 0.1, low = desk.record ? desk.record.low - 0.15 : -0.1;
  tell("run", "chart:axes", { panel: 0, x: [0, trial.length * unit], y: [low, top], words });
  drawRun("as designed", trial.designed, unit);
  const line = desk.record ? [desk.record.time.map((t) => t * unit), desk.record.command.map((value) => value / desk.record.scale)] : [[0, trial.length * unit], [1, 1]];
  tell("run", "chart:redraw", { panel: 0, curve: "command", x: line[0], y: line[1] });
  const dots = desk.record ? [desk.record.time.map((t) => t * unit), desk.record.angle.map((value) => value / desk.record.scale)] : [[], []];
  tell("run", "chart:redraw", { panel: 0, curve: "measured record", x: dots[0], y: dots[1] });
};
export const misfit = (part) => {
  let sum = 0, n = 0;
  desk.record.time.forEach((t, k) => {
    const at = Math.round(t / part.T);
    if (at < part.y.length) { sum += (part.y[at] - desk.record.angle[k] / desk.record.scale) ** 2; n++; }
  });
  return n ? 100 * Math.sqrt(sum / n) : NaN;
};

export const runKeys = () => {
  const box = find(".run-keys"), { unit, factor } = data.step;
  const make = (words, value, zero, apply) => {
    const label = html("label", "", words + " "), field = html("input", "field");
    field.type = "text";
    field.inputMode = "decimal";
    field.value = digits(value, 4);
    const wrong = html("span", "wrong");
    field.addEventListener("change", () => {
      const typed = Number(field.value.replace(",", ".").replace("−", "-")), fits = field.value.trim() !== "" && Number.isFinite(typed) && (zero || typed !== 0);
      wrong.textContent = fits ? "" : `"${field.value}": a number${zero ? "" : " that is not 0"}`;
      field.setAttribute("aria-invalid", String(!fits));
      if (!fits) return;
      apply(typed);
      compute(start);
      runStart();
      desk.follow();
    });
    label.append(field, " ", wrong);
    box.append(label);
  };
  make(`Command, ${unit}:`, trial.size / factor, false, (value) => { trial.size = value * factor; });
  if (data.step.of === "output") make(data.axis === "linear" ? "Load force, N:" : "Load torque, N m:", 0, true, (value) => { trial.moment = value; });
};
