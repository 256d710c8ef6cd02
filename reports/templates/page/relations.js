// What a design file is refused for: the checks of the command line, followed statement by statement.
import { data } from "./desk.js";
import { statementOf } from "./row.js";

// a number as printf writes it with the form %g or %.4g
export const general = (value, digits = 6) => {
  if (value === 0 || !Number.isFinite(value)) return String(value).replace("Infinity", "inf");
  const [head, power] = value.toExponential(digits - 1).split("e"), size = Number(power);
  const cut = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (size < -4 || size >= digits) return `${cut(head)}e${size < 0 ? "-" : "+"}${String(Math.abs(size)).padStart(2, "0")}`;
  return cut(value.toFixed(digits - 1 - size));
};
const shown = (words, values) => {
  let at = 0;
  return words.replace(/%(?:(%)|(?:\.(\d+))?g)/g, (_, percent, digits) => percent || general(values[at++], digits ? Number(digits) : 6));
};
// a check as a function of the keys: why it refuses them, or nothing
export const checkOf = (lines) => {
  const steps = lines.map(([kind, target, does, ...terms]) => {
    if (kind === "value" || kind === "branch") return { kind, run: statementOf([kind, target, does, ...terms]) };
    return { kind, words: does, terms: terms.map((term) => statementOf(["value", 0, "", term])) };
  });
  return (k) => {
    const v = [];
    for (let at = 0; at < steps.length; at++) {
      const { kind, run, words, terms } = steps[at];
      if (kind === "value") run(k, v);
      else if (kind === "allowed") return "";
      else if (kind === "refusal") return shown(words, terms.map((term) => { term(k, v); return v[0]; })); // no value has the number 0
      else if (kind === "branch" && run(k, v)) { // as in the design itself: past the branch
        for (let depth = 1; depth > 0;) {
          at++;
          depth += Number(steps[at].kind === "branch") - Number(steps[at].kind === "end");
        }
      }
    }
    return "";
  };
};
const checks = data.relations.map(checkOf);
export const refusalOf = (values) => checks.reduce((found, check) => found || check(values), "");
