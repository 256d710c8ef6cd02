// What the page takes of d3: its types, and what make d3 puts into d3.js.
export { bisector, range } from "d3-array";
export { scaleLinear, scaleLog } from "d3-scale";
export { pointer, select } from "d3-selection";
export { zoom, zoomIdentity } from "d3-zoom";
