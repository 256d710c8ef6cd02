// Playback of a run: motor, shaft or spring, and load, drawn as they stand at a time.
import { chart, colourOf, data, find, tell } from "./desk.js";
import { unitOf } from "./trial.js";
import { button, digits, html, make } from "./words.js";

const LASTS = 4000, TURN = 60, SHIFT = 42; // ms of a playback; degrees, and widths, at which the farthest place is drawn
const elastic = [...data.keys, ...data.fixed].some(({ path }) => path === "coupling.stiffness"), linear = data.axis === "linear";
const [angle, length, small, fine] = linear ? ["mm", 1e-3, "µm", 1e-6] : ["deg", Math.PI / 180, "deg", Math.PI / 180];
let part = null, share = 0, last = 0, frame = 0, farthest = 1, widest = 1;
/** @type {any} */
const on = {};
const largest = (list) => list.reduce((most, value) => Math.max(most, Math.abs(value)), 0) || 1;
const twistAt = (k) => part.angle[k] / part.ratio - part.output[k];
const between = (end, lean) => { // shaft or spring, from the motor to where the load stands
  if (!elastic) return `M106 56H${end}M106 64H${end}`;
  const turns = [...Array(9).keys()].map((n) => `L${118 + (end - 130) * (n + 0.5) / 9} ${60 - lean + 2 * lean * (n + 0.5) / 9 + (n % 2 ? 9 : -9)}`);
  return `M106 60L118 ${60 - lean}${turns.join("")}L${end - 12} ${60 + lean}L${end} 60`;
};
const draw = () => {
  const count = part?.output?.length;
  if (!count) return;
  const k = Math.round(share * (count - 1)), [unit, words] = unitOf(), flags = part.flags[k], out = part.output[k] / farthest;
  const acting = data.limiters.filter(([, bit]) => flags & bit), sticks = flags & data.places.stick;
  on.rotor.setAttribute("transform", `rotate(${-TURN * part.angle[k] / part.ratio / farthest} 70 60)`);
  on.load.setAttribute("transform", linear ? `translate(${SHIFT * out} 0)` : `rotate(${-TURN * out} 300 60)`);
  on.shaft.setAttribute("d", between(linear ? 258 + SHIFT * out : 264, 16 * twistAt(k) / widest));
  on.motor.style.stroke = `var(--${acting.length ? colourOf(acting[0][0]) : "ink"})`;
  on.motor.style.strokeDasharray = sticks ? "4 3" : "";
  on.range.value = 1000 * share;
  const said = `${digits(k * part.T * unit, 3)} ${words}: output ${digits(part.output[k] / length, 3)} ${angle}`;
  on.range.ariaValueText = said;
  on.words.textContent = [said, ...(sticks ? ["motor sticks"] : []), ...acting.map(([, , limit]) => limit)].join(", ");
};
const end = () => (part?.output?.length ? (part.output.length - 1) * part.T * unitOf()[0] : 0);
const seek = (to) => {
  share = to;
  draw();
  if (end()) tell("run", "cursor", { x: share * end() });
};
const step = (now) => {
  if (!last) return;
  seek(Math.min(1, share + Math.max(now - last, 0) / LASTS));
  going(share < 1 ? now : 0);
};
const going = (since) => {
  last = since;
  on.play.textContent = last ? "Pause" : "Play";
  cancelAnimationFrame(frame); // of a playback that was paused within it
  if (last) frame = requestAnimationFrame(step);
};
// another run is there
export const follow = (made) => {
  part = made;
  if (!part.output?.length) return;
  farthest = largest(part.output);
  widest = largest(part.output.map((_, k) => twistAt(k)));
  const spring = elastic ? `; spring: at most ${digits(widest / fine, 2)} ${small}` : "";
  on.scale.textContent = `Drawn with ${digits(farthest / length, 3)} ${angle} as ${linear ? "the end of the rail" : `${TURN} deg`}, the motor over the ratio${spring}.`;
  draw();
};
export const playStart = () => {
  const svg = make("svg", { viewBox: "0 0 370 120", role: "img", "aria-label": "The drive at a time of the run: motor, shaft, load" });
  const add = (name, attributes) => make(name, { class: "body", ...attributes }, svg);
  on.play = button("Play", () => {
    if (share === 1) share = 0;
    going(last ? 0 : performance.now());
  });
  on.range = html("input", { type: "range", min: 0, max: 1000, step: 1, ariaLabel: "Time of the run", oninput: () => { going(0); seek(on.range.value / 1000); } });
  on.words = html("span", "note");
  on.scale = html("p", "note");
  on.motor = add("circle", { cx: 70, cy: 60, r: 36 });
  on.rotor = add("path", { d: "M70 60V28M62 36L70 28L78 36" });
  on.shaft = add("path", {});
  if (linear) add("path", { d: "M200 92H366" });
  on.load = add("path", { d: linear ? "M258 34H318V92H258Z" : "M300 96A36 36 0 1 1 300.1 96ZM288 60L300 4L312 60Z" });
  [["motor", 70], [elastic ? "spring" : "shaft", 185], ["load", 300]].forEach(([words, x]) => { make("text", { x, y: 114, "text-anchor": "middle" }, svg).textContent = String(words); });
  find(".playback").append(svg, html("p", "play-keys", on.play, on.range, on.words), on.scale);
  // pointed at in the run's figure, the drive stands as it stood then
  chart("run").addEventListener("chart:at", (/** @type {any} */ { detail }) => {
    if (detail.x === undefined || last || !end()) return;
    share = Math.min(1, Math.max(0, detail.x / end()));
    draw();
  });
};
