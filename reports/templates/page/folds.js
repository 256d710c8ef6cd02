// Folds that open where a link leads, and wide tables that say so.
import { all } from "./words.js";

const unfold = (target) => {
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
};
const follow = () => {
  let name = location.hash.slice(1);
  try { name = decodeURIComponent(name); } catch { /* no text of ours */ }
  if (name) unfold(document.getElementById(name));
};
addEventListener("hashchange", follow);
follow();
if (matchMedia("(max-width: 68rem)").matches) all(".toc details").forEach((d) => (d.open = false));
// paper gets what is open on the screen; a fold left shut is named, and its figures are in report.json
const hint = () => all(".scroll").forEach((box) => {
  const wide = box.scrollWidth > box.clientWidth + 2;
  box.classList.toggle("wide", wide && box.scrollLeft + box.clientWidth < box.scrollWidth - 4);
});
all(".scroll").forEach((box) => box.addEventListener("scroll", hint, { passive: true }));
addEventListener("resize", hint);
document.addEventListener("toggle", hint, true);
hint();
