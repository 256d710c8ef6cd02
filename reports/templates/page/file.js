// The changed design as a file, a patch, a text.
import { data, find } from "./desk.js";
import { inUnit, keys, past, start } from "./history.js";
import { unified } from "./diff.js";
import { give } from "./words.js";

// places of the text that change, in order, and what stands there then
const edits = () => data.patches.map(([from, to, lead, tail], k) => {
  const key = keys[k], value = inUnit(key, past.values[k]);
  return { from, to, moved: past.values[k] !== start[k], text: lead + (key.unit ? `"${value} ${key.unit}"` : String(Number.isInteger(value) && !key.whole ? value.toFixed(1) : value)) + tail };
}).filter(({ moved }) => moved).sort((a, b) => a.from - b.from || a.to - b.to);
export const changedText = () => {
  const letters = [...data.text], made = edits();
  return made.map(({ from, text }, k) => letters.slice(made[k - 1]?.to ?? 0, from).join("") + text).join("") + letters.slice(made.at(-1)?.to ?? 0).join("");
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
  const area = find(".sheet textarea"), old = () => document.execCommand("copy");
  area.select();
  if (navigator.clipboard) navigator.clipboard.writeText(area.value).catch(old);
  else old();
};
