// Folds that open where a link leads, and wide tables that say so.
import { all, unfold } from "./words.js";

const open = (target) => {
  unfold(target);
  const own = target?.querySelector(":scope > details");
  if (own) own.open = true;
};
const follow = () => {
  let name = location.hash.slice(1);
  try { name = decodeURIComponent(name); } catch { /* no text of ours */ }
  if (name) open(document.getElementById(name));
};
addEventListener("hashchange", follow);
// a link to where one is already is no change of the address
document.addEventListener("click", (event) => {
  const link = event.target instanceof Element && event.target.closest('a[href^="#"]');
  if (link) open(document.getElementById(decodeURIComponent(link.getAttribute("href").slice(1))));
});
follow();
if (matchMedia("(max-width: 68rem)").matches) all(".toc details").forEach((d) => (d.open = false));
// paper gets what is open on the screen (a fold left shut is one line), or the summary, or everything
for (const button of all("[data-print]")) {
  button.parentElement.hidden = false;
  button.addEventListener("click", () => {
    const folds = all("main details"), was = folds.map((fold) => fold.open);
    for (const fold of folds) fold.open = button.dataset.print === "all";
    addEventListener("afterprint", () => folds.forEach((fold, k) => { fold.open = was[k]; }), { once: true });
    print();
  });
}
const hint = () => all(".scroll").forEach((box) => {
  const wide = box.scrollWidth > box.clientWidth + 2;
  box.classList.toggle("wide", wide && box.scrollLeft + box.clientWidth < box.scrollWidth - 4);
});
all(".scroll").forEach((box) => box.addEventListener("scroll", hint, { passive: true }));
addEventListener("resize", hint);
document.addEventListener("toggle", hint, true);
hint();
