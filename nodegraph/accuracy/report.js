// A click on a heading sorts the table by that column; a second one turns the order round.
for (const table of document.querySelectorAll("table")) {
  const body = table.tBodies[0];
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    let down = false;
    const value = row => {
      const cell = row.cells[column];
      return cell ? (cell.dataset.v ?? cell.textContent) : "";
    };
    head.onclick = () => {
      down = !down;
      const rows = [...body.rows].sort((a, b) => {
        const [x, y] = [value(a), value(b)];
        const [p, q] = [x, y].map(text => Number(text.replace("inf", "Infinity")));
        const order = isNaN(p) || isNaN(q) ? x.localeCompare(y) : p - q;
        return down ? order : -order;
      });
      body.append(...rows);
    };
  });
}
