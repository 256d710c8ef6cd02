// Pinned variants A, B and C: their curves beside those of now, their figures side by side.
import { beside, without } from "./curves.js";
import { LOOP_NAMES, PLACE, STABLE, data, desk, find } from "./desk.js";
import { LETTERS, changes, inUnit, past } from "./history.js";
import { compute } from "./module.js";
import { calm, judged, unmet } from "./requirements.js";
import { button, digits, fill, heading, html } from "./words.js";

const found = new WeakMap(); // what a variant comes to, by its values
let drawn = "", pins = null;
const letters = () => LETTERS.filter((letter) => past.pins[letter]);
const said = (values) => changes(values).map(([key, value]) => `${key.path} ${digits(inUnit(key, value), 4)} ${key.unit}`.trim()).join(", ") || "as designed";
const does = (words, act, letter) => button(words, undefined, { ariaLabel: `${words} variant ${letter}`, dataset: { do: act, letter } });
// the module computes what now is after this
export const drawPins = () => {
  if (pins === past.pins && drawn === desk.shown) return;
  for (const letter of LETTERS) {
    const values = past.pins[letter];
    const own = values && compute(values, !found.has(values));
    if (own && !found.has(values)) found.set(values, own);
    if (own?.loops[desk.shown].figures) beside(letter, desk.shown, own.loops[desk.shown]); else without(letter);
  }
  find(".pins").replaceChildren(...letters().map((letter) => html("li", {}, html("b", {}, `${letter}: `), `${said(past.pins[letter])} `, does("Restore", "restore", letter), " ", does("Remove", "unpin", letter))));
  pins = past.pins;
  drawn = desk.shown;
};
export const sideBySide = () => {
  const box = find("table.variants"), name = desk.shown, known = letters();
  box.closest(".scroll").hidden = !known.length;
  if (!known.length) return;
  const parts = [desk.before, desk.now, ...known.map((letter) => found.get(past.pins[letter]))], bad = parts.map(unmet);
  const rows = data.figures.map(({ name: quantity, label, unit, factor, timed }) => html("tr", {}, heading(`${label}, ${unit}`, "left", "row"), ...parts.map(({ loops }, k) => {
    const own = loops[name].figures, value = own && own[STABLE] === 1 ? calm(own[PLACE[quantity]] * factor, unit) : NaN;
    return html("td", { className: bad[k](name, quantity) ? "right bad" : "right", dataset: { variant: value } }, timed && loops[name].waits ? "…" : digits(value, 4));
  })));
  const counts = parts.map(judged).map((all) => `${all.filter(({ met }) => met).length} of ${all.length}`);
  if (data.requirements.length) rows.push(html("tr", {}, heading("Requirements met, all loops", "left", "row"), ...counts.map((words) => html("td", "right", words))));
  fill(box, [heading(LOOP_NAMES[name]), ...["As designed", "As changed", ...known].map((words) => heading(words, "right"))], rows);
};
