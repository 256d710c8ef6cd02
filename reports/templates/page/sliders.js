// A slider for every key: its range, its tolerance, its value as written.
import { data, find } from "./desk.js";
import { allowed, changes, commit, inUnit, keys, past, preview } from "./history.js";
import { digits, html } from "./words.js";

const share = (key, value) => (key.low > 0 ? Math.log(value / key.low) / Math.log(key.high / key.low) : (value - key.low) / (key.high - key.low));
const along = (key, part) => (key.low > 0 ? key.low * (key.high / key.low) ** part : key.low + part * (key.high - key.low));
const valueAt = (key, part) => (key.whole ? Math.round(along(key, part)) : along(key, part));
const said = (key, value) => (key.whole ? String(value) : digits(inUnit(key, value), 4));
const OPEN = matchMedia("(max-width: 60rem)").matches ? ["control.position", "control.velocity"] : ["control", "control.position", "control.velocity", "control.current"];
const ORDER = ["control.position", "control.velocity", "control.current", "control", "encoder", "command", "limits", "friction", "load", "supply", "motor", "gear"];
const titleOf = (path) => path.split(".").slice(0, -1).join(".");
const rank = (title) => { const k = ORDER.findIndex((name) => title === name || title.startsWith(name + ".")); return k < 0 ? 99 : k; };

const rows = [];
const makeSlider = (key, k) => {
  const row = html("div", "row"), id = `hand-${k}`;
  row.dataset.path = key.path;
  const label = html("label", "", key.path.slice(titleOf(key.path).length + 1).replaceAll("_", " "));
  label.htmlFor = id;
  label.title = key.about;
  const track = html("div", "track");
  if (key.band) {
    const band = html("i", "band"), from = Math.max(share(key, Math.max(key.band[0], key.low)), 0), to = Math.min(share(key, key.band[1]), 1);
    band.style.left = `${100 * from}%`;
    band.style.width = `${100 * (to - from)}%`;
    band.title = "tolerance of the design file";
    track.append(band);
  }
  const origin = html("i", "origin");
  origin.style.left = `${100 * share(key, key.value)}%`;
  const range = html("input");
  range.type = "range";
  range.id = id;
  range.min = 0;
  range.max = 1000;
  range.step = "any";
  range.setAttribute("aria-description", key.about);
  const field = html("input", "field");
  field.type = "text";
  field.inputMode = "decimal";
  field.setAttribute("aria-label", `${key.path}${key.unit ? ", " + key.unit : ""}`);
  track.append(origin, range);
  range.addEventListener("input", () => preview(k, valueAt(key, range.value / 1000)));
  range.addEventListener("change", () => commit());
  range.addEventListener("keydown", (event) => {
    const move = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 }[event.key];
    if (!move) return;
    event.preventDefault();
    const to = valueAt(key, Math.min(1, Math.max(0, share(key, past.values[k]) + move / 200)));
    preview(k, key.whole && to === past.values[k] ? Math.min(key.high, Math.max(key.low, to + Math.sign(move))) : to);
    commit();
  });
  range.addEventListener("dblclick", () => { preview(k, key.value); commit(); });
  field.addEventListener("change", () => {
    const typed = Number(field.value.replace(",", ".").replace("−", "-"));
    if (field.value.trim() !== "" && allowed(key, typed * key.factor)) { slider.wrong = ""; preview(k, typed === inUnit(key, key.value) ? key.value : typed * key.factor); commit(); }
    else {
      slider.wrong = `"${field.value}": allowed: ${key.whole ? "a whole number, " : ""}${key.allowed}`;
      show();
    }
  });
  field.addEventListener("input", () => { slider.wrong = ""; });
  const was = html("span", "was");
  row.append(label, field, html("span", "unit", key.unit), track, was);
  was.id = `said-${k}`;
  field.setAttribute("aria-describedby", was.id);
  const slider = { key, row, range, field, was, wrong: "" };
  return slider;
};
export const makePanel = () => {
  const groups = new Map();
  keys.forEach((key, k) => {
    const slider = makeSlider(key, k), title = titleOf(key.path);
    rows.push(slider);
    if (!groups.has(title)) groups.set(title, []);
    groups.get(title).push(slider.row);
  });
  const box = find(".keys-of");
  for (const title of [...groups.keys()].sort((a, b) => rank(a) - rank(b))) {
    const group = html("details", "group");
    group.open = OPEN.includes(title);
    const unused = (row) => (keys.find((key) => key.path === row.dataset.path).value === 0 ? 1 : 0);
    group.append(html("summary", "", title), ...groups.get(title).sort((a, b) => unused(a) - unused(b)));
    box.append(group);
  }
  const fixed = html("details", "group fixed"), list = html("ul");
  fixed.append(html("summary", "", `${data.fixed.length} keys without a slider`));
  for (const key of data.fixed) {
    const item = html("li"), value = key.whole ? String(key.value) : digits(inUnit(key, key.value), 5);
    item.append(html("code", "", key.path), ` ${value} ${key.unit}: ${key.why}.`);
    list.append(item);
  }
  fixed.append(list);
  if (data.fixed.length) box.append(fixed);
};

export const show = () => {
  rows.forEach((slider, k) => {
    const { key } = slider, value = past.values[k], moved = value !== key.value;
    if (document.activeElement !== slider.range || !slider.range.matches(":active")) slider.range.value = 1000 * Math.min(1, Math.max(0, share(key, value)));
    slider.range.setAttribute("aria-valuetext", `${said(key, value)} ${key.unit}`);
    if (document.activeElement !== slider.field) slider.field.value = said(key, value).replace("−", "-");
    slider.row.classList.toggle("moved", moved);
    slider.was.textContent = slider.wrong || (moved ? `was ${said(key, key.value)}` : "");
    slider.was.classList.toggle("wrong", Boolean(slider.wrong));
    slider.field.setAttribute("aria-invalid", String(Boolean(slider.wrong)));
  });
  const doing = { undo: past.back.length, redo: past.forth.length, reset: changes().length };
  for (const name in doing) find(`[data-do="${name}"]`).disabled = !doing[name];
};
