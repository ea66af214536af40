/* Labels the cells of tables of three columns or more with the titles of their columns: on a phone, where few of them
   fit, site.css stacks the cells of a row. */
for (const table of document.querySelectorAll("table.docutils")) {
  const titles = [...table.querySelectorAll("thead th")].map((cell) => cell.textContent.trim());
  if (titles.length < 3) continue;
  table.classList.add("stacked");
  table.classList.toggle("explained", titles[titles.length - 1] === "meaning");
  for (const row of table.tBodies[0].rows)
    [...row.cells].forEach((cell, column) => {
      if (cell.textContent.trim()) cell.dataset.label = titles[column];
    });
}
