// Charts of x, y, rotation and energies over time, with a cursor at the player's time.
const SVG = "http://www.w3.org/2000/svg";
const MOST_LINES = 6;
const PLACE = { left: 58, right: 20, top: 8, bottom: 34 };
const DASHES = ["", "7 3", "2 3", "9 3 2 3", "12 4", "3 6"];
const PALE = "#F0E442"; // drawn on a darker line
const LEAST_SPAN = 0.05; // mm or degrees: no axis shows less, so that round-off looks flat
const LEAST_SHARE = 4e-4; // of the largest value: nor less than that, so that numbers along it differ
// An energy looks the same in every report; dashes tell apart what is alike in grey.
const ENERGIES = {
  "kinetic": { colour: "#3D8FD1", dash: "" },
  "potential − minimum": { colour: "#E69F00", dash: "" },
  "stored, normal": { colour: "#CC79A7", dash: "2 3" },
  "stored, shear": { colour: "#CC79A7", dash: "9 3 2 3" },
  "lost in dashpots": { colour: "#8A63B8", dash: "9 3 2 3" },
  "lost in friction": { colour: "#009E73", dash: "7 3" },
  "lost as contacts broke": { colour: "#8A63B8", dash: "2 3" },
  "lost in impacts": { colour: "#8A63B8", dash: "7 3" },
  "correction of positions": { colour: "#8C8C8C", dash: "2 3" },
  "given to the support": { colour: "#56B4E9", dash: "3 6" },
  "given to loads": { colour: "#A50026", dash: "3 6" },
  "taken by events": { colour: "#8C8C8C", dash: "7 3" },
};
// What the potential energy is measured from means nothing, and would hide all other energies.
const fromMinimum = ([name, values]) => {
  if (name !== "potential") return [name, values];
  const least = values.reduce((low, value) => (Number.isFinite(value) ? Math.min(low, value) : low), Infinity);
  return ["potential − minimum", values.map((value) => value - least)];
};
const OTHER = { colour: "#8C8C8C", dash: "" };

const draw = (name, attributes, text) => {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
};

class Chart {
  constructor(caption, player) {
    this.player = player;
    this.svg = draw("svg", { role: "img", "aria-label": `${caption} over time` });
    this.figure = make("figure", { class: "chart" }, make("figcaption", {}, caption), this.svg);
    const scrub = (event) => {
      const share = (event.offsetX - PLACE.left) / (this.width - PLACE.left - PLACE.right);
      const [first, last] = this.span();
      player.pause();
      player.show(player.frames.at(first + share * (last - first) + 1e-9));
    };
    this.svg.addEventListener("pointerdown", (event) => { this.svg.setPointerCapture(event.pointerId); scrub(event); });
    this.svg.addEventListener("pointermove", (event) => { if (event.buttons) scrub(event); });
  }

  span() {
    const { time } = this.player.frames;
    return [time[0], time[time.length - 1]];
  }

  across(time) {
    const [first, last] = this.span();
    return PLACE.left + (this.width - PLACE.left - PLACE.right) * (time - first) / (last - first || 1);
  }

  // Draws lines: { value: (frame) => number, colour, dash, measured }; an axis shows at least `span`.
  draw(lines, span = 0) {
    this.width = this.svg.clientWidth;
    this.height = this.svg.clientHeight;
    if (!this.width || matchMedia("print").matches) return;
    const { frames } = this.player;
    const values = lines.map(({ value }) => Array.from({ length: frames.count }, (_, frame) => value(frame)));
    const ranges = lines.flatMap(({ measured }) => (measured ? [measured.minimum, measured.maximum] : []));
    const finite = [...values.flat(), ...ranges].filter(Number.isFinite);
    let [low, high] = finite.length ? [finite.reduce((a, b) => Math.min(a, b)), finite.reduce((a, b) => Math.max(a, b))] : [0, 1];
    const least = Math.max(span, 1e-12, LEAST_SHARE * Math.max(Math.abs(low), Math.abs(high)));
    const more = Math.max(0.04 * (high - low), 0.5 * (least - (high - low)));
    low -= more;
    high += more;
    const up = (value) => this.height - PLACE.bottom - (this.height - PLACE.bottom - PLACE.top) * (value - low) / (high - low);
    this.svg.setAttribute("viewBox", `0 0 ${this.width} ${this.height}`);
    this.svg.replaceChildren(...this.axes(low, high, up));
    values.forEach((row, line) => {
      const path = row.map((value, frame) => (Number.isFinite(value) ? `${this.across(frames.time[frame]).toFixed(1)},${up(value).toFixed(1)}` : "")).filter(Boolean);
      if (!path.length) return;
      const d = `M${path.join("L")}`;
      if (lines[line].colour === PALE) this.svg.append(draw("path", { d, class: "casing" }));
      this.svg.append(draw("path", { d, stroke: lines[line].colour, "stroke-dasharray": lines[line].dash ?? "" }));
    });
    for (const { measured } of lines) if (measured) this.svg.append(...this.range(measured, up));
    this.cursor = draw("line", { class: "cursor", y1: PLACE.top, y2: this.height - PLACE.bottom });
    this.svg.append(this.cursor);
    this.moveCursor();
  }

  // Mean and range of the repeats, right of the end of the curves.
  range({ minimum, mean, maximum }, up) {
    const x = this.width - PLACE.right + 10;
    const line = (attributes) => draw("line", { class: "measured", ...attributes });
    return [
      line({ x1: x, x2: x, y1: up(minimum), y2: up(maximum) }),
      ...[minimum, maximum].map((end) => line({ x1: x - 4, x2: x + 4, y1: up(end), y2: up(end) })),
      draw("circle", { class: "measured", cx: x, cy: up(mean), r: 3 }),
    ];
  }

  axes(low, high, up) {
    const nodes = [];
    const right = this.width - PLACE.right;
    for (const tick of ticks(low, high, 4)) {
      nodes.push(draw("line", { class: "axis", x1: PLACE.left, x2: right, y1: up(tick), y2: up(tick) }));
      nodes.push(draw("text", { x: PLACE.left - 6, y: up(tick) + 4, "text-anchor": "end" }, brief(tick)));
    }
    const [first, last] = this.span();
    for (const tick of ticks(first, last, Math.max(2, Math.floor(this.width / 75)))) {
      nodes.push(draw("text", { x: this.across(tick), y: this.height - PLACE.bottom + 15, "text-anchor": "middle" }, brief(tick)));
    }
    nodes.push(draw("text", { x: right, y: this.height - 3, "text-anchor": "end" }, "time (s)"));
    return nodes;
  }

  moveCursor() {
    const x = this.across(this.player.frames.time[this.player.frame]);
    this.cursor?.setAttribute("x1", x);
    this.cursor?.setAttribute("x2", x);
  }
}

class Histories {
  constructor(root, player) {
    this.root = root;
    this.player = player;
    const { frames } = player;
    this.blocks = frames.byWay().filter((block) => !frames.scene.fixed[block]).slice(0, MOST_LINES).sort((one, other) => one - other);
    this.channels = [["x", "x (mm)"], ["y", "y (mm)"], ["rotation", "rotation (°)"]].map(([name, caption]) => [name, new Chart(caption, player)]);
    this.energy = new Chart("energies (J)", player);
    this.legend = make("div", { class: "legend" });
    this.energy.figure.append(this.legend);
    const charts = root.querySelector(".charts");
    charts.append(...this.channels.map(([, chart]) => chart.figure), this.energy.figure);
    this.fillSelect();
    player.onFrame({ frame: () => this.all((chart) => chart.moveCursor()), chosen: (block) => this.add(block) });
    new ResizeObserver(() => this.draw()).observe(charts);
    onTheme(() => this.draw());
  }

  all(call) { [...this.channels.map(([, chart]) => chart), this.energy].forEach(call); }

  fillSelect() {
    const select = this.root.querySelector("[data-option=block]");
    select.append(make("option", { value: "" }, "choose …"));
    this.player.frames.names.forEach((name, block) => select.append(make("option", { value: block }, name.length > 40 ? `${name.slice(0, 40)}…` : name)));
    select.addEventListener("change", () => { if (select.value !== "") this.add(Number(select.value)); select.value = ""; });
  }

  add(block) {
    if (this.blocks.includes(block)) return;
    this.blocks = [...this.blocks.slice(this.blocks.length >= MOST_LINES ? 1 : 0), block];
    this.draw();
  }

  remove(block) {
    this.blocks = this.blocks.filter((other) => other !== block);
    this.draw();
  }

  styleOf(block) {
    const place = this.blocks.indexOf(block);
    const { colours } = this.player.frames.scene;
    const same = this.blocks.slice(0, place).filter((other) => other % colours.length === block % colours.length).length;
    return { colour: colours[block % colours.length], dash: DASHES[same % DASHES.length] };
  }

  draw() {
    const { frames } = this.player;
    for (const [name, chart] of this.channels) {
      chart.draw(this.blocks.map((block) => ({
        ...this.styleOf(block), value: (frame) => frames[name][frame * frames.blocks + block], measured: frames.measuredOf(name, block),
      })), LEAST_SPAN);
    }
    this.drawChips();
    this.drawEnergies();
  }

  drawChips() {
    const { frames } = this.player;
    this.root.querySelector(".chips").replaceChildren(...this.blocks.map((block) => {
      const chip = make("button", { type: "button", class: "chip", "aria-label": `Remove block ${frames.names[block]}`, title: "Remove" },
        this.swatch(this.styleOf(block)), isolated(frames.names[block]), "×");
      chip.addEventListener("click", () => this.remove(block));
      return chip;
    }));
  }

  drawEnergies() {
    const found = this.player.frames.energy.map(fromMinimum).filter(([, values]) => values.some((value) => Math.abs(value) > 0));
    const largest = (values) => values.reduce((most, value) => (Number.isFinite(value) ? Math.max(most, Math.abs(value)) : most), 0);
    const top = Math.max(...found.map(([, values]) => largest(values)));
    const seen = found.filter(([, values]) => largest(values) > 2e-3 * top);
    const styles = seen.map(([name]) => ENERGIES[name] ?? OTHER);
    this.energy.draw(seen.map(([, values], place) => ({ ...styles[place], value: (frame) => values[frame] })));
    this.legend.replaceChildren(...seen.map(([name], place) => make("small", {}, this.swatch(styles[place]),  ` ${name}`)));
  }

  swatch({ colour: stroke, dash }) {
    const line = draw("svg", { width: 22, height: 10, "aria-hidden": "true" });
    if (stroke === PALE) line.append(draw("line", { x1: 0, x2: 22, y1: 5, y2: 5, stroke: "#8C8C8C", "stroke-width": 5 }));
    line.append(draw("line", { x1: 0, x2: 22, y1: 5, y2: 5, stroke, "stroke-width": 3, "stroke-dasharray": dash }));
    line.style.cssText = "display: inline-block; width: 22px; height: 10px; flex: none";
    return line;
  }
}
