// Numbers as they are written, and elements of the page.
/** @type {(selector: string, of?: ParentNode) => any[]} */
export const all = (selector, of = document) => [...of.querySelectorAll(selector)];

// an element: its properties, or its class, and what is in it
/** @type {(name: string, own?: string | Record<string, any>, ...inside: any[]) => any} */
export const html = (name, own = {}, ...inside) => {
  const made = document.createElement(name), { dataset, ...rest } = typeof own === "string" ? { className: own } : own;
  Object.assign(made, rest);
  Object.assign(made.dataset, dataset);
  made.append(...inside);
  return made;
};
/** @type {(words: string, run?: () => void, own?: Record<string, any>) => any} */
export const button = (words, run, own) => html("button", { type: "button", onclick: run ?? null, ...own }, words);
// a field or a list with its words before it
export const labelled = (words, ...inside) => html("label", {}, words + " ", ...inside);
// a list to choose from: [value, words]
export const choice = (words, options, value, change) => {
  const list = html("select", { className: "field", ariaLabel: words }, ...options.map(([each, told]) => html("option", { value: each, selected: String(each) === String(value) }, told)));
  list.addEventListener("change", () => change(list.value));
  return labelled(words, list);
};
// what is typed as a number, its unit behind it or not; NaN where it is none
export const typed = (text, unit = "") => {
  const words = text.trim().replaceAll("−", "-"), number = unit && words.endsWith(unit) ? words.slice(0, -unit.length).trim() : words;
  return /^[-+.\d][-+.\de]*$/i.test(number) ? Number(number) : NaN;
};
export const refused = (text, allowed) => `"${text}": ${text.includes(",") ? "a decimal comma; use a decimal point" : allowed}`;
export const heading = (words, side = "left", scope = "col") => html("th", { className: side, scope }, words);
// fills a table anew: its headings, its rows
export const fill = (box, headings, rows) => box.replaceChildren(box.querySelector("caption"), html("thead", {}, html("tr", {}, ...headings)), html("tbody", {}, ...rows));
// opens every fold that holds an element
export const unfold = (target) => {
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
};
// what a colour stands for
export const swatch = (colour, words) => html("span", "map-key", html("i", { style: `background:var(--${colour})` }), words);
export const minus = (text) => text.replace(/-/g, "−");
export const raised = (power) => minus(String(power)).replace(/[−\d]/g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["−0123456789".indexOf(c)]);
const powerOf = (value) => Math.floor(Math.log10(Math.abs(value)));
export const show = (value, digits = 4) => {
  const size = powerOf(value);
  if (value === 0) return "0";
  if (size >= -4 && size < 6) return minus(value.toFixed(Math.max(digits - 1 - Math.max(size, -4), 0)));
  return minus((value / 10 ** size).toFixed(2)) + "×10" + raised(size);
};
export const reading = (value, unit) => (["dB", "deg", "°"].includes(unit) ? minus(value.toFixed(2)) : show(value));
export const digits = (value, count) => {
  const size = powerOf(value);
  if (value === Infinity) return "unlimited";
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  if (size < -4 || size > 6) return minus(value.toExponential(Math.max(count - 1, 0)));
  return minus(value.toFixed(Math.min(Math.max(count - 1 - size, 0), 12)));
};
// an element of an SVG: the SVG on the page says its name space, the scripts name no address
/** @type {(name: string, attributes: Record<string, any>, parent?: Element) => any} */
export const make = (name, attributes, parent) => {
  const made = document.createElementNS(document.querySelector(".plot").namespaceURI, name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  if (parent) parent.append(made);
  return made;
};
// a file that is saved from the page
export const give = (name, content, type = "text/plain") => {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  html("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
};
