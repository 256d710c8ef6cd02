// The sliders: keys of the design -> row of the simulator -> loops, margins, curves and a run, all in the module.
import { emptyBehind, fillBehind, watchMap } from "./behind.js";
import { limits, limitsStart, drawLimits } from "./limits.js";
import { beside, designed, draw, frame, kept } from "./curves.js";
import { LOOP_NAMES, chart, data, desk, find, root } from "./desk.js";
import { holdCurves, marginMarks, stepGain } from "./drag.js";
import { changedText, copy, save, savePatch, sheet } from "./file.js";
import { fragment, free, fromFragment, keys, past, pin, redo, reset, restore, start, undo, unpin } from "./history.js";
import { limitsOf, compute, load, slow } from "./module.js";
import { follow, playStart } from "./playback.js";
import { forget, overLoop, overRun, take } from "./record.js";
import { refusalOf } from "./relations.js";
import { state } from "./requirements.js";
import { makePanel, show } from "./sliders.js";
import { table } from "./table.js";
import { drawRuns, playSine, runKeys, runStart, tried } from "./trial.js";
import { drawPins, sideBySide } from "./variants.js";
import { all, button } from "./words.js";

let lastGood = start.slice();
const drawLoop = (name) => {
  const own = desk.now.loops[name];
  if (!own.figures || !kept[name]) return;
  const curves = beside("as changed", name, own);
  if (curves) marginMarks(kept[name].hertz, curves);
  overLoop();
};
const LONG_RUN = 20; // ms
let runTook = 0;
const runNow = (whole) => {
  const began = performance.now(), part = tried(desk.now, whole);
  drawRuns(part);
  follow(part);
  overRun(part);
  runTook = performance.now() - began;
  if (part.more) desk.late = runOn;
};
const runOn = () => runNow(true);
let followUp = 0;
const answered = () => { // a script of its own: the curve that moves does not wait for it
  if (runTook < LONG_RUN) runNow(false);
  else desk.late = runOn; // too long for a moving slider
  fillBehind();
  root.dataset.count = String(+(root.dataset.count || 0) + 1);
};
const leave = () => { // something moves: what was for the values before is not started
  clearTimeout(followUp);
  emptyBehind();
};
const update = () => {
  const began = performance.now();
  desk.refused = "";
  desk.late = null;
  leave();
  drawPins();
  const why = refusalOf(past.values), apart = why && `Refused, nothing follows: ${why}.`, found = apart ? null : compute(past.values);
  if (found && data.loops.every((name) => found.loops[name].n !== 0)) { desk.now = found; lastGood = past.values; } else {
    desk.refused = apart || "The last value needs another structure of the drive: save the file and make a new report.";
    desk.now = { ...desk.now, ...compute(keys.map((key, k) => lastGood[k])) };
  }
  show();
  table();
  sideBySide();
  state();
  find('[data-do="pin"]').disabled = Boolean(desk.refused) || !free();
  drawLoop(desk.shown);
  drawLimits("as changed", limitsOf(desk.now.row, limits.grid));
  root.dataset.ms = (performance.now() - began).toFixed(1);
  followUp = setTimeout(answered, 0);
};
const choose = (name) => {
  desk.shown = name;
  for (const tab of all(".tabs button", root)) tab.ariaPressed = String(tab.dataset.loop === name);
  compute(start);
  designed(name);
  frame(name);
  draw("as designed", kept[name], name);
  update();
};

const begin = () => {
  root.hidden = false;
  all(".to-hands").forEach((item) => (item.hidden = false));
  makePanel();
  desk.before = desk.now = compute(start, true);
  slow.clear(); // the first run pays for the compiler
  if (!desk.before) throw new Error("the design as written is refused");
  const followed = data.loops.filter((name) => desk.before.loops[name].figures);
  if (!followed.includes(desk.shown)) desk.shown = followed[followed.length - 1];
  find(".tabs").append(...followed.map((name) => button(LOOP_NAMES[name], () => choose(name), { dataset: { loop: name } })));
  watchMap();
  holdCurves();
  chart("bode").addEventListener("keydown", (/** @type {any} */ event) => {
    const by = { PageUp: 0.5, PageDown: -0.5 }[event.key];
    if (!by || !event.target.matches(".plots")) return;
    event.preventDefault();
    stepGain(by);
  });
  chart("linear-limit").addEventListener("chart:click", (/** @type {any} */ { detail }) => { forget("record"); playSine(detail.x, detail.y); });
  runKeys();
  playStart();
  runStart();
  limitsStart();
  choose(desk.shown);
  const acts = {
    undo, redo, reset, pin, unpin, restore,
    save, patch: savePatch, file: () => sheet(changedText()), link: () => sheet((location.protocol === "file:" ? location.pathname.split("/").pop() : location.href.split("#")[0]) + fragment()),
    copy, close: () => { find(".sheet").hidden = true; },
  };
  root.addEventListener("click", (/** @type {any} */ event) => {
    const { do: act, letter } = event.target.closest("[data-do]")?.dataset ?? {};
    if (act) acts[act](letter);
  });
  root.addEventListener("keydown", (/** @type {any} */ event) => {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches("textarea, .field")) return;
    const does = { z: acts.undo, Z: acts.redo, y: acts.redo }[event.key];
    if (!does) return;
    does();
    event.preventDefault();
  });
  find('input[type="file"]').addEventListener("change", (event) => { if (event.target.files[0]) take(event.target.files[0]); });
  addEventListener("dragover", (event) => { if ([...event.dataTransfer.types].includes("Files")) event.preventDefault(); });
  addEventListener("drop", (event) => {
    const [file] = event.dataTransfer.files;
    if (!file) return;
    event.preventDefault();
    take(file);
  });
  addEventListener("hashchange", fromFragment);
  fromFragment();
  setTimeout(() => { root.dataset.ready = "1"; }, 0);
};
if (typeof WebAssembly === "object") {
  const bytes = Uint8Array.from(atob(document.getElementById("live-module").textContent.trim()), (letter) => letter.charCodeAt(0));
  WebAssembly.instantiate(bytes, {}).then(({ instance }) => {
    load(instance);
    Object.assign(desk, { follow: update, leave });
    begin();
  });
}
