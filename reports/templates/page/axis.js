// An axis of a panel: what it is said to be in the SVG, and values to places on it.
import { reading } from "./words.js";

export class Axis {
  low = 0; // ends of the axis, and their places
  high = 1;
  from = 0;
  to = 1;
  constructor(words, label, fixed) {
    const [kind, ...ends] = words.split(" ");
    this.log = kind === "log";
    this.days = kind === "days"; // since 1970
    [this.low, this.high, this.from, this.to] = ends.map(Number);
    this.fixed = fixed;
    const cut = label.lastIndexOf(", ");
    this.name = cut < 0 ? label : label.slice(0, cut);
    this.unit = cut < 0 ? "" : label.slice(cut + 2).split(" (")[0];
  }
  px(value) {
    const part = this.log ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
    return this.from + part * (this.to - this.from);
  }
  value(px) {
    const part = (px - this.from) / (this.to - this.from);
    return this.log ? this.low * (this.high / this.low) ** part : this.low + part * (this.high - this.low);
  }
  // seconds in its unit, of an axis of time
  get seconds() { return this.name === "time" ? { s: 1, ms: 1e-3, "µs": 1e-6 }[this.unit] : undefined; }
  words(value) {
    if (this.days) return new Date(Math.round(value * 1440) * 6e4).toISOString().slice(0, 10);
    return reading(value, this.unit) + (this.unit ? " " + this.unit : "");
  }
}
