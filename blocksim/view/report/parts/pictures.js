// What is laid over the pictures of the page: the player's time, the curve of a block, the case under the pointer.
const SVG = "http://www.w3.org/2000/svg";
const REACH = 40; // pixels from the pointer to the case that it means
const OF_BLOCKS = ["x", "y", "rotation"];

// Adds an element to the sheet over a picture, whose sides are both 1, y down.
const overlay = (over, name, attributes) => {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  over.append(node);
  return node;
};

// Histories of a run, each a panel with its place and the ends of its axes.
class Histories {
  constructor(root, player, panels) {
    this.player = player;
    this.panels = panels;
    this.over = root.querySelector(".over");
    this.select = root.querySelector("[data-option=block]");
    const [first, last] = [panels[0].place, panels.at(-1).place];
    this.curve = overlay(this.over, "path", { class: "curve" });
    this.cursor = overlay(this.over, "line", { class: "cursor", y1: first[1], y2: last[1] + last[3] });
    this.over.addEventListener("pointerdown", (event) => { this.over.setPointerCapture(event.pointerId); this.scrub(event); });
    this.over.addEventListener("pointermove", (event) => { if (event.buttons) this.scrub(event); });
    this.select.addEventListener("change", () => this.choose(Number(this.select.value)));
    player.onFrame({ frame: () => this.move(), chosen: (block) => this.choose(block) });
    this.move();
  }

  scrub(event) {
    const { place: [left, , width], time: [start, end] } = this.panels[0];
    const share = (event.offsetX / this.over.clientWidth - left) / width;
    this.player.pause();
    this.player.show(this.player.frames.at(start + share * (end - start) + 1e-9));
  }

  across(time) {
    const { place: [left, , width], time: [start, end] } = this.panels[0];
    return (left + width * (time - start) / (end - start)).toFixed(5);
  }

  move() {
    const x = this.across(this.player.frames.time[this.player.frame]);
    this.cursor.setAttribute("x1", x);
    this.cursor.setAttribute("x2", x);
  }

  // Draws the curves of a block, -1 for none, over those of all others.
  choose(block) {
    const { frames } = this.player;
    this.select.value = block;
    const panels = block < 0 ? [] : this.panels.filter(({ name }) => OF_BLOCKS.includes(name));
    this.curve.setAttribute("d", panels.map(({ name, place: [, top, , height], values: [low, high] }) => {
      const up = (frame) => top + height * (high - frames[name][frame * frames.blocks + block]) / (high - low);
      const seen = [...frames.time.keys()].filter((frame) => Number.isFinite(up(frame)));
      return `M${seen.map((frame) => `${this.across(frames.time[frame])},${up(frame).toFixed(5)}`).join("L")}`;
    }).join(""));
  }
}

// Pictures of a sweep, one at a time. A case of a map is found by pointer and keys, told below and marked in the table.
class Pictures {
  constructor(root, data, table, open) {
    this.data = data;
    this.table = table;
    this.open = open;
    this.current = -1;
    this.state = root.querySelector(".map .state");
    this.sheets = [...root.querySelectorAll(".map .drawn")];
    const select = root.querySelector("[data-option=picture]");
    select.addEventListener("change", () => this.show(Number(select.value)));
    this.sheets.forEach((sheet, number) => { if (data.pictures[number]) this.wire(sheet.querySelector(".over"), data.pictures[number]); });
    this.show(0);
  }

  show(number) { this.sheets.forEach((sheet, place) => { sheet.hidden = place !== number; }); }

  wire(over, picture) {
    const marks = overlay(over, "path", { class: "cursor" });
    const mark = (row) => this.mark(row, marks, picture);
    const count = picture.column.length;
    over.addEventListener("pointermove", (event) => mark(this.nearest(over, picture, event)));
    over.addEventListener("click", (event) => { mark(this.nearest(over, picture, event)); this.openCurrent(); });
    over.addEventListener("keydown", (event) => {
      const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (by) { event.preventDefault(); mark((this.current + by + count) % count); }
      if (event.key === "Enter") this.openCurrent();
    });
  }

  // Where a case is: in one panel of every row.
  places(row, { panels, column, x, y }) {
    return column[row] < 0 ? [] : panels.map((columns) => columns[column[row]])
      .map(([left, top, width, height]) => ({ left, top, width, height, x: left + width * x[row], y: top + height * (1 - y[row]) }));
  }

  nearest(over, picture, event) {
    let [best, least] = [-1, REACH];
    for (const row of picture.column.keys()) {
      for (const { x, y } of this.places(row, picture)) {
        const way = Math.hypot(x * over.clientWidth - event.offsetX, y * over.clientHeight - event.offsetY);
        if (way < least) [best, least] = [row, way];
      }
    }
    return best;
  }

  mark(row, marks, picture) {
    if (row < 0) return;
    this.current = row;
    this.table.mark(row);
    marks.setAttribute("d", this.places(row, picture).map(({ left, top, width, height, x, y }) =>
      `M${x} ${top}V${top + height}M${left} ${y}H${left + width}`).join(""));
    this.tell(row);
  }

  openCurrent() {
    const key = this.data.members[this.value("case", this.current)];
    if (key) this.open(key);
  }

  value(name, row) { return this.data.columns.find((column) => column.name === name)?.values[row]; }

  tell(row) {
    const value = (name) => this.value(name, row);
    const of = (role) => this.data.columns.filter((column) => column.role === role);
    const ends = of("block").filter(({ name }) => name.endsWith(".x_mm")).slice(0, 6);
    const verdict = { True: "inside", False: "outside" }[value("inside")];
    const told = [
      `case ${value("case")}`, ...of("varied").map(({ name }) => `${name} = ${brief(value(name))}`),
      value("status") + (value("reason") ? ` (${value("reason")})` : ""), value("outcome"), verdict,
      ...ends.map(({ name }) => `${name} ${shown(value(name))}`),
    ].filter(Boolean);
    const key = this.data.members[value("case")];
    const help = key ? make("a", { href: `#${key}` }, "open the run") : make("small", {}, isolated(this.help(value("case"))));
    this.state.replaceChildren(...told.map((text) => make("span", {}, isolated(text))), help);
  }

  help(name) {
    if (this.data.left_out.includes(name)) return `Not in this page: blocksim report ${this.data.place}/cases/${name}`;
    return "No frames were kept; blocksim sweep --keep-cases keeps them.";
  }
}
