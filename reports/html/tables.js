// Tables sort by their headings: numbers by value, the unknown always last, equal rows in the order they came.
// The first click sorts text upwards and numbers downwards; the next ones turn it round.

const collator = new Intl.Collator('en', { numeric: true, sensitivity: 'base' });

function cellKey(cell) {
  const text = cell.dataset.v ?? cell.textContent.trim();
  const number = text === '' ? NaN : Number(text);
  return { text, number: Number.isNaN(number) ? null : number };
}

function compareCells(one, two, direction) {
  if (one.text === '' || two.text === '') return (one.text === '') - (two.text === '');
  if (one.number !== null && two.number !== null) return direction * (one.number - two.number);
  if ((one.number === null) !== (two.number === null)) return one.number === null ? 1 : -1;
  return direction * collator.compare(one.text, two.text);
}

function sortTable(table, column) {
  const headings = [...table.tHead.rows[table.tHead.rows.length - 1].cells];
  const heading = headings[column];
  const before = heading.getAttribute('aria-sort');
  const first = heading.classList.contains('n') ? 'descending' : 'ascending';
  const turned = before === 'ascending' ? 'descending' : 'ascending';
  const now = before === 'none' ? first : turned;
  for (const other of headings) other.setAttribute('aria-sort', other === heading ? now : 'none');
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => ({ row, key: cellKey(row.cells[column]) }));
  // Array.prototype.sort keeps the order of equal rows.
  rows.sort((one, two) => compareCells(one.key, two.key, now === 'ascending' ? 1 : -1));
  body.append(...rows.map((r) => r.row));
}

for (const table of document.querySelectorAll('table.sortable')) {
  const headings = table.tHead.rows[table.tHead.rows.length - 1].cells;
  [...headings].forEach((heading, column) => {
    heading.querySelector('button').addEventListener('click', () => sortTable(table, column));
  });
}

// A box that has nothing to scroll is no stop for the keyboard.
function settleBoxes() {
  for (const box of document.querySelectorAll('.scroll, .chart, .drawing')) {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
    else box.removeAttribute('tabindex');
  }
}

addEventListener('resize', settleBoxes);
settleBoxes();
