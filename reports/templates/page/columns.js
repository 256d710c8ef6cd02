// Measured data as columns of a text: a record in time (command, what was measured) or a frequency response.
const TURN = 2 * Math.PI, DEGREE = Math.PI / 180;
// units of a column: SI over each, and how a heading says it; the first where it says none
const TIME = { s: [1], ms: [1e-3, /(_|\b)ms\b/i], "µs": [1e-6, /(_|\b)[uµ]s\b/i] };
export const MEASURED = {
  angle: { rad: [1], deg: [DEGREE, /deg|°/i], mrad: [1e-3, /mrad/i] }, length: { m: [1], mm: [1e-3, /(_|\b)mm\b/i], "µm": [1e-6, /(_|\b)[uµ]m\b/i] },
  rate: { "rad/s": [1], "deg/s": [DEGREE, /deg|°/i], rpm: [TURN / 60, /rpm|1\/min/i] }, velocity: { "m/s": [1], "mm/s": [1e-3, /mm/i] }, current: { A: [1], mA: [1e-3, /(_|\b)mA\b/] },
};
// the columns of each kind of data: its words, how a heading names it, its units; a response's as in analyses/records/response.py
export const rolesOf = (kind, measured) => (kind === "response" ? {
  frequency: { words: "Frequency", like: /^f(req|_|\b)|^(omega|w)(_|\b)|hz\b/i, units: { Hz: [1, /(?<!k)hz/i], "rad/s": [1 / TURN, /rad|^omega|^w(_|\b)/i], kHz: [1e3, /khz/i] } },
  size: { words: "Magnitude", like: /(?<!i)mag|gain|abs|amp|db\b|^re(al)?(_|\b)|[._]re(al)?\b/i, units: { dB: ["dB", /db/i], ratio: ["abs", /abs|ratio|lin|\b1\b|\//i], "real part": ["re", /^re|[._]re/i] } },
  turn: { words: "Phase", like: /phase|^arg|deg\b|^ph(_|\b)|^im(ag)?[a-z]*(_|\b)|[._]im(ag)?\b/i, units: { deg: [DEGREE, /deg|°/i], rad: [1, /rad/i], "imaginary part": ["im", /^im|[._]im/i] } },
  coherence: { words: "Coherence", like: /coh|gamma/i, units: { "1": [1] }, free: true },
} : {
  time: { words: "Time", like: /^t(ime)?(_|\b)|^time/i, units: TIME },
  command: { words: "Command", like: /comm|^cmd|ref|target|demand/i, units: measured },
  measured: { words: "Measured", like: /angle|pos|output|meas|actual|speed|current/i, units: measured },
});

// what a heading leaves open is in the first unit where the numbers say so: dB below 0, degrees beyond a turn; else it is chosen
const OPEN = { size: (value) => value < 0, turn: (value) => Math.abs(value) > TURN };

// headings and rows of numbers; refused where it is no table
export const tableOf = (text) => {
  if (/[\0\ufffd]/.test(text)) throw new Error("no text: a table in text is read, its columns parted by comma, semicolon, tab or space");
  const lines = text.split(/\r?\n/).map((line) => line.trim()).filter((line) => line && !/^[#%]/.test(line));
  if (!lines.length) throw new Error("nothing in it");
  const cut = [";", "\t", ","].find((sign) => lines[0].includes(sign)) ?? /\s+/;
  const fields = lines.map((line) => line.split(cut).map((word) => word.trim().replace(/^"|"$/g, "")));
  const numbers = (row) => row.map((word) => (word === "" ? NaN : Number(cut === ";" ? word.replace(",", ".") : word)));
  const titled = numbers(fields[0]).some(Number.isNaN), rows = fields.slice(titled ? 1 : 0).map(numbers);
  if (fields[0].length < 2) throw new Error("one column only: columns are parted by comma, semicolon, tab or space");
  if (rows.filter((row) => row.some(Number.isFinite)).length < 2) throw new Error("fewer than two rows of numbers");
  return { rows, titled, head: titled ? fields[0] : fields[0].map((_, k) => `column ${k + 1}`) };
};
// which columns are what, by their names or in order (-1: none), and their units; kind is found where none is given
export const guess = ({ head, titled, rows }, measured, kind = undefined) => {
  if (!kind) kind = titled && head.some((word) => rolesOf("response").frequency.like.test(word)) && !head.some((word) => rolesOf("record").time.like.test(word)) ? "response" : "record";
  const roles = Object.entries(rolesOf(kind, measured)), columns = {}, units = {};
  roles.forEach(([role, { like, units: known }], k) => {
    const taken = Object.values(columns);
    columns[role] = titled ? head.findIndex((word, at) => !taken.includes(at) && like.test(word)) : k < head.length ? k : -1;
    const open = titled && columns[role] >= 0 && OPEN[role] && !rows.some((row) => OPEN[role](row[columns[role]]));
    units[role] = Object.keys(known).find((unit) => titled && known[unit][1]?.test(head[columns[role]] ?? "")) ?? (open ? "" : Object.keys(known)[0]);
  });
  return { kind, columns, units };
};
// rows whose chosen columns are numbers, by role, and the factor or form of each unit
const taken = ({ rows }, { kind, columns, units }, measured) => {
  const roles = rolesOf(kind, measured), wanted = Object.keys(roles).filter((role) => columns[role] >= 0);
  const missing = Object.keys(roles).find((role) => columns[role] < 0 && !roles[role].free);
  if (missing) throw new Error(`no column for the ${roles[missing].words.toLowerCase()}: choose one`);
  const unsaid = wanted.find((role) => !(units[role] in roles[role].units));
  if (unsaid) throw new Error(`the heading of the ${roles[unsaid].words.toLowerCase()} says no unit: choose one`);
  const good = rows.filter((row) => wanted.every((role) => Number.isFinite(row[columns[role]]) && (!["coherence", "frequency"].includes(role) || row[columns[role]] !== 0)));
  if (good.length < 2) throw new Error("fewer than two rows of numbers");
  return { good, list: (role) => good.map((row) => row[columns[role]]), unit: (role) => roles[role].units[units[role]][0], left: rows.length - good.length };
};
export const recordOf = (name, table, choice, measured) => {
  const { list, unit, left } = taken(table, choice, measured), clock = list("time"), scaled = (role) => list(role).map((value) => value * unit(role));
  const time = clock.map((t) => (t - clock[0]) * unit("time"));
  if (time.some((t, k) => k && t < time[k - 1])) throw new Error("time runs backwards");
  if (!(time[time.length - 1] > 0)) throw new Error("time stands still");
  const command = scaled("command"), scale = command.reduce((most, value) => Math.max(most, Math.abs(value)), 0) || 1;
  return { name, time, command, angle: scaled("measured"), scale, left };
};
// of is what was measured: the open loop L, the closed loop T or the sensitivity S; each is turned into L
export const responseOf = (name, table, choice, of = "L") => {
  const { good, list, unit, left } = taken(table, choice), order = [...good.keys()], size = list("size"), turn = list("turn"), known = choice.columns.coherence >= 0;
  const hertz = list("frequency").map((f) => f * unit("frequency")), weight = known ? list("coherence") : good.map(() => 1);
  if (hertz.some((f) => !(f > 0))) throw new Error("a frequency that is not above 0");
  if (weight.some((share) => share < 0 || share > 1)) throw new Error("a coherence outside 0 to 1");
  const parts = unit("size") === "re";
  if (parts !== (unit("turn") === "im")) throw new Error("a real part goes with an imaginary part, a magnitude with a phase");
  const at = new Map(); // by frequency; rows of one frequency are repeats, a copy of a row is none
  for (const k of order.sort((a, b) => hertz[a] - hertz[b])) {
    const gain = unit("size") === "dB" ? 10 ** (size[k] / 20) : size[k], angle = turn[k] * unit("turn");
    const [re, im] = parts ? [size[k], turn[k]] : [gain * Math.cos(angle), gain * Math.sin(angle)];
    if (!Number.isFinite(re + im) || !(re || im)) throw new Error("a value that is 0 or beyond the range of numbers");
    const there = at.get(hertz[k]) ?? at.set(hertz[k], []).get(hertz[k]);
    if (!there.some((one) => one[0] === re && one[1] === im)) there.push([re, im, weight[k]]);
  }
  if (at.size < 2) throw new Error(`every row is at ${hertz[0]} Hz: two frequencies or more are needed`);
  const means = [...at.values()].map((each) => [0, 1, 2].map((part) => each.reduce((sum, one) => sum + one[part], 0) / each.length));
  const points = means.map(([re, im]) => {
    const far = of === "T" ? (1 - re) ** 2 + im ** 2 : re * re + im * im;
    if (of === "T") return [(re - re * re - im * im) / far, im / far]; // T / (1 - T)
    return of === "S" ? [re / far - 1, -im / far] : [re, im]; // 1 / S - 1
  });
  return { name, hertz: [...at.keys()], re: points.map(([re]) => re), im: points.map(([, im]) => im), weight: means.map(([, , share]) => share), known, left };
};
// rms of what a model leaves over, and its fit: 100 (1 - |y - model| / |y - mean of y|) per cent
export const fitOf = (measured, model) => {
  const mean = measured.reduce((sum, value) => sum + value, 0) / measured.length, norm = (list) => Math.sqrt(list.reduce((sum, value) => sum + value * value, 0));
  const rest = norm(measured.map((value, k) => value - model[k]));
  return { rms: rest / Math.sqrt(measured.length), fit: 100 * (1 - rest / norm(measured.map((value) => value - mean))) };
};
