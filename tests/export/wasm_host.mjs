// Runs the module with a row of parameters and prints output angle, speed and current of every tick.
import { readFileSync } from "node:fs";

const given = JSON.parse(readFileSync(process.argv[3], "utf8"));
const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const imports = WebAssembly.Module.imports(module);
const x = new WebAssembly.Instance(module, {}).exports;
x._initialize();
const floats = (at, n) => new Float64Array(x.memory.buffer, at, n);
floats(x.p_at(), given.row.length).set(given.row.map(Number)); // "Infinity" is a text in JSON
if (!x.start()) throw new Error("too long a state");
const rows = [];
for (let k = 0; k < given.command.length; k += 1) {
  const io = floats(x.io_at(), x.io_length());
  io[given.at.command] = given.command[k];
  io[given.at.moment] = given.moment[k];
  if (x.tick() !== 0) throw new Error(`tick ${k} failed`);
  rows.push([io[given.at.output], io[given.at.speed], io[given.at.current]]);
}
process.stdout.write(JSON.stringify({ imports, rows }));
