// Lists of plans and findings with some rows left out: by verdict, by code, by words.

export function filters() {
  for (const bar of document.querySelectorAll(".filters[data-table]")) {
    const rows = [...document.getElementById(bar.dataset.table).tBodies[0].rows];
    // What a row says is read once: a thousand of them are searched at every letter.
    const texts = new Map(rows.map((row) => [row, row.textContent.toLowerCase()]));
    const words = bar.querySelector("[data-words]");
    listed(bar, rows, (row, on) => on(row.dataset.verdict) && texts.get(row).includes(words.value.trim().toLowerCase()));
  }
  for (const bar of document.querySelectorAll(".filters[data-findings]")) {
    listed(bar, [...document.querySelectorAll(".finding")], (finding, on) => on(finding.dataset.code));
  }
}

function listed(bar, all, wanted) {
  const boxes = [...bar.querySelectorAll("input[type=checkbox]")];
  const key = (box) => box.dataset.verdict ?? box.dataset.code;
  const count = bar.querySelector("[data-count]");
  const choose = () => {
    const chosen = new Set(boxes.filter((box) => box.checked).map(key));
    let shown = 0;
    for (const one of all) {
      one.hidden = !wanted(one, (kind) => chosen.has(kind));
      shown += Number(!one.hidden);
    }
    if (count) count.textContent = shown === all.length ? "" : `${shown} of ${all.length} listed`;
  };
  bar.addEventListener("input", choose);
}
