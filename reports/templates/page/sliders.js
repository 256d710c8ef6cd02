// A slider for every key: its range, its tolerance, its value as written.
import { data, find } from "./desk.js";
import { allowed, changes, commit, inUnit, keys, past, preview } from "./history.js";
import { digits, html, refused, typed } from "./words.js";

const share = (key, value) => (key.low > 0 ? Math.log(value / key.low) / Math.log(key.high / key.low) : (value - key.low) / (key.high - key.low));
const along = (key, part) => (key.low > 0 ? key.low * (key.high / key.low) ** part : key.low + part * (key.high - key.low));
const valueAt = (key, part) => (key.whole ? Math.round(along(key, part)) : along(key, part));
const within = (value, low, high) => Math.min(Math.max(value, low), high);
const said = (key, value) => (key.whole ? String(value) : digits(inUnit(key, value), 4));
const ORDER = ["control.position", "control.velocity", "control.current", "control", "encoder", "command", "limits", "friction", "load", "supply", "motor", "gear"];
const OPEN = ORDER.slice(0, matchMedia("(max-width: 60rem)").matches ? 2 : 4);
const titleOf = (path) => path.split(".").slice(0, -1).join(".");
const rank = (title) => { const k = ORDER.findIndex((name) => title === name || title.startsWith(name + ".")); return k < 0 ? 99 : k; };
const MOVES = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 };

const set = (k, value) => {
  preview(k, value);
  commit();
};
const makeSlider = (key, k) => {
  const id = `hand-${k}`, track = html("div", "track"), was = html("span", { className: "was", id: `said-${k}` });
  if (key.band) {
    const [from, to] = key.band.map((end) => 100 * within(share(key, Math.max(end, key.low)), 0, 1));
    track.append(html("i", { className: "band", title: "tolerance of the design file", style: `left:${from}%;width:${to - from}%` }));
  }
  const range = html("input", { type: "range", id, min: 0, max: 1000, step: "any", ariaDescription: key.about });
  const field = html("input", { className: "field", type: "text", inputMode: "decimal", ariaLabel: `${key.path}${key.unit ? ", " + key.unit : ""}` });
  field.setAttribute("aria-describedby", was.id);
  track.append(html("i", { className: "origin", style: `left:${100 * share(key, key.value)}%` }), range);
  range.addEventListener("input", () => preview(k, valueAt(key, range.value / 1000)));
  range.addEventListener("change", () => set(k, valueAt(key, range.value / 1000))); // an undo may have come in between
  range.addEventListener("keydown", (event) => {
    const move = MOVES[event.key];
    if (!move) return;
    event.preventDefault();
    const to = valueAt(key, within(share(key, past.values[k]) + move / 200, 0, 1));
    set(k, key.whole && to === past.values[k] ? within(to + Math.sign(move), key.low, key.high) : to);
  });
  range.addEventListener("dblclick", () => set(k, key.value));
  field.addEventListener("change", () => {
    const value = typed(field.value, key.unit), good = allowed(key, value * key.factor);
    slider.wrong = good ? "" : refused(field.value, `allowed: ${key.whole ? "a whole number, " : ""}${key.allowed}`);
    slider.at = past.values[k];
    if (good) set(k, value === inUnit(key, key.value) ? key.value : value * key.factor);
    else show();
  });
  field.addEventListener("input", () => { slider.wrong = ""; });
  const label = html("label", { htmlFor: id, title: key.about }, key.path.slice(titleOf(key.path).length + 1).replaceAll("_", " "));
  const slider = { key, row: html("div", { className: "row", dataset: { path: key.path } }, label, field, html("span", "unit", key.unit), track, was), range, field, was, wrong: "", at: key.value };
  return slider;
};
const rows = keys.map(makeSlider);
export const makePanel = () => {
  const box = find(".keys-of"), titles = [...new Set(keys.map((key) => titleOf(key.path)))].sort((a, b) => rank(a) - rank(b));
  for (const title of titles) {
    const own = rows.filter(({ key }) => titleOf(key.path) === title).sort((a, b) => Number(a.key.value === 0) - Number(b.key.value === 0)); // those in use first
    box.append(html("details", { className: "group", open: OPEN.includes(title) }, html("summary", {}, title), ...own.map(({ row }) => row)));
  }
  const fixed = data.fixed.map((key) => html("li", {}, html("code", {}, key.path), ` ${key.whole ? key.value : digits(inUnit(key, key.value), 5)}${key.unit && ` ${key.unit}`}: ${key.why}.`));
  if (fixed.length) box.append(html("details", "group fixed", html("summary", {}, `${fixed.length} keys without a slider`), html("ul", {}, ...fixed)));
};

export const show = () => {
  rows.forEach(({ key, row, range, field, was, wrong: refused, at }, k) => {
    const value = past.values[k], moved = value !== key.value, wrong = value === at ? refused : ""; // moved since: another value
    if (document.activeElement !== range || !range.matches(":active")) range.value = 1000 * within(share(key, value), 0, 1);
    range.ariaValueText = `${said(key, value)} ${key.unit}`;
    if (document.activeElement !== field) field.value = said(key, value).replace("−", "-");
    row.classList.toggle("moved", moved);
    was.textContent = wrong || (moved ? `was ${said(key, key.value)}` : "");
    was.classList.toggle("wrong", Boolean(wrong));
    field.ariaInvalid = String(Boolean(wrong));
  });
  const doing = { undo: past.back.length, redo: past.forth.length, reset: changes().length };
  for (const name in doing) find(`[data-do="${name}"]`).disabled = !doing[name];
};
