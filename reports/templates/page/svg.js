// Elements of an SVG: the SVG on the page says its name space, the scripts name no address.
/** @type {(name: string, attributes: Record<string, any>, parent?: Element) => any} */
export const make = (name, attributes, parent) => {
  const made = document.createElementNS(document.querySelector(".plot").namespaceURI, name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  if (parent) parent.append(made);
  return made;
};
