// From the pointer to a panel and the place on it, in the units of the picture.
export const placeOf = (picture, event) => {
  const matrix = picture.svg.getScreenCTM();
  if (!matrix) return null;
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
  const panel = picture.panels.find((p) => p.holds(point.x, point.y));
  return panel ? { panel, x: point.x, y: point.y, scale: matrix.a } : null;
};
