// Computes loops of rows of parameters in the module and prints their figures and responses.
import { readFileSync } from "node:fs";

const given = JSON.parse(readFileSync(process.argv[3], "utf8"));
const module = new WebAssembly.Module(readFileSync(process.argv[2]));
const x = new WebAssembly.Instance(module, {}).exports;
x._initialize();
const floats = (at, n) => new Float64Array(x.memory.buffer, at, n);
const plain = (values) => Array.from(values, (value) => (Number.isFinite(value) ? value : String(value)));
const all = [];
for (const row of given.rows) {
  floats(x.p_at(), row.length).set(row.map(Number)); // "Infinity" is a text in JSON
  const found = {};
  for (const [name, stage] of Object.entries(given.stages)) {
    const n = x.loop(stage, 1);
    if (n <= 0) { found[name] = { n }; continue; }
    const figures = plain(floats(x.figures_at(stage), given.quoted));
    const count = given.angles.length;
    floats(x.x_at(), count).set(given.angles);
    x.respond(stage, count);
    const doubtful = x.doubtful(stage);
    found[name] = { n, doubtful, figures, period: x.period_of(stage), response: plain(floats(x.y_at(), 2 * count)) };
  }
  const count = given.angles.length;
  floats(x.x_at(), count).set(given.angles);
  const n = x.limiters(count);
  found.limiters = { n, sizes: n > 0 ? plain(floats(x.y_at(), 6 * count)) : [] };
  all.push(found);
}
process.stdout.write(JSON.stringify({ imports: WebAssembly.Module.imports(module), all }));
