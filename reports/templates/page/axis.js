// An axis of a panel: what it is said to be in the SVG, values to places on it, and what of it is seen.
import { range, scaleLinear, scaleLog, zoomIdentity } from "./d3.js";
import { raised, reading, show } from "./words.js";

const TURN = [15, 30, 45, 90, 180, 360, 720, 1440, 2880]; // a phase is read in parts of a turn
const decade = (value) => (value >= 1e6 && value < 1e9 ? value / 1e6 + "M" : value >= 1e3 && value < 1e9 ? value / 1e3 + "k" : value >= 1e-4 ? String(+value.toPrecision(6)) : Math.log10(value) % 1 ? show(value) : "10" + raised(Math.log10(value)));

export class Axis {
  view = zoomIdentity; // a place p is seen at k p + x
  /** @type {any} */
  drawn = null; // the ends that the SVG has, once they are others
  constructor(words, label, fixed) {
    const [kind, ...ends] = words.split(" "), [low, high, from, to] = ends.map(Number);
    this.log = kind === "log";
    this.days = kind === "days"; // since 1970
    this.px = (this.log ? scaleLog() : scaleLinear()).domain([low, high]).range([from, to]).unknown(NaN);
    this.first = Math.min(from, to);
    this.last = Math.max(from, to);
    const cut = label.lastIndexOf(", ");
    this.name = cut < 0 ? label : label.slice(0, cut);
    this.unit = cut < 0 ? "" : label.slice(cut + 2).split(" (")[0];
    this.fixed = fixed && this.unit !== "deg";
  }
  value(px) { return this.px.invert(px); }
  seen(px) { return this.view.applyX(px); }
  back(px) { return this.view.invertX(px); }
  holds(px, slack = 3) { return px >= this.first - slack && px <= this.last + slack; }
  get middle() { return (this.first + this.last) / 2; }
  get whole() { return this.view.k === 1 && this.view.x === 0; }
  rescale(ends = this.px.domain()) {
    this.drawn ??= this.px.domain();
    this.px.domain(ends);
  }
  // how what the SVG has goes to its place on the ends of now: scale and shift
  get moved() {
    const [low, high] = (this.drawn ?? this.px.domain()).map((end) => this.px(end)), [from, to] = this.px.range(), scale = (high - low) / (to - from);
    return [scale, low - scale * from];
  }
  // places and words of the ticks that are seen
  ticks(space, least) {
    const seen = this.view.rescaleX(this.px), count = Math.max(least, Math.floor((this.last - this.first) / space));
    const [low, high] = seen.domain().sort((a, b) => a - b), most = Math.max(-low, high), turn = TURN.find((step) => (high - low) / step <= count);
    const values = turn && !this.log && this.unit === "deg" && high - low >= 60 ? range(Math.ceil(low / turn) * turn, high + 1e-9 * turn, turn) : seen.ticks(count);
    const plain = most >= 1e6 || most < 1e-3 ? show : seen.tickFormat(count, "f"), words = this.log ? seen.tickFormat(count, /** @type {any} */ (decade)) : (value) => (value ? plain(value) : "0");
    return values.map((value) => [seen(value), words(value)]).filter(([, text]) => text);
  }
  // seconds in its unit, of an axis of time
  get seconds() { return this.name === "time" ? { s: 1, ms: 1e-3, "µs": 1e-6 }[this.unit] : undefined; }
  words(value) {
    if (this.days) return new Date(Math.round(value * 1440) * 6e4).toISOString().slice(0, 10);
    return reading(value, this.unit) + (this.unit ? " " + this.unit : "");
  }
}
