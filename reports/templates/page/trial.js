// The run with limits and friction: a step, a sine, a ramp, or the command of a record.
import { fitOf } from "./columns.js";
import { KINDS, commandOf, lengthOf, spansOf } from "./commands.js";
import { thinned } from "./curves.js";
import { PLACE, STABLE, colourOf, data, desk, find, outer, tell } from "./desk.js";
import { start } from "./history.js";
import { compute, run, view, x } from "./module.js";
import { choice, digits, html, labelled, refused, swatch, typed } from "./words.js";

const { size: usual, unit: unitIn, factor } = data.step;
/** @type {any} */
export const trial = { kind: "step", size: usual, hertz: 1, rate: 1, moment: 0, moving: 0, before: 0, chosen: 0, length: 0, span: 0, designed: null };
const TRACES = ["output", "speed", ...(data.ampere ? ["current"] : []), "voltage"];
const MOST = 60000, GROWTH = 6; // ticks of a run; how far beyond the run as designed the axes follow one that grows
const held = (rec, T) => {
  let place = 0;
  return (k) => {
    if (k === 0) place = 0;
    while (place + 1 < rec.time.length && rec.time[place + 1] <= k * T + 1e-12) place++;
    return rec.command[place];
  };
};
const scaleOf = () => (desk.record ? desk.record.scale : trial.size);
const unstable = ({ loops }) => data.loops.some((name) => loops[name].figures && loops[name].figures[STABLE] !== 1);
// whether what is left between command and response is less in the last quarter than in the one before
const decays = (y, command) => {
  const most = (from, to) => y.subarray(from, to).reduce((high, value, k) => Math.max(high, Math.abs(value - command(from + k) / scaleOf())), 0);
  const [half, last] = [0.5, 0.75].map((share) => Math.floor(share * y.length));
  return most(last, y.length) < most(half, last);
};
// the motion under way, and runs that begin in it: angles from where the command then stood
const motion = () => (data.step.of === "output" ? (t) => trial.moving * t : () => trial.moving);
const shifted = (part, before, ratio) => {
  if (data.step.of !== "output" || !before || !part) return part;
  const by = trial.moving * before;
  return { ...part, y: part.y.map((value) => value - by / scaleOf()), output: part.output.map((value) => value - by), angle: part.angle.map((value) => value - by * ratio) };
};
// runs a drive; one that is not stable goes on until its instability shows (whole), or is asked to (more)
export const tried = (found, whole) => {
  const { row } = found, { period, ratio } = data.places, T = row[period], shape = commandOf(trial), base = motion();
  const before = desk.record ? 0 : Math.ceil(trial.before / T), command = desk.record ? held(desk.record, T) : (k) => base(k * T) + (k < 0 ? 0 : shape(k * T));
  const asked = data.step.of === "output" && before ? (k) => command(k) + trial.moving * before * T : command;
  for (let count = Math.min(Math.max(Math.ceil(trial.length / T), 2), MOST); ; count = Math.min(2 * count, MOST)) {
    view(x.p_at(), row.length).set(row);
    const part = shifted(run(count, asked, scaleOf(), trial.moment, before), before * T, row[ratio]);
    const more = Boolean(part) && part.y.length === count && count < MOST && !trial.chosen && !desk.record && unstable(found) && decays(part.y, command);
    if (!more || !whole) return { T, more, before, ratio: row[ratio], ...part };
  }
};
const measure = () => { // how long the run takes: that of a step, as designed, till it has settled
  const T = desk.before.row[data.places.period];
  view(x.p_at(), desk.before.row.length).set(desk.before.row);
  const y = run(Math.min(Math.ceil(6 / T), 6000), () => trial.size, trial.size, trial.moment)?.y || [];
  const end = y[y.length - 1]; // dry friction may hold it beside the command
  let last = 0;
  for (let k = 0; k < y.length; k++) if (Math.abs(y[k] - end) > 0.02) last = k;
  const settled = Math.max(1.4 * last, 60) * T;
  trial.before = trial.moving ? settled : 0;
  trial.length = desk.record ? desk.record.time[desk.record.time.length - 1] : trial.chosen || Math.min(lengthOf(trial, settled), MOST * T);
};
/** @type {() => [number, string]} */
export const unitOf = () => (trial.span < 2 ? [1e3, "ms"] : [1, "s"]);
const traceOf = (part, name) => (name === "output" ? part.y.map((value) => value * scaleOf() / factor) : part[name]);
const rangeOf = (lists, within = [-Infinity, Infinity]) => { // 0 is always in it
  const ends = [0, 0];
  for (const list of lists) for (const value of list) { ends[0] = Math.min(ends[0], value); ends[1] = Math.max(ends[1], value); }
  return ends.map((end) => Math.min(Math.max(end, within[0]), within[1]));
};
const draw = (curve, part, panel, values) => {
  const stride = thinned(values.length), at = Array.from({ length: Math.ceil(values.length / stride) }, (_, k) => k * stride);
  tell("run", "redraw", { panel, curve, x: at.map((k) => k * part.T * unitOf()[0]), y: at.map((k) => values[k]) });
};
// where a limit acts is shaded in the panel of what it limits, where the motor sticks in that of the speed
const STICK = ["stiction", data.places.stick, "motor sticks", "w_ref"], PLACES = { w_ref: "speed", i_ref: "current", i: "current", u: "voltage" };
const shade = (part, ends) => {
  const over = part.T * unitOf()[0], gap = Math.ceil(part.flags.length / 400);
  const acting = [...data.limiters, STICK].map(([name, bit, words, signal]) => ({
    bit, words, colour: colourOf(name), panel: name === "profile" ? 0 : Math.max(TRACES.indexOf(PLACES[signal]), 1),
  }));
  ends.forEach((y, panel) => tell("run", "cells", { panel, cells: acting.filter((one) => one.panel === panel).flatMap(({ bit, words, colour }) => spansOf(part.flags, bit, gap).map((span) => ({ x: span.map((at) => at * over), y, colour, words }))) }));
};
// what the shades of a run stand for, in words
const told = ({ flags = [] }) => {
  const acting = data.limiters.filter(([, bit]) => desk.acted & bit), sticks = flags.some((flag, k) => k && flag & data.places.stick) ? [STICK] : [];
  const words = acting.length ? "Limits that act as changed: " : "No limit acts as changed. ";
  find(".acting").replaceChildren(words, ...[...acting, ...sticks].flatMap(([name, , limit]) => [swatch(colourOf(name), limit), " "]));
};
export const drawRuns = (part) => {
  told(part);
  const { designed } = trial;
  if (!part.y?.length || !designed.y?.length) return;
  trial.span = Math.max(trial.length, part.y.length * part.T, designed.y.length * designed.T);
  const [unit, words] = unitOf(), command = commandLine();
  const dots = desk.record ? [desk.record.time.map((t) => t * unit), desk.record.angle.map((value) => value / factor)] : [[], []];
  const ends = TRACES.map((name, panel) => {
    const known = traceOf(designed, name), own = traceOf(part, name), [low, high] = rangeOf([known, ...(panel ? [] : [command[1], dots[1]])]), span = high - low || 1;
    const [least, most] = rangeOf([[low, high], own], [low - GROWTH * span, high + GROWTH * span]), room = 0.08 * (most - least || 1), y = [least - room, most + room];
    tell("run", "axes", { panel, x: [0, trial.span * unit], y, words: panel === TRACES.length - 1 ? words : undefined });
    draw("as designed", designed, panel, known);
    draw("as changed", part, panel, own);
    return y;
  });
  for (const [curve, [x, y]] of [["command", command], ["measured record", dots]]) tell("run", "redraw", { panel: 0, curve, x, y });
  shade(part, ends);
  const last = part.y.length - 1;
  find(".hands-run").dataset.last = JSON.stringify({ ticks: last + 1, before: part.before, ...Object.fromEntries(TRACES.map((name) => [name, traceOf(part, name)[last]])) });
};
const commandLine = () => {
  const [unit] = unitOf(), rec = desk.record;
  if (rec) return [rec.time.map((t) => t * unit), rec.command.map((value) => value / factor)];
  const at = Array.from({ length: 401 }, (_, k) => k * trial.span / 400), command = commandOf(trial), base = motion();
  return [at.map((t) => t * unit), at.map((t) => (base(t) + command(t)) / factor)];
};
export const runStart = () => {
  measure();
  trial.designed = tried(desk.before, true);
};
// what the run of a record's command leaves over of it, as a curve and in figures
export const residual = (part) => {
  const { time, angle, scale } = desk.record, [unit] = unitOf(), kept = time.map((t) => Math.round(t / part.T)).filter((at) => at < part.y.length);
  const measured = kept.map((_, k) => angle[k] / scale), model = kept.map((at) => part.y[at]);
  return { x: kept.map((_, k) => time[k] * unit), y: measured.map((value, k) => (value - model[k]) * scale / factor), ...fitOf(measured, model) };
};

const again = () => {
  compute(start);
  runStart();
  desk.follow();
};
// what a run is asked for: key of the trial, words, SI over its unit, values that are allowed in words and as a check
const ASKED = [
  ["size", `Size, ${unitIn}:`, factor, "a number that is not 0", (value) => value !== 0],
  ["hertz", "Frequency, Hz:", 1, "a number above 0", (value) => value > 0],
  ["rate", `Rate, ${unitIn}/s:`, factor, "a number above 0", (value) => value > 0],
  ...(data.step.of === "output" ? [["moment", data.axis === "linear" ? "Load, N:" : "Load, N m:", 1, "a number", () => true]] : []),
  ...(data.step.of !== "current" ? [["moving", `Moving, ${data.step.of === "output" ? `${unitIn}/s` : unitIn}:`, factor, "a number", () => true]] : []),
  ["chosen", "Duration, s:", 1, "a number above 0", (value) => value >= 0],
];
const OF = { hertz: ["sine"], rate: ["ramp", "back"] }; // kinds of command that need it
const shown = [];
const show = () => {
  find(".run-kind").value = trial.kind;
  for (const { name, over, label, field } of shown) {
    label.hidden = OF[name] && !OF[name].includes(trial.kind);
    field.value = trial[name] || ["moment", "moving"].includes(name) ? digits(trial[name] / over, 4).replace("−", "-") : "";
  }
};
// the sine of a place on the map of limits
export const playSine = (hertz, amplitude) => {
  Object.assign(trial, { kind: "sine", hertz, size: amplitude * factor });
  show();
  again();
};
export const runKeys = () => {
  const kinds = choice("Command:", Object.entries(KINDS), trial.kind, (kind) => { trial.kind = kind; show(); again(); });
  kinds.lastChild.classList.add("run-kind");
  find(".run-keys").append(kinds);
  trial.rate = Math.abs(trial.size) * 5;
  const band = desk.before.loops[outer].figures?.[PLACE.bandwidth];
  if (band > 0 && Number.isFinite(band)) trial.hertz = Number((band / 3).toPrecision(2));
  for (const [name, words, over, allowed, fits] of ASKED) {
    const field = html("input", { className: "field", type: "text", inputMode: "decimal" }), wrong = html("span", "wrong"), label = labelled(words, field, " ", wrong);
    field.addEventListener("change", () => {
      const value = name === "chosen" && field.value.trim() === "" ? 0 : typed(field.value), good = Number.isFinite(value) && fits(value);
      wrong.textContent = good ? "" : refused(field.value, allowed);
      field.ariaInvalid = String(!good);
      if (!good) return;
      trial[name] = value * over;
      again();
    });
    find(".run-keys").append(label);
    shown.push({ name, over, label, field });
  }
  show();
};
