// Measured data dropped on the page: columns and units chosen, laid over the model, taken away again.
import { MEASURED, guess, recordOf, responseOf, rolesOf, tableOf } from "./columns.js";
import { designed, unwrapped } from "./curves.js";
import { LOOP_NAMES, data, desk, find, tell } from "./desk.js";
import { start } from "./history.js";
import { compute, respond } from "./module.js";
import { residual, runStart, trial } from "./trial.js";
import { button, choice, digits, html } from "./words.js";

const linear = data.axis === "linear", LARGEST = 5e7; // bytes
const measured = MEASURED[{ output: linear ? "length" : "angle", speed: linear ? "velocity" : "rate", current: "current" }[data.step.of]];
const boxes = {}; // what is laid over, by kind
const lay = {
  record: (made) => {
    desk.record = made;
    compute(start);
    runStart();
  },
  response: (made) => { desk.response = made; },
};
const say = (kind, words) => { boxes[kind].querySelector(".told").textContent = words; };
export const forget = (kind) => {
  boxes[kind]?.remove();
  delete boxes[kind];
  lay[kind](null);
};
const show = (name, table, chosen) => {
  const { kind } = chosen, plain = (list) => list.map((each) => [each, each]);
  const again = () => {
    try {
      lay[kind](kind === "record" ? recordOf(name, table, chosen, measured) : responseOf(name, table, chosen, chosen.of));
    } catch (error) {
      lay[kind](null);
      say(kind, `${name}: ${error.message}.`);
    }
    desk.follow();
  };
  const pick = (words, options, of, part, /** @type {(value: string) => any} */ read = String) => choice(words, options, of[part], (value) => { of[part] = read(value); again(); });
  const box = html("div", "dropped", choice(name, [["record", "record in time"], ["response", "frequency response"]], kind, (other) => { forget(kind); show(name, table, guess(table, measured, other)); }));
  if (kind === "response") box.append(pick("of", [["L", "open loop L"], ["T", "closed loop T"], ["S", "sensitivity S"]], chosen, "of"));
  for (const [role, { words, units, free }] of Object.entries(rolesOf(kind, measured))) {
    const none = free || chosen.columns[role] < 0 ? [[-1, free ? "none" : "choose"]] : [];
    box.append(pick(words, [...none, ...table.head.map((word, k) => [k, word])], chosen.columns, role, Number));
    if (Object.keys(units).length > 1) box.append(pick(`${words} in`, plain([...(chosen.units[role] === "" ? [""] : []), ...Object.keys(units)]), chosen.units, role));
  }
  box.append(button("Remove", () => { forget(kind); desk.follow(); }), " ", html("span", "told"));
  boxes[kind]?.remove();
  boxes[kind] = box;
  find(".record").append(box);
  again();
};
const taken = async (file) => {
  const wrong = find(".record > .wrong");
  try {
    if (file.size > LARGEST) throw new Error("larger than 50 MB");
    const table = tableOf(await file.text());
    wrong.textContent = "";
    show(file.name, table, guess(table, measured));
  } catch (error) {
    wrong.textContent = `${file.name}: ${error.message}.`;
  }
};
let reading = Promise.resolve();
export const take = (file) => { reading = reading.then(() => taken(file)); }; // the last one dropped is the last one read

const leftOut = ({ left }) => (left ? ` ${left} rows without numbers left out.` : "");
// what a record leaves over, as changed and as designed
export const overRun = (part) => {
  const { record } = desk;
  const [now, was] = [part, trial.designed].map((made) => record && made.y?.length && residual(made));
  tell("run", "redraw", { panel: 0, curve: "residual", x: now ? now.x : [], y: now ? now.y : [] });
  if (!now || !was) return;
  const words = ({ rms, fit }) => `${digits(100 * rms, 3)} % rms of the largest command, fit ${digits(fit, 4)} %`;
  say("record", `${record.name}: ${record.time.length} samples.${leftOut(record)} Residual of the model as changed: ${words(now)}; as designed: ${words(was)}.`);
};
// a response over the loop that is shown, whose model the module has just computed, and the difference to it
export const overLoop = () => {
  const { response, shown } = desk, { hertz, re, im, weight } = response ?? { hertz: [], re: [], im: [], weight: [] };
  const put = (figure, panel, curve, y, x = hertz) => tell(figure, "redraw", { panel, curve, x, y, parameter: hertz });
  const top = 0.5 / desk.now.loops[shown].period, below = hertz.filter((f) => f < top).length;
  const model = below ? respond(shown, hertz.slice(0, below)) : null;
  const ratio = model ? model.re.map((a, k) => { // measured over model, as decibels and degrees
    const b = model.im[k], size = a * a + b * b;
    return [10 * Math.log10((re[k] ** 2 + im[k] ** 2) / size), Math.atan2(im[k] * a - re[k] * b, re[k] * a + im[k] * b) * 180 / Math.PI];
  }) : [];
  const phase = hertz.length > 1 ? unwrapped(re, im, hertz) : [], near = designed(shown), at = near.hertz.findIndex((f) => f >= hertz[0]);
  const turns = at >= 0 && phase.length ? 360 * Math.round((near.curves.phase[at] - phase[0]) / 360) : 0;
  put("bode", 0, "measured", re.map((_, k) => 20 * Math.log10(Math.hypot(re[k], im[k]))));
  put("bode", 1, "measured", phase.map((value) => value + turns));
  put("nyquist", 0, "measured", im.map((value, k) => (Math.hypot(1 + re[k], value) < 4 ? value : NaN)), re);
  find('[data-chart="difference"]').hidden = !model;
  if (!response) return;
  if (!model) { say("response", `${response.name}: no frequency below half that of the sampling of the ${LOOP_NAMES[shown].toLowerCase()}, ${digits(top, 4)} Hz.`); return; }
  const sum = weight.slice(0, below).reduce((all, share) => all + share, 0);
  const told = ["dB", "deg"].map((unit, n) => {
    const list = ratio.map((each) => each[n]), sizes = list.map(Math.abs), most = Math.max(...sizes, 1e-3);
    tell("difference", "axes", { panel: n, x: [hertz[0], Math.max(hertz[below - 1], 1.01 * hertz[0])], y: [-1.1 * most, 1.1 * most] });
    put("difference", n, "measured over model", list, hertz.slice(0, below));
    return `${digits(Math.sqrt(list.reduce((all, value, k) => all + weight[k] * value ** 2, 0) / sum), 3)} ${unit} rms, at most ${digits(most, 3)} at ${digits(hertz[sizes.indexOf(most)] ?? NaN, 3)} Hz`;
  });
  say("response", `${response.name}: ${hertz.length} points on the ${LOOP_NAMES[shown].toLowerCase()}.${leftOut(response)} Measured over model as changed${response.known ? ", weighted by coherence" : ""}: ${told.join("; ")}.${below < hertz.length ? ` ${hertz.length - below} above half the sampling frequency are not compared.` : ""}`);
};
