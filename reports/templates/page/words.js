// Numbers as they are written, and elements of the page.
/** @type {(selector: string, of?: ParentNode) => any[]} */
export const all = (selector, of = document) => [...of.querySelectorAll(selector)];

/** @type {(name: string, className?: string, text?: string) => any} */
export const html = (name, className, text) => {
  const made = document.createElement(name);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
};
export const heading = (words, side = "left", scope = "col") => Object.assign(html("th", side, words), { scope });
// fills a table anew: its headings, its rows
export const fill = (box, headings, rows) => {
  const head = html("thead"), top = html("tr"), body = html("tbody");
  top.append(...headings);
  head.append(top);
  body.append(...rows);
  box.replaceChildren(box.querySelector("caption"), head, body);
};
// opens every fold that holds an element
export const unfold = (target) => {
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
};
export const minus = (text) => text.replace(/-/g, "−");
export const raised = (power) => minus(String(power)).replace(/[−\d]/g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["−0123456789".indexOf(c)]);
export const show = (value, digits = 4) => {
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
  if (size >= -4 && size < 6) return minus(value.toFixed(Math.max(digits - 1 - Math.max(size, -4), 0)));
  return minus((value / 10 ** size).toFixed(2)) + "×10" + raised(size);
};
export const reading = (value, unit) => (unit === "dB" || unit === "deg" || unit === "°" ? minus(value.toFixed(2)) : show(value));
export const digits = (value, count) => {
  if (value === Infinity) return "unlimited";
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.floor(Math.log10(Math.abs(value)));
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
  const link = html("a"), address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
};
