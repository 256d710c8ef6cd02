// Columns of a measured record: time, command, and what was measured.
const MEASURED = /angle|pos|output|meas|actual|speed|current/i;

// columns are found by their names, or taken in order; time in s, angles in rad, lengths in m
export const recordOf = (name, text) => {
  const lines = text.split(/\r?\n/).map((line) => line.trim()).filter((line) => line && !line.startsWith("#"));
  const cut = lines[0].includes(";") ? ";" : lines[0].includes("\t") ? "\t" : ",";
  const head = lines[0].split(cut).map((word) => word.trim().replace(/^"|"$/g, ""));
  const titled = head.some((word) => Number.isNaN(Number(word)));
  const column = (pattern, otherwise) => (titled ? head.findIndex((word) => pattern.test(word)) : otherwise);
  const at = [column(/^t(ime)?\b|^time/i, 0), column(/comm|^cmd|ref|target|demand/i, 1), column(MEASURED, 2)];
  if (at[0] < 0 || at[1] < 0) throw new Error("no column for time, or none for the command");
  if (at[2] < 0 || at[2] === at[1]) at[2] = head.findIndex((word, k) => k !== at[0] && k !== at[1] && MEASURED.test(word));
  if (at[2] < 0) throw new Error("no column for the angle");
  const factor = (k) => (titled && /deg|°/i.test(head[k]) ? Math.PI / 180 : titled && /(_|\b)mm\b|_mm/i.test(head[k]) ? 1e-3 : 1);
  const inTime = titled && /(_|\b)ms\b|_ms/i.test(head[at[0]]) ? 1e-3 : 1;
  const table = lines.slice(titled ? 1 : 0).map((line) => line.split(cut).map(Number)).filter((row) => at.every((k) => Number.isFinite(row[k])));
  if (table.length < 2) throw new Error("fewer than two rows of numbers");
  const first = table[0][at[0]], time = table.map((row) => (row[at[0]] - first) * inTime);
  if (time.some((t, k) => k && t < time[k - 1])) throw new Error("time runs backwards");
  const command = table.map((row) => row[at[1]] * factor(at[1])), angle = table.map((row) => row[at[2]] * factor(at[2]));
  const scale = command.reduce((most, value) => Math.max(most, Math.abs(value)), 0) || 1;
  return { name, time, command, angle, scale, low: [...command, ...angle].reduce((least, value) => Math.min(least, value), 0) / scale };
};
