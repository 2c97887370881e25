#!/usr/bin/env bash
# Opens a report.html in headless Chromium and works its table: sorts, filters, follows a link; then once more
# from a server on this machine.
#
#     examples/ci/check-report.sh run/report.html
#
# Prints what it did and how long opening and sorting took, roughly: the browser runs on virtual time, so that it
# waits for nothing. Exit code 0 if all is well, 1 if not, 77 where there is no
# Chromium.
set -euo pipefail

report=${1:?a report.html expected}
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
if [ -z "$browser" ]; then
    echo "skipped: no Chromium"
    exit 77
fi

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Before the report's own script: what goes wrong. Behind it: the work of somebody at the table.
cat >"$folder/before" <<'HTML'
<script>
window.wrong = [];
addEventListener("error", (event) => wrong.push(event.message));
addEventListener("securitypolicyviolation", (event) => wrong.push(event.violatedDirective));
for (const name of ["error", "warn"]) console[name] = (...words) => wrong.push(words.join(" "));
</script>
HTML
cat >"$folder/behind" <<'HTML'
<script>
addEventListener("load", () => setTimeout(() => {
  const expect = (is, words) => { if (!is) wrong.push(words); };
  const table = document.getElementById("results");
  const count = () => document.getElementById("count").textContent;
  const all = Number(/(\d+) in all/.exec(count())?.[1]);
  const column = (name) => Array.from(table.tHead.rows[0].cells).findIndex((cell) => cell.textContent === name);
  const values = (at) => Array.from(table.tBodies[0].rows, (row) => row.cells[at].dataset.v).filter((v) => v !== "").map(Number);
  const timed = (work) => {
    const begun = performance.now();
    work();
    table.getBoundingClientRect();
    return performance.now() - begun;
  };
  const navigation = performance.getEntriesByType("navigation")[0];
  const first = table.tBodies[0].rows.length;
  let slowest = 0;
  // The page stands before anybody sorts.
  timed(() => {});
  const sort = (name) => {
    const header = table.tHead.rows[0].cells[column(name)];
    slowest = Math.max(slowest, timed(() => header.querySelector("button").click()));
    return header.getAttribute("aria-sort");
  };
  const isSorted = (numbers, sign) => numbers.every((n, at) => at === 0 || sign * (n - numbers[at - 1]) >= 0);
  const error = column("error (m)");
  expect(all > 0 && error > 0, "there is no table of results");
  expect(sort("error (m)") === "ascending" && isSorted(values(error), 1), "errors do not ascend");
  expect(sort("error (m)") === "descending" && isSorted(values(error), -1), "errors do not descend");
  expect(sort("query") === "ascending", "queries do not ascend");
  expect(document.querySelectorAll("[aria-sort]").length === 1, "several columns say that they are sorted");
  const filters = document.getElementById("filters");
  const method = filters.elements.method;
  method.value = method.options[1].value;
  const filtering = timed(() => filters.dispatchEvent(new Event("input", { bubbles: true })));
  const rows = () => Array.from(table.tBodies[0].rows);
  expect(rows().length > 0 && rows().every((row) => row.dataset.method === method.value), "other methods are shown");
  filters.elements.words.value = "no such words";
  filters.dispatchEvent(new Event("input", { bubbles: true }));
  expect(rows().length === 0 && count().startsWith("0 of 0"), "something meets a filter that nothing meets");
  // A box shows and hides a column.
  const box = document.querySelector(".columns input:not(:checked)");
  const isShown = () => getComputedStyle(table.tHead.rows[0].cells[Number(box.id.slice(1)) - 1]).display !== "none";
  const before = isShown();
  box.click();
  expect(!before && isShown(), "a box does not show its column");
  box.click();
  // A cause leads to its results.
  const cause = document.querySelector("a[data-cause]");
  if (cause) {
    cause.click();
    expect(rows().length > 0 && rows().every((row) => row.dataset.code === cause.dataset.cause), "a cause shows others");
  }
  // Nothing is wider than the page.
  expect(document.documentElement.scrollWidth <= document.documentElement.clientWidth, "the page scrolls sideways");
  filters.reset();
  setTimeout(() => {
    expect(rows().length === first, "without a filter others are shown than at first");
    const more = document.getElementById("more");
    if (!more.hidden) more.click();
    expect(rows().length === all, "not all are shown to whoever asks");
    // The keyboard reaches what the pointer does.
    const button = table.tHead.querySelector("button");
    button.focus();
    expect(document.activeElement === button, "a header takes no focus");
    const link = table.querySelector('a[href^="#f"]');
    if (link) { link.click(); }
    setTimeout(() => {
      if (link) expect(document.querySelector(link.getAttribute("href")).open, "a failure stays closed");
      // A page from a disk has no address that a viewer elsewhere could read from.
      const viewers = Array.from(document.querySelectorAll("a[data-viewer]"));
      const served = location.protocol.startsWith("http");
      const leads = (one) => served
        ? !one.hidden && one.href.endsWith(encodeURIComponent(new URL(one.dataset.recording, location.href).href))
        : one.hidden;
      expect(viewers.every(leads), "recordings lead to no viewer, or to one that cannot read them");
      const loaded = performance.getEntriesByType("resource").map((one) => one.name).filter((name) => !name.startsWith("data:") && !name.endsWith("/favicon.ico"));
      expect(loaded.length === 0, `it loads ${loaded}`);
      const told = document.createElement("pre");
      told.id = "checked";
      told.textContent = JSON.stringify({ results: all, open_ms: Math.round(navigation.loadEventStart),
        sort_ms: Math.round(slowest), filter_ms: Math.round(filtering), wrong });
      document.body.append(told);
    }, 50);
  }, 50);
}, 0));
</script>
HTML
awk -v before="$folder/before" -v behind="$folder/behind" '
    function put(file,   line) { while ((getline line < file) > 0) print line; close(file) }
    !begun && (at = index($0, "<head>")) {
        print substr($0, 1, at + 5); put(before); $0 = substr($0, at + 6); begun = 1
    }
    (at = index($0, "</body>")) { print substr($0, 1, at - 1); put(behind); $0 = substr($0, at) }
    { print }
' "$report" >"$folder/checked.html"

# Opens the page at this address and says what became of it.
check() {
    "$browser" --headless --no-sandbox --disable-gpu --window-size=420,900 --user-data-dir="$folder/profile" \
        --virtual-time-budget=20000 --dump-dom "$1" >"$folder/dom.html" 2>"$folder/said" || true
    local told
    told=$(grep -o '<pre id="checked">[^<]*' "$folder/dom.html" | sed 's/<pre id="checked">//; s/&quot;/"/g' || true)
    if [ -z "$told" ]; then
        echo "the page did not come to its end:" >&2
        tail -5 "$folder/said" >&2
        exit 1
    fi
    echo "$told"
    [[ $told == *'"wrong":[]'* ]]
}

check "file://$folder/checked.html"

# From a server its recordings lead to a viewer in the browser.
if command -v python3 >/dev/null; then
    python3 -u -m http.server --bind 127.0.0.1 --directory "$folder" 0 >"$folder/served" 2>&1 &
    server=$!
    trap 'kill "$server"; rm -rf "$folder"' EXIT
    until port=$(grep -o 'port [0-9]*' "$folder/served" | cut -d' ' -f2) && [ -n "$port" ]; do
        kill -0 "$server"
        sleep 0.1
    done
    check "http://127.0.0.1:$port/checked.html"
fi
