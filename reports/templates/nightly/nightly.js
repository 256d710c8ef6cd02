"use strict";
(() => {
  const table = document.getElementById("designs");
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const designs = rows.filter((row) => row.dataset.kind === "design"); // what is counted, here and on the buttons
  const search = document.getElementById("search");
  const filters = [...document.querySelectorAll(".filters button")];
  const shown = document.querySelector(".shown");
  const nothing = document.querySelector(".nothing");
  const fold = (text) => text.toLowerCase().normalize("NFKD");
  let state = "";

  const show = () => {
    const words = fold(search.value).split(/\s+/).filter(Boolean);
    for (const row of rows) {
      const text = fold([row.dataset.name, ...[0, 1].map((k) => row.cells[k].textContent)].join(" "));
      const fits = (!state || row.dataset.state === state) && words.every((word) => text.includes(word));
      row.hidden = !fits;
    }
    shown.textContent = `${designs.filter((row) => !row.hidden).length} of ${designs.length} shown`;
    nothing.hidden = rows.some((row) => !row.hidden);
  };

  const sort = (button) => {
    const head = button.closest("th");
    const column = head.cellIndex;
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const number = button.dataset.key !== "name";
    const value = (row) => (number ? Number(row.cells[column].dataset.v) : row.cells[column].dataset.v);
    const compare = number ? (a, b) => a - b : (a, b) => a.localeCompare(b, "en", { numeric: true });
    rows.sort((a, b) => (down ? -1 : 1) * compare(value(a), value(b)) || a.dataset.order - b.dataset.order);
    body.append(...rows);
  };

  search.addEventListener("input", show);
  for (const button of filters) {
    button.addEventListener("click", () => {
      state = button.dataset.state;
      for (const other of filters) other.setAttribute("aria-pressed", String(other === button));
      show();
    });
  }
  for (const button of table.querySelectorAll("thead button")) button.addEventListener("click", () => sort(button));
  show();
})();
