// The outcome of every case over two varied keys.
const EDGE = { left: 74, right: 16, top: 12, bottom: 46 };
const SIGNS = { inside: "#009E73", outside: "#D55E00", finished: "#56B4E9", other: "#777777" };
const OUTCOMES = { stands: "#009E73", "rocked back": "#56B4E9", rocking: "#CC79A7", slid: "#E69F00", fell: "#D55E00" };
const DECADES = 30;

// Returns whether the median is nearer to the middle of a logarithmic axis than to that of a linear one.
function isMiddleInLogs(values) {
  const sorted = [...values].sort((a, b) => a - b);
  const [low, middle, high] = [0, Math.floor(sorted.length / 2), sorted.length - 1].map((place) => sorted[place]);
  const offMiddle = (a, b, c) => Math.abs((b - a) / (c - a) - 0.5);
  return offMiddle(Math.log(low), Math.log(middle), Math.log(high)) < offMiddle(low, middle, high);
}

class Axis {
  constructor(column, count) {
    this.name = column ? column.name : "row in the table";
    const values = column ? column.values : Array.from({ length: count }, (_, row) => row + 1);
    this.isNumber = values.every((value) => value === null || typeof value === "number");
    this.labels = this.isNumber ? [] : [...new Set(values.map(String))];
    this.values = this.isNumber ? values : values.map((value) => this.labels.indexOf(String(value)));
    const finite = this.values.filter((value) => value !== null);
    this.low = finite.reduce((a, b) => Math.min(a, b), Infinity);
    this.high = finite.reduce((a, b) => Math.max(a, b), -Infinity);
    this.isLog = this.isNumber && this.low > 0 && this.high >= DECADES * this.low && isMiddleInLogs(finite);
  }

  scaled(value) { return this.isLog ? Math.log10(value) : value; }

  // Share of the way along the axis, with room at both ends.
  share(value) {
    const [low, high] = [this.scaled(this.low), this.scaled(this.high)];
    return high > low ? 0.05 + 0.9 * (this.scaled(value) - low) / (high - low) : 0.5;
  }

  ticks(most) {
    if (!this.isNumber) return this.labels.map((label, place) => [place, label.length > 14 ? `${label.slice(0, 13)}…` : label]);
    if (this.low === this.high) return [[this.low, brief(this.low)]];
    if (!this.isLog) return ticks(this.low, this.high, most).map((tick) => [tick, brief(tick)]);
    const powers = ticks(Math.ceil(Math.log10(this.low) - 1e-9), Math.floor(Math.log10(this.high) + 1e-9), most);
    return powers.filter(Number.isInteger).map((power) => [10 ** power, brief(10 ** power)]);
  }
}

class OutcomeMap {
  constructor(root, data, table, open) {
    this.root = root;
    this.data = data;
    this.table = table;
    this.open = open;
    this.count = data.columns[0].values.length;
    this.canvas = root.querySelector(".map canvas");
    this.current = -1;
    this.selects = Object.fromEntries(["across", "up", "colour"].map((name) => [name, root.querySelector(`[data-option=${name}]`)]));
    this.fillSelects();
    Object.values(this.selects).forEach((select) => select.addEventListener("change", () => this.draw()));
    this.wire();
  }

  column(name) { return this.data.columns.find((column) => column.name === name); }

  fillSelects() {
    const names = (role) => this.data.columns.filter((column) => column.role === role).map((column) => column.name);
    const ends = names("block");
    const numbers = names("outcome").filter((name) => this.column(name).values.some((value) => typeof value === "number"));
    const places = [...names("varied"), ...ends, ...numbers];
    const isJudged = this.column("inside")?.values.some((value) => value !== null);
    const hasOutcome = this.column("outcome")?.values.some((value) => value !== null);
    const colours = [...(isJudged ? ["inside"] : []), ...(hasOutcome ? ["outcome"] : []), "status", ...ends];
    const fill = (select, options, chosen) => {
      for (const name of options) select.append(make("option", { value: name }, name || "row in the table"));
      select.value = chosen ?? options[0];
    };
    const varied = names("varied");
    fill(this.selects.across, [...places, ""], varied[0] ?? "");
    fill(this.selects.up, [...places, ""], varied[1] ?? ends.at(-2) ?? "");
    fill(this.selects.colour, colours, colours[0]);
  }

  wire() {
    const { canvas } = this;
    new ResizeObserver(() => this.draw()).observe(canvas);
    onTheme(() => this.draw());
    canvas.addEventListener("pointermove", (event) => this.mark(this.nearest(event.offsetX, event.offsetY)));
    canvas.addEventListener("click", (event) => { this.mark(this.nearest(event.offsetX, event.offsetY)); this.openCurrent(); });
    canvas.addEventListener("keydown", (event) => {
      const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      if (by) { event.preventDefault(); this.mark((this.current + by + this.count) % this.count); }
      if (event.key === "Enter") this.openCurrent();
    });
  }

  openCurrent() {
    const key = this.data.members[this.column("case").values[this.current]];
    if (key) this.open(key);
  }

  place(row) {
    const [x, y] = [this.across.values[row], this.up.values[row]];
    if (x === null || y === null) return null;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    return [EDGE.left + (width - EDGE.left - EDGE.right) * this.across.share(x), height - EDGE.bottom - (height - EDGE.top - EDGE.bottom) * this.up.share(y)];
  }

  nearest(px, py) {
    let best = -1;
    let least = 20;
    this.places.forEach((place, row) => {
      const way = place ? Math.hypot(place[0] - px, place[1] - py) : Infinity;
      if (way < least) [best, least] = [row, way];
    });
    return best;
  }

  mark(row) {
    if (row === this.current || row < 0) return;
    this.current = row;
    this.table.mark(row);
    this.draw();
    this.tell(row);
  }

  tell(row) {
    const value = (name) => this.column(name)?.values[row];
    const name = value("case");
    const parts = this.data.columns.filter((column) => column.role === "varied").map((column) => `${column.name} = ${brief(column.values[row])}`);
    const ends = this.data.columns.filter((column) => column.role === "block" && column.name.endsWith(".x_mm")).slice(0, 6).map((column) => `${column.name} ${shown(column.values[row])}`);
    const verdict = { True: "inside", False: "outside" }[value("inside")];
    const told = [`case ${name}`, ...parts, value("status") + (value("reason") ? ` (${value("reason")})` : ""), ...(verdict ? [verdict] : []), ...ends];
    const key = this.data.members[name];
    const help = key ? make("a", { href: `#${key}` }, "open the run") : make("small", {}, isolated(this.help(name)));
    this.root.querySelector(".map .state").replaceChildren(...told.map((text) => make("span", {}, isolated(text))), help);
  }

  help(name) {
    if (this.data.left_out.includes(name)) return `Not in this page: blocksim report ${this.data.place}/cases/${name}`;
    return "No frames were kept; blocksim sweep --keep-cases keeps them.";
  }

  // Returns the fill of each row, the sign drawn in it, and the legend.
  colours() {
    const name = this.selects.colour.value;
    const column = this.column(name);
    if (name === "inside" || name === "status") return this.verdicts(name, column);
    if (name === "outcome") return this.outcomes(column);
    const finite = column.values.filter((value) => value !== null);
    const [low, high] = [finite.reduce((a, b) => Math.min(a, b), Infinity), finite.reduce((a, b) => Math.max(a, b), -Infinity)];
    const tone = (share) => `hsl(${260 - 200 * share} 75% ${32 + 36 * share}%)`; // dark to bright, also where colours look alike
    const fills = column.values.map((value) => (value === null ? SIGNS.other : tone(high > low ? (value - low) / (high - low) : 0.5)));
    const legend = [0, 0.25, 0.5, 0.75, 1].map((share) => [tone(share), shown(low + share * (high - low)), "disc"]);
    return { fills, forms: column.values.map((value) => (value === null ? "cross" : "disc")), legend };
  }

  outcomes(column) {
    const status = this.column("status").values;
    const kinds = column.values.map((value, row) => (status[row] === "finished" && value in OUTCOMES ? value : null));
    const count = (one) => kinds.filter((other) => other === one).length;
    const legend = Object.keys(OUTCOMES).filter(count).map((one) => [OUTCOMES[one], `${one}: ${count(one)}`, "disc"]);
    if (count(null)) legend.push([SIGNS.other, `did not finish: ${count(null)}`, "cross"]);
    return { fills: kinds.map((one) => OUTCOMES[one] ?? SIGNS.other), forms: kinds.map((one) => (one === null ? "cross" : "disc")), legend };
  }

  verdicts(name, column) {
    const status = this.column("status").values;
    const kind = (row) => {
      if (status[row] !== "finished") return "other";
      return name === "status" ? "finished" : { True: "inside", False: "outside" }[column.values[row]] ?? "finished";
    };
    const kinds = status.map((_, row) => kind(row));
    const forms = { inside: "disc", outside: "ring", finished: "disc", other: "cross" };
    const words = { inside: "inside all measured ranges", outside: "outside", finished: "finished", other: "did not finish" };
    const legend = Object.keys(SIGNS).filter((one) => kinds.includes(one)).map((one) => [SIGNS[one], `${words[one]}: ${kinds.filter((other) => other === one).length}`, forms[one]]);
    return { fills: kinds.map((one) => SIGNS[one]), forms: kinds.map((one) => forms[one]), legend };
  }

  draw() {
    const { canvas } = this;
    if (!canvas.clientWidth) return;
    const ratio = devicePixelRatio || 1;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    this.across = new Axis(this.column(this.selects.across.value), this.count);
    this.up = new Axis(this.column(this.selects.up.value), this.count);
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawMeasured(context);
    this.drawAxes(context);
    this.places = Array.from({ length: this.count }, (_, row) => this.place(row));
    const { fills, forms, legend } = this.colours();
    const size = Math.min(9, Math.max(2, 0.35 * Math.sqrt(canvas.clientWidth * canvas.clientHeight / this.count)));
    this.places.forEach((place, row) => { if (place) this.sign(context, ...place, size, fills[row], forms[row]); });
    const at = this.places[this.current];
    if (at) { context.lineWidth = 2.5; context.strokeStyle = colour("link"); context.strokeRect(at[0] - size - 4, at[1] - size - 4, 2 * size + 8, 2 * size + 8); }
    this.drawLegend(legend);
  }

  // Bands where an axis is the final state of a measured block: from the least to the largest repeat.
  drawMeasured(context) {
    const { measured } = this.data;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const inner = [width - EDGE.left - EDGE.right, height - EDGE.top - EDGE.bottom];
    const within = (axis, value) => Math.min(Math.max(axis.share(value), 0), 1);
    context.fillStyle = colour("band");
    const across = measured[this.selects.across.value];
    if (across) {
      const [low, high] = across.map((value) => EDGE.left + inner[0] * within(this.across, value));
      context.fillRect(low, EDGE.top, Math.max(high - low, 1), inner[1]);
    }
    const up = measured[this.selects.up.value];
    if (up) {
      const [low, high] = up.map((value) => height - EDGE.bottom - inner[1] * within(this.up, value));
      context.fillRect(EDGE.left, high, inner[0], Math.max(low - high, 1));
    }
    this.hasBand = Boolean(across || up);
  }

  sign(context, x, y, size, fill, form) {
    context.beginPath();
    context.lineWidth = Math.max(1, 0.35 * size);
    context.strokeStyle = context.fillStyle = fill;
    if (form === "cross") {
      const reach = 0.8 * size;
      context.moveTo(x - reach, y - reach);
      context.lineTo(x + reach, y + reach);
      context.moveTo(x - reach, y + reach);
      context.lineTo(x + reach, y - reach);
      context.stroke();
    } else {
      context.arc(x, y, form === "ring" ? 0.8 * size : size, 0, 7);
      if (form === "ring") context.stroke();
      else context.fill();
    }
  }

  drawAxes(context) {
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const inner = [width - EDGE.left - EDGE.right, height - EDGE.top - EDGE.bottom];
    context.strokeStyle = colour("line");
    context.fillStyle = colour("faint");
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    for (const [tick, text] of this.across.ticks(Math.max(2, Math.floor(width / 100)))) {
      const x = EDGE.left + inner[0] * this.across.share(tick);
      context.strokeRect(x, EDGE.top, 0, inner[1]);
      context.fillText(text, x, height - EDGE.bottom + 16);
    }
    context.fillText(this.cut(context, this.across.name, inner[0]), EDGE.left + 0.5 * inner[0], height - 8);
    context.textAlign = "right";
    for (const [tick, text] of this.up.ticks(6)) {
      const y = height - EDGE.bottom - inner[1] * this.up.share(tick);
      context.strokeRect(EDGE.left, y, inner[0], 0);
      context.fillText(text, EDGE.left - 6, y + 4);
    }
    context.save();
    context.translate(14, EDGE.top + 0.5 * inner[1]);
    context.rotate(-0.5 * Math.PI);
    context.textAlign = "center";
    context.fillText(this.cut(context, this.up.name, inner[1]), 0, 0);
    context.restore();
  }

  cut(context, text, room) {
    let shortened = text;
    while (shortened.length > 4 && context.measureText(shortened).width > room) shortened = `${shortened.slice(0, -2)}…`;
    return shortened;
  }

  drawLegend(legend) {
    const all = this.hasBand ? [...legend, [colour("band"), "band: inside", "band"]] : legend;
    this.root.querySelector(".legend").replaceChildren(...all.map(([fill, text, form]) => {
      const node = draw("svg", { width: 14, height: 14, viewBox: "0 0 14 14", "aria-hidden": "true" });
      if (form === "band") node.append(draw("rect", { width: 14, height: 14, fill }));
      else if (form === "cross") node.append(draw("path", { d: "M2 2L12 12M2 12L12 2", stroke: fill, "stroke-width": 2.5 }));
      else node.append(draw("circle", { cx: 7, cy: 7, r: 5, fill: form === "ring" ? "none" : fill, stroke: fill, "stroke-width": 2.5 }));
      return make("small", {}, node, " ", text);
    }));
  }
}
