// What a run is asked to do, as a function of time; how long that takes.
export const KINDS = { step: "Step", sine: "Sine", ramp: "Ramp", back: "There and back" };

const up = ({ size, rate }) => Math.abs(size) / rate; // how long a ramp to the size takes
/** @type {Record<string, (of: any) => (t: number) => number>} */
const SHAPES = {
  step: ({ size }) => () => size,
  sine: ({ size, hertz }) => (t) => size * Math.sin(2 * Math.PI * hertz * t),
  ramp: (of) => (t) => Math.sign(of.size) * Math.min(of.rate * t, Math.abs(of.size)),
  // out, as long at the end, and back
  back: (of) => (t) => Math.sign(of.size) * Math.min(of.rate * t, Math.abs(of.size), Math.max(0, of.rate * (3 * up(of) - t))),
};
export const commandOf = (of) => SHAPES[of.kind](of);
export const lengthOf = (of, settle) => ({ step: settle, sine: 5 / of.hertz, ramp: up(of) + settle, back: 3 * up(of) + settle })[of.kind];

// stretches of ticks in which a bit is set; those closer than a gap are one
export const spansOf = (flags, bit, gap) => {
  const found = [];
  for (let k = 0; k < flags.length; k++) {
    if (!(flags[k] & bit)) continue;
    const last = found[found.length - 1];
    if (last && k - last[1] <= gap) last[1] = k + 1;
    else found.push([k, k + 1]);
  }
  return found;
};
