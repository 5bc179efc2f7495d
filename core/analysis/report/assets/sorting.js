// Tables of class "sortable": a click on a column title sorts each table body. Rows of one cell are titles and stay on top, missing
// values come last.
'use strict';

const relignSorting = (() => {
  function sortTable(table, column, ascending) {
    const key = ({cells: {[column]: cell}}) => {
      const text = cell.dataset.sort === undefined ? cell.textContent.trim() : cell.dataset.sort;
      return text === '-' ? '' : text;
    };
    const compare = (a, b) => {
      const x = key(a), y = key(b);
      if (x === '' || y === '') return (x === '') - (y === '');
      const numeric = Number(x) - Number(y);
      const order = Number.isNaN(numeric) ? x.localeCompare(y) : numeric;
      return ascending ? order : -order;
    };
    for (const body of table.tBodies) {
      const rows = [...body.rows];
      body.append(...rows.filter((row) => row.cells.length === 1), ...rows.filter((row) => row.cells.length > 1).sort(compare));
    }
  }

  function start() {
    for (const table of document.querySelectorAll('table.sortable')) {
      const heads = [...table.tHead.rows[0].cells];
      heads.forEach((head, column) => {
        const button = document.createElement('button');
        button.type = 'button';
        button.append(...head.childNodes);
        head.append(button);
        button.addEventListener('click', () => {
          const ascending = head.getAttribute('aria-sort') !== 'ascending';
          heads.forEach((other) => other.removeAttribute('aria-sort'));
          head.setAttribute('aria-sort', ascending ? 'ascending' : 'descending');
          sortTable(table, column, ascending);
        });
      });
    }
  }

  return {start};
})();
