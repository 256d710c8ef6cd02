// What the design asks for: as found, met or not, in words.
import { DOUBT, LOOP_NAMES, PLACE, STABLE, data, desk, find } from "./desk.js";
import { changes } from "./history.js";
import { digits, fill, heading, html, minus } from "./words.js";

// a requirement as found: its value (NaN: none), and whether it is met (null: not proven)
export const judged = (found) => data.requirements.map((item, k) => {
  const loop = found.loops[item.loop];
  if (item.loop && (!loop || !loop.figures)) return { item, value: NaN, met: null };
  if (item.loop && loop.figures[STABLE] !== 1) return { item, value: NaN, met: false, words: "unstable" };
  if (item.loop && loop.waits && item.timed) return { item, value: NaN, met: null, words: "…" };
  let value = item.loop ? loop.figures[PLACE[item.quantity]] : found.drive[k] ?? NaN;
  if (item.absolute) value = Math.abs(value);
  return { item, value, met: Number.isNaN(value) ? null : value >= (item.minimum ?? -Infinity) && value <= (item.maximum ?? Infinity) };
});
// whether a figure of a loop is beyond what is asked for
export const unmet = (found) => {
  const beyond = new Set(judged(found).filter(({ met }) => met === false).map(({ item }) => `${item.loop} ${item.quantity}`));
  return (loop, quantity) => beyond.has(`${loop} ${quantity}`);
};
export const calm = (value, unit) => (["dB", "deg", "%"].includes(unit) && Math.abs(value) < 1 ? Math.round(value * 1e4) / 1e4 : value); // no -3e-5 dB

const NAMED = 3; // of what is not met, in the line at the top
// the line at the top, and the table of requirements
export const state = () => {
  const { refused } = desk, line = find(".state"), all = judged(desk.now), was = judged(desk.before), total = all.length;
  const fails = all.filter(({ met }) => met === false), old = was.filter(({ met }) => met === false), open = all.filter(({ met, words }) => met === null && words !== "…");
  const unstable = data.loops.filter((name) => desk.now.loops[name].figures && desk.now.loops[name].figures[STABLE] !== 1);
  const unknown = data.loops.filter((name) => desk.now.loops[name].n === DOUBT), words = [], elsewhere = [];
  if (unknown.length) words.push(`Stability not known: ${unknown.join(", ")}.`);
  if (unstable.length) words.push(`Unstable: ${unstable.join(", ")}.`);
  for (const [where, loops] of Object.entries(desk.now.turned)) {
    const lost = data.loops.filter((name) => !unstable.includes(name) && loops[name].figures && loops[name].figures[STABLE] !== 1);
    if (lost.length) words.push(`Unstable ${where}: ${lost.join(", ")}.`);
    elsewhere.push(...lost);
  }
  const met = all.filter((one) => one.met).length, count = (many, word) => (many ? `, ${many} ${word}` : "");
  const designed = changes().length && old.length !== fails.length ? ` (as designed: ${old.length} not met)` : "";
  const named = [...fails, ...open].slice(0, NAMED).map(({ item }) => (item.loop ? `${item.words} of the ${placed(item).toLowerCase()}` : `${item.words} ${placed(item)}`.trim())), more = fails.length + open.length - named.length;
  if (total) words.push(`${met} of ${total} requirements met${count(fails.length, "not met")}${count(open.length, "not proven")}${designed}${named.length ? `: ${named.join(", ")}${more ? ` and ${more} more` : ""}` : ""}.`);
  else if (!data.apart.length) words.push("The design states no requirements.");
  if (data.apart.length) words.push(`${data.apart.length} ${data.apart.length === 1 ? "does" : "do"} not follow the sliders: ${[...new Set(data.apart.map((item) => item.words))].join(", ")}.`);
  line.className = `state ${refused || unstable.length || fails.length ? "fail" : unknown.length || elsewhere.length || open.length ? "warn" : total ? "pass" : "info"}`;
  line.textContent = refused || words.join(" "); // what is refused has no verdict
  line.dataset.failing = fails.length;
  demands(all, was);
};
const placed = (item) => (item.loop ? LOOP_NAMES[item.loop] : item.load ? `at ${minus(String(item.load))} ${data.axis === "linear" ? "N" : "N m"}` : "");
const demands = (all, was) => {
  const box = find("table.demands"), right = (words, bad) => html("td", bad ? "right bad" : "right", words);
  box.closest("details").hidden = !all.length;
  const found = ({ item, value, words }) => words || `${digits(calm(value * item.factor, item.unit), 4)} ${item.unit}`;
  const rows = all.map((one, k) => {
    const { item, value, met } = one, th = heading(item.words[0].toUpperCase() + item.words.slice(1), "left", "row");
    th.title = item.id;
    const verdict = html("span", `mark ${met === null ? "warn" : met ? "pass" : "fail"}`, met === null ? "not proven" : met ? "met" : was[k].met === false ? "not met" : "now not met");
    return html("tr", { dataset: { id: item.id, loop: item.loop || "", value, met } }, th, html("td", "left", placed(item)), right(minus(item.limit)), right(found(was[k])), right(found(one), met === false), html("td", "left", verdict));
  });
  fill(box, [...["Requirement", "Where"].map((words) => heading(words)), ...["Limit", "As designed", "As changed"].map((words) => heading(words, "right")), heading("Verdict")], rows);
};
