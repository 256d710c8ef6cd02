// The changed design as a file, a patch, a text.
import { data, find } from "./desk.js";
import { inUnit, keys, past, start } from "./history.js";
import { unified } from "./diff.js";
import { give } from "./words.js";

export const changedText = () => {
  const places = data.patches.map((patch, k) => [patch, k]).filter(([, k]) => past.values[k] !== start[k]).sort((a, b) => a[0][0] - b[0][0] || a[0][1] - b[0][1]);
  let text = "", at = 0;
  const letters = [...data.text];
  for (const [[from, to, lead, tail], k] of places) {
    const key = keys[k], value = inUnit(key, past.values[k]);
    text += letters.slice(at, from).join("") + lead + (key.unit ? `"${value} ${key.unit}"` : String(Number.isInteger(value) && !key.whole ? value.toFixed(1) : value)) + tail;
    at = to;
  }
  return text + letters.slice(at).join("");
};
const named = (tail) => `${data.name.replace(/[^\w.-]/g, "_") || "design"}${tail}`;
export const save = () => give(named("-changed.toml"), changedText());
export const savePatch = () => give(named(".patch"), unified(data.text, changedText(), named(".toml")));
export const sheet = (text) => {
  const box = find(".sheet"), area = box.querySelector("textarea");
  area.value = text;
  box.hidden = false;
  area.focus();
  area.select();
};
export const copy = () => {
  const area = find(".sheet textarea");
  area.select();
  if (navigator.clipboard) navigator.clipboard.writeText(area.value).catch(() => document.execCommand("copy"));
  else document.execCommand("copy");
};
