"use strict";
// Tables sort: a click on the name of a column puts its rows in order, another one the other way round, a third as they were.
for (const table of document.querySelectorAll(".tabular table")) {
  const body = table.tBodies[0];
  const first = [...body.rows];
  if (first.length < 3 || [...body.querySelectorAll("[rowspan],[colspan]")].length) continue;
  const key = (row, column) => {
    const cell = row.cells[column];
    const given = cell.dataset.order;
    return given === undefined ? cell.textContent.trim() : Number(given);
  };
  const compare = (a, b) => {
    const [x, y] = [a, b].map((value) => typeof value === "number" && Number.isNaN(value));
    if (x || y) return Number(x) - Number(y);
    if (typeof a === "number" && typeof b === "number") return a - b;
    return String(a).localeCompare(String(b), "en", { numeric: true });
  };
  const headings = [...table.tHead.rows[0].cells];
  headings.forEach((heading, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "sort";
    button.append(...heading.childNodes);
    heading.append(button);
    button.addEventListener("click", () => {
      const next = { none: "ascending", ascending: "descending", descending: "none" }[heading.ariaSort || "none"];
      headings.forEach((other) => other.removeAttribute("aria-sort"));
      if (next !== "none") heading.setAttribute("aria-sort", next);
      const sign = next === "descending" ? -1 : 1;
      const rows = next === "none" ? first : [...first].sort((a, b) => {
        const [x, y] = [key(a, column), key(b, column)];
        const missing = [x, y].some((value) => typeof value === "number" && Number.isNaN(value));
        return missing ? compare(x, y) : sign * compare(x, y);
      });
      body.append(...rows);
    });
  });
}
// What is wider than its place says so: a hint above, and a fading edge until its end is seen.
const places = document.querySelectorAll(".scroll, .drawing");
const seen = (place) => {
  const wide = place.scrollWidth > place.clientWidth + 1;
  place.classList.toggle("sideways", wide);
  place.classList.toggle("end", place.scrollLeft + place.clientWidth >= place.scrollWidth - 2);
  const before = place.previousElementSibling;
  const hint = before && before.classList.contains("hint") ? before : null;
  if (hint) hint.hidden = !wide;
  else if (wide) place.insertAdjacentHTML("beforebegin", '<p class="hint" aria-hidden="true">wider than the screen: scroll sideways \u2192</p>');
};
const watcher = new ResizeObserver((entries) => entries.forEach((entry) => seen(entry.target)));
for (const place of places) {
  watcher.observe(place);
  place.addEventListener("scroll", () => seen(place), { passive: true });
}
