// Values of the keys, now and in pinned variants: moved, undone, said in the address.
import { data, desk, root } from "./desk.js";

export const keys = data.keys;
export const start = keys.map((key) => key.value);
// values of the keys and pinned variants (values by letter), both before the move under way, and the ways back and forth
const first = { values: start, pins: {} };
/** @type {any} */
export const past = { ...first, settled: first, back: [], forth: [] };
let frame = 0; // that the page follows in; 0 where it has followed
const same = (a, b) => a.every((value, k) => value === b[k]);
export const allowed = (key, value) => Number.isFinite(value) && value >= (key.least ?? -Infinity) && value <= (key.most ?? Infinity) && (!key.whole || Number.isInteger(value));
export const inUnit = (key, value) => value / key.factor;

export const preview = (k, value) => {
  past.values = past.values.slice();
  past.values[k] = value;
  later();
};
export const commit = () => {
  if (same(past.values, past.settled.values) && past.pins === past.settled.pins) return;
  past.back.push(past.settled);
  past.forth = [];
  past.settled = { values: past.values, pins: past.pins };
  later();
  remember();
};
const go = (from, to) => {
  if (!from.length) return;
  to.push(past.settled);
  Object.assign(past, past.settled = from.pop());
  later();
  remember();
};
export const undo = () => go(past.back, past.forth);
export const redo = () => go(past.forth, past.back);
const set = (changed) => {
  Object.assign(past, changed);
  later(); // also from a move under way back to what was committed
  commit();
};
export const reset = () => set({ values: start });
export const LETTERS = ["A", "B", "C"];
export const free = () => LETTERS.find((letter) => !past.pins[letter]);
export const pin = () => {
  if (frame) followed(); // what has just moved may be refused
  if (free() && !desk.refused) set({ pins: { ...past.pins, [free()]: past.values } });
};
// a button of a variant stays till the page follows
export const unpin = (letter) => past.pins[letter] && set({ pins: Object.fromEntries(Object.entries(past.pins).filter(([each]) => each !== letter)) });
export const restore = (letter) => past.pins[letter] && set({ values: past.pins[letter] });
const followed = () => {
  cancelAnimationFrame(frame);
  frame = 0;
  desk.follow();
};
const later = () => {
  desk.leave();
  frame ||= requestAnimationFrame(followed);
};
export const moves = () => frame > 0;
export const changes = (values = past.values) => keys.map((key, k) => [key, values[k]]).filter(([key, value]) => value !== key.value);
export const fragment = () => "#hands-on" + (changes().length ? "?" + changes().map(([key, value]) => `${encodeURIComponent(key.path)}=${value}`).join("&") : "");
const remember = () => { try { history.replaceState(null, "", changes().length ? fragment() : location.pathname + location.search); } catch { /* a place without a history */ } };
export const fromFragment = () => {
  const text = location.hash;
  if (!text.startsWith("#hands-on?")) return;
  let told;
  try { told = new Map(text.slice(10).split("&").map((part) => part.split("=")).map(([path, value]) => [decodeURIComponent(path), Number(value || NaN)])); } catch { return; }
  set({ values: keys.map((key) => (allowed(key, told.get(key.path)) ? told.get(key.path) : key.value)) });
  root.scrollIntoView();
};
