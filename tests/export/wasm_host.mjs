// Instances of the module, a design in each, tick by tick in turns; prints output angle, speed and current of
// each. The last one is saved before tick `keep`, and goes back there twice when all are done.
import { readFileSync } from "node:fs";

const given = JSON.parse(readFileSync(process.argv[3], "utf8"));
const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const imports = WebAssembly.Module.imports(module);

function instance(row) {
  const x = new WebAssembly.Instance(module, {}).exports;
  x._initialize();
  const floats = (at, n) => new Float64Array(x.memory.buffer, at, n);
  floats(x.p_at(), row.length).set(row.map(Number)); // "Infinity" is a text in JSON
  if (!x.start()) throw new Error("too long a state");
  return { x, s: floats(x.s_at(), x.s_most()), io: floats(x.io_at(), x.io_length()) };
}

function ticked({ x, io }, unit, k) {
  io[given.at.command] = unit.command[k];
  io[given.at.moment] = unit.moment[k];
  if (x.tick() !== 0) throw new Error(`tick ${k} failed`);
  return [io[given.at.output], io[given.at.speed], io[given.at.current]];
}

const drives = given.units.map((unit) => instance(unit.row));
const rows = given.units.map(() => []);
const [last, plan, seen] = [drives, given.units, rows].map((each) => each.at(-1));
const ticks = plan.command.length;
let kept = [];
for (let k = 0; k < ticks; k += 1) {
  if (k === given.keep) kept = [last.s.slice(), last.io.slice()];
  drives.forEach((drive, n) => rows[n].push(ticked(drive, given.units[n], k)));
}
const backs = given.keep === undefined ? [] : [0, 1].map(() => {
  last.s.set(kept[0]);
  last.io.set(kept[1]);
  return seen.slice(given.keep).map((_, j) => ticked(last, plan, given.keep + j));
});
process.stdout.write(JSON.stringify({ imports, rows, backs }));
