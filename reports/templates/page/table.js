// The table of loops and break points: every figure, and what it was.
import { BEHIND, DOUBT, LOOP_NAMES, PLACE, POINT_NAMES, STABLE, data, desk, find } from "./desk.js";
import { stageOf, x } from "./module.js";
import { calm, judged } from "./requirements.js";
import { digits, fill, heading, html } from "./words.js";

// of a loop that is not stable no figure is shown
const cell = (now, was, factor, loop, name, unit, stable) => {
  const made = html("td", "right"), value = stable ? calm(now * factor, unit) : NaN, old = calm(was * factor, unit);
  made.dataset.loop = loop;
  made.dataset.figure = name;
  made.dataset.value = now;
  made.append(html("b", "", digits(value, 4)));
  if (digits(value, 4) !== digits(old, 4)) made.append(html("span", "was", `was ${digits(old, 4)}`));
  return made;
};
const NONE = { "-1": "not followed here: too many states for this page", [DOUBT]: "stability not known: rounding decides its figures", [BEHIND]: "follows in a moment" };
export const table = () => {
  const head = data.figures.map(({ label, unit }) => {
    const th = heading(label + " ", "right");
    th.append(html("span", "unit", unit));
    return th;
  });
  const body = [], bad = new Set(judged(desk.now).filter(({ met }) => met === false).map(({ item }) => item.loop + " " + item.quantity));
  for (const name of [...data.loops, ...Object.keys(data.points)]) {
    const own = desk.now.loops[name] || desk.now.points[name], old = desk.before.loops[name] || desk.before.points[name];
    if (own.n === 0 && !(name in desk.now.loops)) continue; // no such break point
    const row = html("tr"), th = heading(LOOP_NAMES[name] || POINT_NAMES[name], "left", "row");
    row.append(th);
    if (!own.figures || !old.figures) {
      const td = html("td", "", NONE[own.figures ? old.n : own.n] || "no loop");
      td.colSpan = data.figures.length;
      row.append(td);
    } else {
      if (x.phases_of(stageOf(name) ?? data.points[name]) > 1) th.append(" ", html("span", "unit", "fundamental"));
      if (own.figures[STABLE] !== 1) th.append(" ", html("span", "mark fail", "unstable"));
      th.dataset.loop = name;
      th.dataset.stable = own.figures[STABLE];
      for (const { name: quantity, unit, factor, timed, response } of data.figures) {
        if (name in desk.now.points && response) { // of a break point it says nothing
          row.append(html("td"));
          continue;
        }
        if (own.waits && timed) {
          row.append(html("td", "right", "…"));
          continue;
        }
        const k = PLACE[quantity], td = cell(own.figures[k], old.figures[k], factor, name, quantity, unit, own.figures[STABLE] === 1);
        if (bad.has(name + " " + quantity)) td.classList.add("bad");
        row.append(td);
      }
    }
    body.push(row);
  }
  fill(find("table.now"), [heading("Loop"), ...head], body);
};
