// Sorts and filters the table of results. Without it the table is whole and in the order of the run.
(() => {
  "use strict";
  const table = document.getElementById("results");
  const count = document.getElementById("count");
  const more = document.getElementById("more");
  const filters = document.getElementById("filters");
  if (!table || !filters) return;
  const FIRST = 50;
  const body = table.tBodies[0];
  const rows = Array.from(body.rows, (row) => ({
    row,
    cells: Array.from(row.cells),
    text: row.textContent.toLowerCase(),
  }));
  const headers = Array.from(table.tHead.rows[0].cells);
  let order = null;
  let limit = FIRST;

  const value = (cell) => {
    const text = cell.dataset.v ?? cell.textContent;
    if (text === "") return null;
    const number = Number(text);
    return Number.isNaN(number) ? text : number;
  };

  // Read once for each column that somebody sorts by.
  const keys = new Map();
  const keyed = (column) => {
    if (!keys.has(column)) {
      keys.set(column, new Map(rows.map((one) => [one, value(one.cells[column])])));
    }
    return keys.get(column);
  };

  const { compare: inWords } = new Intl.Collator("en");
  const compare = (a, b) =>
    typeof a === "number" && typeof b === "number" ? a - b : inWords(String(a), String(b));

  const show = () => {
    const words = filters.elements.words.value.toLowerCase().split(/\s+/).filter(Boolean);
    const wanted = ["method", "grade", "code"].map((name) => [name, filters.elements[name].value]);
    let met = rows.filter(({ row, text }) =>
      words.every((word) => text.includes(word)) &&
      wanted.every(([name, value]) => value === "" || row.dataset[name] === value));
    if (order) {
      const key = keyed(order.column);
      const pairs = met.map((one) => [key.get(one), one]);
      // What a result does not have comes last either way.
      pairs.sort(([a], [b]) => a === null || b === null
        ? (a === null) - (b === null)
        : order.sign * compare(a, b));
      met = pairs.map(([, one]) => one);
    }
    body.replaceChildren(...met.slice(0, limit).map(({ row }) => row));
    const shown = Math.min(met.length, limit);
    count.textContent = `${shown} of ${met.length} results that meet the filter, ${rows.length} in all`;
    more.hidden = shown === met.length;
  };

  headers.forEach((header, column) => {
    const button = header.querySelector("button");
    if (!button) return;
    button.addEventListener("click", () => {
      const again = order && order.column === column;
      order = { column, sign: again ? -order.sign : 1 };
      for (const other of headers) other.removeAttribute("aria-sort");
      header.setAttribute("aria-sort", order.sign > 0 ? "ascending" : "descending");
      show();
    });
  });
  filters.addEventListener("input", () => { limit = FIRST; show(); });
  filters.addEventListener("submit", (event) => event.preventDefault());
  filters.addEventListener("reset", () => setTimeout(show));
  more.addEventListener("click", () => { limit = Infinity; show(); });

  // A cause shows the results that have it.
  for (const link of document.querySelectorAll("a[data-cause]")) {
    link.addEventListener("click", () => {
      filters.reset();
      filters.elements.code.value = link.dataset.cause;
      limit = FIRST;
      show();
    });
  }

  // What a link names may be out of the table or closed.
  const follow = () => {
    const name = decodeURIComponent(location.hash.slice(1));
    const named = rows.find(({ row }) => row.id === name);
    if (named && !named.row.isConnected) {
      filters.reset();
      limit = Infinity;
      show();
    }
    const there = name && document.getElementById(name);
    if (!there) return;
    for (let at = there; at; at = at.parentElement) {
      if (at.tagName === "DETAILS") at.open = true;
    }
    there.scrollIntoView({ block: there.tagName === "TR" ? "center" : "start" });
  };
  window.addEventListener("hashchange", follow);
  filters.hidden = false;
  show();
  follow();
})();

// Rerun's web viewer reads recordings from a server; a page that was opened as a file has none to give.
if (location.protocol.startsWith("http")) {
  for (const link of document.querySelectorAll("a[data-viewer]")) {
    const recording = new URL(link.dataset.recording, location.href);
    link.href = link.dataset.viewer + encodeURIComponent(recording.href);
    link.hidden = false;
  }
}
