// Values of the keys: moved, undone, said in the address.
import { data, desk, root } from "./desk.js";

export const keys = data.keys;
export const start = keys.map((key) => key.value);
// values of the keys, those before the move under way, and the ways back and forth
/** @type {any} */
export const past = { values: start.slice(), settled: start.slice(), back: [], forth: [] };
let waiting = false;
const same = (a, b) => a.every((value, k) => value === b[k]);
export const allowed = (key, value) => Number.isFinite(value) && (key.open ? value > key.least : value >= (key.least ?? -Infinity)) && value <= (key.most ?? Infinity) && (!key.whole || Number.isInteger(value));
export const inUnit = (key, value) => value / key.factor;

export const preview = (k, value) => {
  past.values = past.values.slice();
  past.values[k] = value;
  later();
};
export const commit = () => {
  if (same(past.values, past.settled)) return;
  past.back.push(past.settled);
  past.forth = [];
  past.settled = past.values.slice();
  later();
  remember();
};
const go = (from, to) => {
  if (!from.length) return;
  to.push(past.settled);
  past.settled = from.pop();
  past.values = past.settled.slice();
  later();
  remember();
};
export const undo = () => go(past.back, past.forth);
export const redo = () => go(past.forth, past.back);
export const reset = () => {
  past.values = start.slice();
  commit();
};
const later = () => {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    desk.follow();
  });
};
export const changes = () => keys.map((key, k) => [key, past.values[k]]).filter(([key, value]) => value !== key.value);
export const fragment = () => "#hands-on" + (changes().length ? "?" + changes().map(([key, value]) => `${encodeURIComponent(key.path)}=${value}`).join("&") : "");
const remember = () => { try { history.replaceState(null, "", changes().length ? fragment() : location.pathname + location.search); } catch { /* a place without a history */ } };
export const fromFragment = () => {
  const text = location.hash;
  if (!text.startsWith("#hands-on?")) return;
  let told;
  try { told = new Map(text.slice(10).split("&").map((part) => part.split("=")).map(([path, value]) => [decodeURIComponent(path), Number(value || NaN)])); } catch { return; }
  past.values = keys.map((key) => (allowed(key, told.get(key.path)) ? told.get(key.path) : key.value));
  commit();
  root.scrollIntoView();
};
