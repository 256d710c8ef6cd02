// Pinned variants A, B and C: their curves beside those of now, their figures side by side.
import { beside, without } from "./curves.js";
import { LOOP_NAMES, PLACE, STABLE, data, desk, find } from "./desk.js";
import { changes, inUnit, past } from "./history.js";
import { compute } from "./module.js";
import { calm, judged } from "./requirements.js";
import { digits, fill, heading, html } from "./words.js";

const found = new WeakMap(); // what a variant comes to, by its values
let drawn = "", pins = null;
const button = (does, letter, words) => {
  const made = html("button", "", words);
  made.type = "button";
  Object.assign(made.dataset, { do: does, letter });
  made.setAttribute("aria-label", `${words} variant ${letter}`);
  return made;
};
const said = (values) => changes(values).map(([key, value]) => `${key.path} ${digits(inUnit(key, value), 4)} ${key.unit}`.trim()).join(", ") || "as designed";
// the module computes what now is after this
export const drawPins = () => {
  if (pins === past.pins && drawn === desk.shown) return;
  for (const letter of ["A", "B", "C"]) {
    const values = past.pins[letter];
    const own = values && compute(values, !found.has(values));
    if (own && !found.has(values)) found.set(values, own);
    if (own?.loops[desk.shown].figures) beside(letter, desk.shown, own.loops[desk.shown]); else without(letter);
  }
  find(".pins").replaceChildren(...Object.keys(past.pins).sort().map((letter) => {
    const item = html("li", "");
    item.append(html("b", "", `${letter}: `), `${said(past.pins[letter])} `, button("restore", letter, "Restore"), " ", button("unpin", letter, "Remove"));
    return item;
  }));
  pins = past.pins;
  drawn = desk.shown;
};
const count = (all) => `${all.filter(({ met }) => met).length} of ${all.length}`;
export const sideBySide = () => {
  const letters = Object.keys(past.pins).sort(), box = find("table.variants"), name = desk.shown;
  box.closest(".scroll").hidden = !letters.length;
  if (!letters.length) return;
  const parts = [desk.before, desk.now, ...letters.map((letter) => found.get(past.pins[letter]))];
  const verdicts = parts.map(judged), unmet = (all, quantity) => all.some(({ item, met }) => item.loop === name && item.quantity === quantity && met === false);
  const rows = data.figures.map(({ name: quantity, label, unit, factor }) => {
    const row = html("tr");
    row.append(heading(`${label}, ${unit}`, "left", "row"), ...parts.map(({ loops }, k) => {
      const own = loops[name].figures, value = own && own[STABLE] === 1 ? calm(own[PLACE[quantity]] * factor, unit) : NaN;
      const cell = html("td", unmet(verdicts[k], quantity) ? "right bad" : "right", digits(value, 4));
      cell.dataset.variant = value;
      return cell;
    }));
    return row;
  });
  const last = html("tr");
  last.append(heading("Requirements met, all loops", "left", "row"), ...verdicts.map((all) => html("td", "right", count(all))));
  fill(box, [heading(LOOP_NAMES[name]), ...["As designed", "As changed", ...letters].map((words) => heading(words, "right"))], data.requirements.length ? [...rows, last] : rows);
};
