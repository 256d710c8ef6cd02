// Pure parts of the page's scripts, by node's own runner: make page.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

const row = { lines: [], relations: [], row: [0, "inf", 2], requirements: [], loops: ["current"], quantities: [], places: {}, stages: {} };
const page = { "live-data": { textContent: JSON.stringify(row) }, "hands-on": {} };
globalThis.document = { getElementById: (name) => page[name] ?? null };

const { Axis } = await import("../../reports/templates/page/axis.js");
const { MEASURED, fitOf, guess, recordOf, responseOf, tableOf } = await import("../../reports/templates/page/columns.js");
const { commandOf, lengthOf, spansOf } = await import("../../reports/templates/page/commands.js");
const { unified } = await import("../../reports/templates/page/diff.js");
const { checkOf, general } = await import("../../reports/templates/page/relations.js");
const { rowOf, statementOf } = await import("../../reports/templates/page/row.js");
const { digits, refused, show, typed } = await import("../../reports/templates/page/words.js");

const near = (found, wanted) => assert.ok(Math.abs(found - wanted) <= 1e-12 * Math.max(1, Math.abs(wanted)), `${found} for ${wanted}`);

test("an axis goes from value to place and back", () => {
  for (const words of ["log 0.1 1000 40 400", "lin -3 5 400 40"]) {
    const axis = new Axis(words, "frequency, Hz");
    assert.deepEqual([axis.name, axis.unit], ["frequency", "Hz"]);
    for (const value of [0.1, 0.7, 3]) near(axis.value(axis.px(value)), value);
  }
  near(new Axis("log 1 100 0 200", "f").px(10), 100); // halfway on a logarithmic axis
});

test("ticks lie where their words say, a phase's in parts of a turn, few enough to be read", () => {
  for (const [words, label, space, told] of [
    ["log 0.5 2000 0 400", "f, Hz", 100, "1 10 100 1k"], ["log 3 60 0 400", "f, Hz", 60, "3 4 5 10 20 30 40 50"], ["lin 0 1 0 400", "part", 80, "0 0.2 0.4 0.6 0.8 1.0"],
    ["lin -37.2 91 400 0", "x", 80, "−20 0 20 40 60 80"], ["lin -540 0 400 0", "phase, deg", 50, "−540 −450 −360 −270 −180 −90 0"],
    ["lin -190 -90 0 400", "phase, deg", 80, "−180 −150 −120 −90"], ["log 5e-5 159 222 0", "amplitude, deg", 36, "0.0001 0.001 0.01 0.1 1 10 100"], ["lin 2e7 4e7 0 400", "x", 200, "2.00×10⁷ 2.50×10⁷ 3.00×10⁷ 3.50×10⁷ 4.00×10⁷"],
  ]) {
    const axis = new Axis(words, label), found = axis.ticks(space, 3);
    assert.equal(found.map(([, text]) => text).join(" "), told);
    for (const [place, text] of found.filter((one) => /^[\d.−]+$/.test(one[1]))) near(place, axis.px(Number(text.replace("−", "-"))));
  }
});

test("numbers keep their digits and their sign", () => {
  assert.equal(digits(-0.0123456, 4), "−0.01235");
  assert.equal(digits(Infinity, 4), "unlimited");
  assert.equal(digits(NaN, 4), "–");
  assert.equal(show(1.5e8), "1.50×10⁸");
});

test("what is typed is a number with a decimal point, as on the command line", () => {
  assert.deepEqual(["6.5", " −2 ", "1e3", "6,000", "6,5", "", "0x20", "−5e−3"].map((text) => typed(text)), [6.5, -2, 1000, NaN, NaN, NaN, NaN, -0.005]);
  assert.deepEqual(["5 1/s", "5", "5 A", "1/s"].map((text) => typed(text, "1/s")), [5, 5, NaN, NaN]);
  assert.equal(refused("6,000", "a number above 0"), '"6,000": a decimal comma; use a decimal point');
  assert.equal(refused("-1", "a number above 0"), '"-1": a number above 0');
});

test("statements are what they say", () => {
  const k = [3, 4], cases = [
    ["+", ["k[0]", "k[1]"], 7], ["-", ["k[0]"], -3], ["-", ["k[0]", 5], -2], ["pow", ["k[0]", 2], 9], ["fabs", [-2], 2],
    ["where", ["v1", "k[0]", "k[1]"], 4], ["zero_below", ["k[0]", 3.5], 0], ["", ["inf"], Infinity], ["/", ["k[0]", "k[1]"], 0.75],
    ["<", ["k[0]", "k[1]"], 1], ["&&", ["k[0]", 0], 0], ["floor", [2.7], 2],
  ];
  for (const [does, terms, wanted] of cases) {
    const p = [], v = [0, 0];
    assert.equal(statementOf(["store", 2, does, ...terms])(k, v, p), true);
    assert.equal(p[2], wanted, does);
  }
  assert.equal(statementOf(["condition", 1, ">", "k[0]", "k[1]"])(k, [], []), false);
  assert.equal(statementOf(["condition", 0, ">", "k[0]", "k[1]"])(k, [], []), true);
  assert.throws(() => statementOf(["value", 1, "system", 1]), /no function/);
  assert.deepEqual([...rowOf([])], [0, Infinity, 2]);
});

const read = (text, changed = {}, of = undefined) => {
  const table = tableOf(text), found = guess(table, MEASURED.angle, changed.kind), choice = { ...found, columns: { ...found.columns, ...changed.columns }, units: { ...found.units, ...changed.units } };
  return found.kind === "record" ? recordOf("a", table, choice, MEASURED.angle) : responseOf("a", table, choice, of);
};
test("rows of one frequency are repeats: their mean, as on the command line; a copy counts once", () => {
  const found = read("f_Hz,re,im\n2,3,0\n1,1,0\n1,3,2\n1,3,2\n");
  assert.deepEqual([found.hertz, found.re, found.im], [[1, 2], [2, 3], [1, 0]]);
  assert.throws(() => read("f_Hz,re,im\n1,1,0\n1,3,2\n"), /two frequencies/);
});
test("columns are found by name and unit, or as chosen, or refused in words", () => {
  const text = "# bench\ntime_ms;note;angle_deg;command_deg\n10;1;0;0\n20;1;90;180\nx;1;2;3\n", found = read(text);
  assert.deepEqual([found.time, found.left], [[0, 0.01], 1]);
  near(found.angle[1], Math.PI / 2);
  near(found.scale, Math.PI);
  near(read(text, { units: { command: "mrad" }, columns: { command: 1 } }).command[1], 1e-3);
  assert.deepEqual(read("0,1,2\n1,1,2\n").command, [1, 1]);
  assert.deepEqual(read("0;1,5;2\n1;1,5;2\n").command, [1.5, 1.5]);
  for (const [told, words] of [["time,angle\n0,1\n1,2\n", /the command: choose/], ["time,command,angle\n1,0,0\n0,0,0\n", /backwards/], ["time,command,angle\n1,0,0\n1,0,0\n", /still/],
    ["time,command,angle\n1,0,0\n", /two rows/], ["\0PNG", /no text/], ["", /nothing/], ["5\n6\n", /one column/], ["f_Hz,dB,deg\n-1,1,2\n1,1,2\n", /above 0/],
    ["f_Hz,re,phase_deg\n1,1,2\n2,1,2\n", /real part goes/]]) assert.throws(() => read(told), words, told);
});

test("a response in any form is the open loop", () => {
  // the command line reads and refuses the same texts: tests/design/test_controller_files.py
  const shared = JSON.parse(readFileSync(new URL("responses.json", import.meta.url), "utf8"));
  for (const text of shared.refused) assert.throws(() => read(text, { kind: "response" }), Error, text);
  for (const [text, of] of [
    ...shared["read as 3 - 4j at 5 Hz"].map((text) => [text, "L"]),
    ["f,re,im\n5,0.875,-0.125\n1,.5,0\n", "T"], // (3 - 4j) / (4 - 4j)
    ["f,re,im\n5,0.125,0.125\n1,.5,0\n", "S"], // 1 / (4 - 4j)
  ]) {
    const { hertz, re, im } = read(text, { kind: "response" }, of);
    const at = hertz.findIndex((f) => Math.abs(f - 5) < 1e-9);
    assert.ok(hertz[0] < hertz[1]); // in order
    for (const [found, wanted] of [[hertz[at], 5], [re[at], 3], [im[at], -4]]) near(found, wanted);
  }
  const { rms, fit } = fitOf([0, 2, 4], [1, 2, 3]);
  near(rms, Math.sqrt(2 / 3));
  near(fit, 50);
});

test("a check refuses in its words, with the values of then", () => {
  // allowed: k[1] at most twice k[0]; where k[0] is 0, nothing is asked
  const check = checkOf([
    ["branch", 1, "!=", "k[0]", 0], ["allowed", 0, ""], ["end", 0, ""],
    ["value", 1, "*", "k[0]", 2],
    ["branch", 1, "<=", "k[1]", "v1"], ["refusal", 0, "b = %g: allowed: at most %.4g, 100 %% of it", "k[1]", "v1"], ["end", 0, ""],
    ["allowed", 0, ""],
  ]);
  assert.equal(check([1, 2]), "");
  assert.equal(check([0, 5]), "");
  assert.equal(check([1 / 3, 1]), "b = 1: allowed: at most 0.6667, 100 % of it");
});

test("numbers in a refusal are written as by printf", () => {
  for (const [value, count, words] of [[0.00001234, 6, "1.234e-05"], [1234567, 6, "1.23457e+06"], [123456, 6, "123456"], [0.1, 4, "0.1"], [-2.5e300, 4, "-2.5e+300"], [0, 6, "0"], [100, 4, "100"], [9.99999, 4, "10"]]) {
    assert.equal(general(value, count), words);
  }
});

test("a patch makes of the one text the other", () => {
  const lines = [...Array(40).keys()].map((k) => `key${k} = ${k} # why\n`);
  const changed = (at) => lines.map((line, k) => (at.includes(k) ? line.replace("= ", "= 1") : line));
  const texts = [lines.join(""), changed([0]).join(""), changed([39]).join(""), changed([3, 5, 20, 21]).join(""), lines.join("").trimEnd(), ["new = 1\n", ...lines].join(""), lines.filter((_, k) => k % 7).join("")];
  for (const before of texts) for (const after of texts) {
    const patch = unified(before, after, "drive.toml");
    if (before === after) { assert.equal(patch, ""); continue; }
    const folder = mkdtempSync(join(tmpdir(), "patch-")), file = join(folder, "drive.toml");
    writeFileSync(file, before);
    execFileSync("git", ["apply", "-"], { cwd: folder, input: patch, env: { ...process.env, GIT_DIR: join(folder, "none"), GIT_CEILING_DIRECTORIES: folder } });
    assert.equal(readFileSync(file, "utf8"), after);
  }
});

test("commands go where they are told, in the time that is said", () => {
  near(commandOf({ kind: "sine", size: 2, hertz: 5 })(0.05), 2);
  for (const size of [3, -3]) {
    const ramp = commandOf({ kind: "ramp", size, rate: 6 }), back = commandOf({ kind: "back", size, rate: 6 });
    assert.deepEqual([0, 0.25, 0.5, 2].map((t) => ramp(t) + 0), [0, size / 2, size, size]);
    assert.deepEqual([0, 0.25, 0.5, 1, 1.25, 1.5, 9].map((t) => Math.abs(back(t))), [0, 1.5, 3, 3, 1.5, 0, 0]);
    near(lengthOf({ kind: "back", size, rate: 6 }, 0.5), 2);
  }
  assert.deepEqual(spansOf([0, 1, 1, 0, 3, 0, 0, 0, 1], 1, 1), [[1, 5], [8, 9]]);
  assert.deepEqual(spansOf([0, 1, 1, 0, 3], 2, 1), [[4, 5]]);
});
