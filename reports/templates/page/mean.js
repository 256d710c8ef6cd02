// The mean over n samples of the command that limits its jerk.
import { data } from "./desk.js";

const at = data.places;
export const meanAt = (row, turns) => { // gain and phase of the mean over n samples that limits the jerk
  const n = row[at.mean], half = Math.PI * turns;
  return n > 1 ? [Math.sin(n * half) / (n * Math.sin(half)), -half * (n - 1)] : [1, 0];
};
