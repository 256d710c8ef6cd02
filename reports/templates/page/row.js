// From the keys of the design to the row of the simulator: statements as data (nonlinear.export.statement).
import { data } from "./desk.js";

const number = (value) => (typeof value === "string" ? Number(value.replace("inf", "Infinity")) : value);
const DOES = {
  "+": (a, b) => a + b, "-": (a, b) => (b === undefined ? -a : a - b), "*": (a, b) => a * b, "/": (a, b) => a / b,
  "<": (a, b) => +(a < b), "<=": (a, b) => +(a <= b), ">": (a, b) => +(a > b), ">=": (a, b) => +(a >= b),
  "==": (a, b) => +(a === b), "!=": (a, b) => +(a !== b), "&&": (a, b) => +(a && b), "||": (a, b) => +(a || b),
  pow: Math.pow, tan: Math.tan, sqrt: Math.sqrt, sin: Math.sin, cos: Math.cos, exp: Math.exp, log: Math.log,
  floor: Math.floor, ceil: Math.ceil, fmod: (a, b) => a % b, fabs: Math.abs, zero_below: (a, least) => (Math.abs(a) < least ? 0 : a),
  where: (condition, yes, no) => (condition ? yes : no), "": (a) => a,
};
const term = (told) => {
  const at = /^([kv])\[?(\d+)\]?$/.exec(told);
  if (!at) { const value = number(told); return () => value; }
  const place = +at[2];
  return at[1] === "k" ? (k) => k[place] : (k, v) => v[place];
};
export const statementOf = ([kind, target, does, ...told]) => {
  const run = DOES[does], terms = told.map(term);
  if (!run) throw new Error(`no function ${does}`);
  const of = (k, v) => run(...terms.map((one) => one(k, v)));
  if (kind === "value") return (k, v) => { v[target] = of(k, v); return true; };
  if (kind === "store") return (k, v, p) => { p[target] = of(k, v); return true; };
  return (k, v) => Boolean(of(k, v)) === Boolean(target);
};
const statements = data.lines.map(statementOf);
const base = Float64Array.from(data.row, number);

// null where a condition does not hold: the values need another structure of the drive
export const rowOf = (values) => {
  const p = base.slice(), v = [];
  return statements.every((run) => run(values, v, p)) ? p : null;
};
// a figure of the whole drive: NaN where it has none, null where it needs another structure of the drive
const drive = data.requirements.map((item) => item.lines && item.lines.map(statementOf));
export const driveOf = (values) => drive.map((lines) => {
  const p = [], v = [];
  return lines && lines.every((run) => run(values, v, p)) ? p[0] : null;
});
