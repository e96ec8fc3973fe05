// The table of rapids: sorted, filtered, and shown page by page, whatever their number.
//
// Rule: rows are made for the page that is shown and no other.

const PAGE_ROWS = 25;

class RapidTable {
  // `columns`: {key, head, kind, show(i), value(i)}; `matches(i, filter)`; `choose(i)`.
  constructor(count, columns, matches, choose) {
    Object.assign(this, { count, columns, matches, choose });
    this.table = document.getElementById("table");
    this.body = this.table.querySelector("tbody");
    this.pages = document.getElementById("pages");
    this.filter = {};
    this.sorted = { key: "after", down: true };
    this.page = 0;
    this.chosen = -1;
    this.makeHead();
    this.makePages();
    this.body.addEventListener("click", (event) => {
      const row = event.target.closest("tr");
      if (row) this.choose(Number(row.dataset.row), true);
    });
    this.body.addEventListener("keydown", (event) => this.key(event));
    this.arrange();
  }

  makeHead() {
    const row = this.table.querySelector("thead tr");
    for (const column of this.columns) {
      const cell = document.createElement("th");
      cell.scope = "col";
      cell.className = column.kind;
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = column.head;
      button.addEventListener("click", () => this.sort(column.key));
      cell.append(button);
      row.append(cell);
      column.cell = cell;
    }
  }

  makePages() {
    const make = (text, label, to) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.setAttribute("aria-label", label);
      button.addEventListener("click", () => {
        this.page = to();
        this.render();
      });
      return button;
    };
    this.first = make("«", "First page", () => 0);
    this.back = make("‹", "Previous page", () => this.page - 1);
    this.where = document.createElement("span");
    this.next = make("›", "Next page", () => this.page + 1);
    this.last = make("»", "Last page", () => this.pageCount - 1);
    this.pages.append(this.first, this.back, this.where, this.next, this.last);
  }

  get pageCount() {
    return Math.max(Math.ceil(this.order.length / PAGE_ROWS), 1);
  }

  sort(key) {
    const numbers = this.columns.find((column) => column.key === key).down;
    const again = this.sorted.key === key;
    this.sorted = { key, down: again ? !this.sorted.down : Boolean(numbers) };
    this.page = 0;
    this.arrange();
  }

  setFilter(filter) {
    this.filter = filter;
    this.page = 0;
    this.arrange();
  }

  arrange() {
    const { key, down } = this.sorted;
    const column = this.columns.find((each) => each.key === key);
    const values = new Array(this.count);
    this.order = [];
    for (let i = 0; i < this.count; i++) {
      values[i] = column.value(i);
      if (this.matches(i, this.filter)) this.order.push(i);
    }
    const sign = down ? -1 : 1;
    this.order.sort((i, j) => {
      const a = values[i], b = values[j];
      // What is not known comes last, whichever way.
      const unknown = (a !== a) - (b !== b);
      if (unknown) return unknown;
      return a < b ? -sign : a > b ? sign : i - j;
    });
    for (const each of this.columns) {
      if (each.key === key) each.cell.setAttribute("aria-sort", down ? "descending" : "ascending");
      else each.cell.removeAttribute("aria-sort");
    }
    this.render();
  }

  render() {
    const first = this.page * PAGE_ROWS;
    const rows = this.order.slice(first, first + PAGE_ROWS);
    const holder = rows.includes(this.chosen) ? this.chosen : rows[0];
    this.body.replaceChildren(...rows.map((i) => this.row(i, i === holder)));
    if (!rows.length) {
      const cell = document.createElement("td");
      cell.colSpan = this.columns.length;
      cell.textContent = "No rapid matches. Clear the filter to see them all.";
      const row = document.createElement("tr");
      row.append(cell);
      this.body.replaceChildren(row);
    }
    this.where.textContent = `page ${this.page + 1} of ${this.pageCount}`;
    this.first.disabled = this.back.disabled = this.page === 0;
    this.last.disabled = this.next.disabled = this.page >= this.pageCount - 1;
    this.pages.hidden = this.pageCount === 1;
    const all = this.order.length === this.count ? "" : ` of ${grouped(this.count)}`;
    const part = rows.length < this.order.length
      ? `; rows ${grouped(first + 1)} to ${grouped(first + rows.length)}` : "";
    const noun = this.order.length === 1 && !all ? "rapid" : "rapids";
    document.getElementById("count").textContent = `${grouped(this.order.length)}${all} ${noun}${part}`;
  }

  row(i, holder) {
    const row = document.createElement("tr");
    row.dataset.row = i;
    if (i === this.chosen) row.setAttribute("aria-current", "true");
    for (const column of this.columns) {
      const cell = document.createElement(column.key === "line" ? "th" : "td");
      cell.className = column.kind;
      if (column.key === "line") {
        cell.scope = "row";
        const button = document.createElement("button");
        button.type = "button";
        button.textContent = column.show(i);
        button.setAttribute("aria-label", `Show the rapid of line ${column.show(i)}`);
        button.tabIndex = holder ? 0 : -1;
        cell.append(button);
      } else {
        const shown = column.show(i);
        cell.append(...(Array.isArray(shown) ? shown : [shown]));
      }
      row.append(cell);
    }
    return row;
  }

  key(event) {
    const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: PAGE_ROWS, PageUp: -PAGE_ROWS };
    steps.Home = -this.order.length;
    steps.End = this.order.length;
    if (!(event.key in steps) || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    const row = event.target.closest("tr");
    const here = this.order.indexOf(Number(row.dataset.row));
    const there = Math.max(0, Math.min(this.order.length - 1, here + steps[event.key]));
    this.choose(this.order[there], false);
    this.focus();
  }

  focus() {
    const button = this.body.querySelector("tr[aria-current] button");
    if (button) button.focus();
  }

  // Marks a rapid, and turns to its page where it is in the table.
  mark(i) {
    this.chosen = i;
    const at = this.order.indexOf(i);
    if (at >= 0) this.page = Math.floor(at / PAGE_ROWS);
    const focused = this.body.contains(document.activeElement);
    this.render();
    if (focused) this.focus();
  }
}
