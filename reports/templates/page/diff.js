// Two texts as a unified diff, which patch and git apply take.

// lines that both have, in order (the longest such list between equal beginnings and ends), as pairs of numbers
const common = (a, b) => {
  let head = 0, tail = 0;
  while (head < a.length && head < b.length && a[head] === b[head]) head++;
  while (tail < Math.min(a.length, b.length) - head && a[a.length - 1 - tail] === b[b.length - 1 - tail]) tail++;
  const n = a.length - head - tail, m = b.length - head - tail;
  const best = Array.from({ length: n + 1 }, () => new Int32Array(m + 1));
  for (let i = n - 1; i >= 0; i--)
    for (let j = m - 1; j >= 0; j--) best[i][j] = a[head + i] === b[head + j] ? best[i + 1][j + 1] + 1 : Math.max(best[i + 1][j], best[i][j + 1]);
  const pairs = Array.from({ length: head }, (_, k) => [k, k]);
  for (let i = 0, j = 0; i < n && j < m;) {
    if (a[head + i] === b[head + j]) pairs.push([head + i++, head + j++]);
    else if (best[i + 1][j] >= best[i][j + 1]) i++; else j++;
  }
  for (let k = tail; k > 0; k--) pairs.push([a.length - k, b.length - k]);
  return pairs;
};
const AROUND = 3; // lines shown before and behind a change
export const unified = (before, after, name) => {
  const split = (text) => text.match(/[^\n]*\n|[^\n]+$/g) || [], a = split(before), b = split(after), edits = [];
  let i = 0, j = 0;
  for (const [p, q] of [...common(a, b), [a.length, b.length]]) {
    for (; i < p; i++) edits.push(["-", a[i]]);
    for (; j < q; j++) edits.push(["+", b[j]]);
    if (p < a.length) edits.push([" ", a[p]]);
    i = p + 1;
    j = q + 1;
  }
  const kept = edits.map((_, k) => edits.slice(Math.max(0, k - AROUND), k + AROUND + 1).some(([sign]) => sign !== " "));
  let text = "", old = 1, now = 1;
  for (let k = 0; k < edits.length; k++) {
    if (kept[k] && !kept[k - 1]) {
      let end = k;
      while (kept[end]) end++;
      const hunk = edits.slice(k, end), count = (not) => hunk.filter(([sign]) => sign !== not).length;
      const from = (start, size) => `${size ? start : start - 1},${size}`;
      text += `@@ -${from(old, count("+"))} +${from(now, count("-"))} @@\n`;
      for (const [sign, line] of hunk) text += sign + line + (line.endsWith("\n") ? "" : "\n\\ No newline at end of file\n");
    }
    if (edits[k][0] !== "+") old++;
    if (edits[k][0] !== "-") now++;
  }
  return text && `--- a/${name}\n+++ b/${name}\n${text}`;
};
