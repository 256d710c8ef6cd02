// What the sliders of a page share: its data, its elements, and what is found now.

const holder = document.getElementById("live-data");
export const root = document.getElementById("hands-on");
/** @type {any} */
export const data = holder && JSON.parse(holder.textContent);
/** @type {(selector: string) => any} */
export const find = (selector) => root.querySelector(selector);
export const chart = (name) => find(`[data-chart="${name}"] .chart`);
export const tell = (name, what, detail) => chart(name).dispatchEvent(new CustomEvent(`chart:${what}`, { detail }));
export const outer = data.loops[data.loops.length - 1];
export const PLACE = Object.fromEntries(data.quantities.map((name, k) => [name, k]));
export const STABLE = data.quantities.length;
export const LOOP_NAMES = { current: "Current loop", velocity: "Velocity loop", position: "Position loop" };
export const POINT_NAMES = { "at w_ref": "Cut at the speed command", "at i_ref": "Cut at the current command", "at u": "Cut at the voltage" };
// of a limit, in the map, in the run, and on the motor that is played
export const colourOf = (name) => data.map?.colours[name] ?? "c5";
export const BEHIND = -9; // a loop that follows in a moment, and one whose stability rounding decides
export const DOUBT = -3;
// as designed, as changed, the loop whose curves are seen, measured data, the limits that acted in the last run (bits)
/** @type {any} */
export const desk = { before: null, now: null, shown: outer, record: null, response: null, acted: 0, late: null, refused: "", follow: () => {}, leave: () => {} };
