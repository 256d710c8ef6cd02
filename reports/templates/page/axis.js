// An axis of a panel: what it is said to be in the SVG, values to places on it, and what of it is seen.
import { degreeTicks, linearTicks, logTicks } from "./ticks.js";
import { reading } from "./words.js";

export class Axis {
  low = 0; // ends of the axis, and their places
  high = 1;
  from = 0;
  to = 1;
  scale = 1; // the view: a place p is seen at scale p + shift
  shift = 0;
  first = 0;
  last = 1;
  /** @type {any} */
  drawn = null; // the ends that the SVG has, once they are others
  constructor(words, label, fixed) {
    const [kind, ...ends] = words.split(" ");
    this.log = kind === "log";
    this.days = kind === "days"; // since 1970
    [this.low, this.high, this.from, this.to] = ends.map(Number);
    this.first = Math.min(this.from, this.to);
    this.last = Math.max(this.from, this.to);
    const cut = label.lastIndexOf(", ");
    this.name = cut < 0 ? label : label.slice(0, cut);
    this.unit = cut < 0 ? "" : label.slice(cut + 2).split(" (")[0];
    this.fixed = fixed && this.unit !== "deg";
  }
  px(value) {
    const part = this.log ? Math.log(value / this.low) / Math.log(this.high / this.low) : (value - this.low) / (this.high - this.low);
    return this.from + part * (this.to - this.from);
  }
  value(px) {
    const part = (px - this.from) / (this.to - this.from);
    return this.log ? this.low * (this.high / this.low) ** part : this.low + part * (this.high - this.low);
  }
  seen(px) { return this.scale * px + this.shift; }
  back(px) { return (px - this.shift) / this.scale; }
  holds(px, slack = 3) { return px >= this.first - slack && px <= this.last + slack; }
  get middle() { return (this.first + this.last) / 2; }
  get whole() { return this.scale === 1 && this.shift === 0; }
  view(scale = 1, shift = 0) { [this.scale, this.shift] = [scale, shift]; }
  // zooms about a place, and moves on
  move(px, factor, by) { this.view(this.scale * factor, px - factor * (px - this.shift) + by); }
  rescale([low, high]) {
    this.drawn ??= [this.low, this.high];
    [this.low, this.high] = [low, high];
  }
  // how what the SVG has goes to its place on the ends of now: scale and shift
  get moved() {
    const [low, high] = (this.drawn ?? [this.low, this.high]).map((end) => this.px(end)), scale = (high - low) / (this.to - this.from);
    return [scale, low - scale * this.from];
  }
  // places and words of the ticks that are seen
  ticks(space, least) {
    const [low, high] = [this.from, this.to].map((end) => this.value(this.back(end))).sort((a, b) => a - b);
    const list = this.log ? logTicks : this.unit === "deg" ? degreeTicks : linearTicks;
    return list(low, high, Math.max(least, Math.floor((this.last - this.first) / space))).map(([value, words]) => [this.seen(this.px(value)), words]);
  }
  // seconds in its unit, of an axis of time
  get seconds() { return this.name === "time" ? { s: 1, ms: 1e-3, "µs": 1e-6 }[this.unit] : undefined; }
  words(value) {
    if (this.days) return new Date(Math.round(value * 1440) * 6e4).toISOString().slice(0, 10);
    return reading(value, this.unit) + (this.unit ? " " + this.unit : "");
  }
}
