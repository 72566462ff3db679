// The cases of a sweep as a table that can be sorted and filtered.
const ROWS_AT_ONCE = 200;

class CaseTable {
  constructor(root, data, open) {
    this.root = root;
    this.columns = data.columns;
    this.members = data.members;
    this.measured = data.measured;
    this.numeric = new Set(data.columns.filter((column) => this.isNumber(column)));
    this.open = open;
    this.count = data.columns[0].values.length;
    this.order = Array.from({ length: this.count }, (_, row) => row);
    this.limit = ROWS_AT_ONCE;
    this.sorted = null;
    this.table = root.querySelector("table.cases");
    this.filter = root.querySelector("[data-option=filter]");
    this.more = root.querySelector("[data-act=more]");
    this.filter.addEventListener("input", () => { this.limit = ROWS_AT_ONCE; this.draw(); });
    this.more.addEventListener("click", () => { this.limit += 5 * ROWS_AT_ONCE; this.draw(); });
    this.drawHead();
    this.draw();
  }

  isNumber(column) { return column.values.every((value) => value === null || typeof value === "number") && column.role !== "case"; }

  drawHead() {
    this.heads = this.columns.map((column) => {
      const button = make("button", { type: "button" }, breakable(column.name));
      const head = make("th", { scope: "col", "aria-sort": "none", ...(this.numeric.has(column) && { class: "n" }) }, button);
      button.addEventListener("click", () => this.sort(column));
      return head;
    });
    this.table.querySelector("thead").replaceChildren(make("tr", {}, ...this.heads));
  }

  // Sorts by a column, backwards where it was sorted by it already; empty cells come last.
  sort(column) {
    const backwards = this.sorted?.column === column && !this.sorted.backwards;
    this.sorted = { column, backwards };
    const sign = backwards ? -1 : 1;
    const order = (one, other) => (typeof one === "number" && typeof other === "number" ? one - other : String(one).localeCompare(String(other), "en", { numeric: true }));
    this.order.sort((a, b) => {
      const [one, other] = [column.values[a], column.values[b]];
      if (one === null || other === null) return (one === null) - (other === null) || a - b;
      return sign * order(one, other) || a - b;
    });
    this.heads.forEach((head, place) => head.setAttribute("aria-sort", this.columns[place] !== column ? "none" : backwards ? "descending" : "ascending"));
    this.draw();
  }

  matching() {
    const text = this.filter.value.trim().toLowerCase();
    if (!text) return this.order;
    return this.order.filter((row) => this.columns.some(({ values }) => String(values[row] ?? "").toLowerCase().includes(text)));
  }

  draw() {
    const rows = this.matching();
    const seen = rows.slice(0, this.limit);
    this.table.querySelector("tbody").replaceChildren(...seen.map((row) => this.row(row)));
    this.more.hidden = seen.length === rows.length;
    this.filter.closest(".controls").querySelector("output").textContent = `${seen.length} of ${rows.length} cases shown`;
  }

  row(row) {
    const line = make("tr", { "data-row": row, ...(row === this.current && { class: "current" }) });
    this.columns.forEach((column) => line.append(this.cell(column, row)));
    return line;
  }

  cell(column, row) {
    const value = column.values[row];
    if (column.role === "case") {
      const key = this.members[value];
      const name = key ? make("a", { href: `#${key}` }, isolated(value)) : isolated(value);
      return make("th", { scope: "row" }, name);
    }
    const kind = this.numeric.has(column) ? "n" : "text";
    if (column.name === "inside") return make("td", { class: value === "True" ? "inside" : value === "False" ? "outside" : "" }, { True: "✓ inside", False: "✗ outside" }[value] ?? "–");
    const limits = typeof value === "number" ? this.measured[column.name] : undefined;
    if (limits) {
      const inside = limits[0] <= value && value <= limits[1];
      return make("td", { class: `n ${inside ? "inside" : "outside"}` }, `${inside ? "✓" : "✗"} ${shown(value)}`);
    }
    const text = column.role === "block" && typeof value === "number" ? shown(value) : brief(value);
    return make("td", { class: kind }, isolated(text));
  }

  mark(row) {
    this.current = row;
    for (const line of this.table.querySelectorAll("tbody tr")) line.classList.toggle("current", Number(line.dataset.row) === row);
  }
}
