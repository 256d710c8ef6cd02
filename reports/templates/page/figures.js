// Every figure of the page is made to live, and a row of a table that names a crossing shows it there.
import { Chart, closest } from "./chart.js";
import { all, button, unfold } from "./words.js";

const charts = all(".chart").map((root) => new Chart(root));
// one cursor through all figures of a loop
for (const one of charts) if (one.loop) one.root.addEventListener("chart:at", (/** @type {any} */ { detail }) => {
  for (const other of charts) if (other !== one && other.loop === one.loop) other.show({ hertz: detail.hertz });
});
// a click on a night of a trend opens its report, or leads to its line where that is kept no more
const nights = all("tr[data-night]"), days = nights.map((row) => Date.parse(row.dataset.night) / 864e5);
for (const one of charts) if (nights.length && one.panels[0]?.x.days) one.root.addEventListener("chart:click", (/** @type {any} */ { detail }) => {
  const row = nights[closest(days, detail.x)], link = row.querySelector("a");
  if (link) link.click(); else row.scrollIntoView({ block: "center" });
});
for (const row of all("tr[data-loop][data-hz]")) {
  const own = charts.filter((c) => c.loop === row.dataset.loop && c.panels.some((p) => p.x.log && p.x.unit === "Hz"));
  if (!own.length) continue;
  let kept = false;
  const show = () => own.forEach((c) => c.mark(+row.dataset.hz));
  const find = button("show", () => {
    kept = true;
    const main = own.find((c) => c.root.closest("section[id^=loop]")) || own[0];
    unfold(main.root);
    main.root.scrollIntoView({ block: "center", behavior: "auto" });
    show();
  }, { className: "find", ariaLabel: "Show this crossing in the figures", onfocus: show });
  row.querySelector("th").append(" ", find);
  row.addEventListener("pointerenter", () => { kept = false; show(); });
  row.addEventListener("pointerleave", () => { if (!kept) own.forEach((c) => c.hide()); });
}
if (charts.length) document.documentElement.classList.add("live");
