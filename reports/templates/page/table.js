// The table of loops, where the cogging is steepest as well, and of break points: every figure, and what it was.
import { BEHIND, DOUBT, LOOP_NAMES, PLACE, POINT_NAMES, STABLE, data, desk, find } from "./desk.js";
import { calm, unmet } from "./requirements.js";
import { digits, fill, heading, html } from "./words.js";

const NONE = { "-1": "not followed here: too many states for this page", [DOUBT]: "stability not known: rounding decides its figures", [BEHIND]: "follows in a moment" };
const rowOf = (name, bad, where = "") => {
  const of = (found) => (where ? found.turned[where][name] : found.loops[name] || found.points[name]), own = of(desk.now), old = of(desk.before), loop = name + (where && ` ${where}`);
  const th = heading((LOOP_NAMES[name] || POINT_NAMES[name]) + (where && `, ${where.split(" of ")[0]}`), "left", "row"), row = html("tr", {}, th);
  if (!own.figures || !old.figures) {
    row.append(html("td", { colSpan: data.figures.length }, NONE[own.figures ? old.n : own.n] || "no loop"));
    return row;
  }
  const stable = own.figures[STABLE] === 1;
  if (own.phases > 1) th.append(" ", html("span", "unit", "fundamental"));
  if (own.held) th.append(" ", html("span", "unit", data.held[name]));
  if (!stable) th.append(" ", html("span", "mark fail", "unstable"));
  Object.assign(th.dataset, { loop, stable: own.figures[STABLE] });
  row.append(...data.figures.map(({ name: figure, unit, factor, timed, response }) => {
    if ((name in desk.now.points && response) || (where && timed)) return html("td"); // of a break point it says nothing
    if (own.waits && timed) return html("td", "right", "…");
    // of a loop that is not stable no figure is shown, neither what it is nor what it was
    const value = own.figures[PLACE[figure]], [words, was] = [own, old].map(({ figures }) => digits(calm(figures[STABLE] === 1 ? figures[PLACE[figure]] * factor : NaN, unit), 4));
    const cell = html("td", { className: bad(name, figure) && !where ? "right bad" : "right", dataset: { loop, figure, value } }, html("b", {}, words));
    if (words !== was) cell.append(html("span", "was", `was ${was}`));
    return cell;
  }));
  return row;
};
export const table = () => {
  const turned = Object.keys(data.turned).flatMap((where) => data.loops.map((name) => [name, where]));
  const there = [...data.loops, ...Object.keys(data.points).filter((name) => desk.now.points[name].n !== 0)], bad = unmet(desk.now);
  const heads = data.figures.map(({ label, unit }) => html("th", { className: "right", scope: "col" }, label + " ", html("span", "unit", unit)));
  fill(find("table.now"), [heading("Loop"), ...heads], [...there.map((name) => [name]), ...turned].map(([name, where]) => rowOf(name, bad, where)));
};
