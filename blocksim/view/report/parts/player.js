// Plays the frames of one run on a canvas. Tells every new frame to those who asked by onFrame.
const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5];
const PLAY_SECONDS = 4;
const PRESSES = [" ", "Enter"];
const SCROLLS = [" ", "ArrowLeft", "ArrowRight", "Home", "End"];

class Player {
  constructor(root, data) {
    this.root = root;
    this.frames = new Frames(data);
    this.canvas = root.querySelector(".stage canvas");
    this.drawing = new Drawing(this.canvas, this.frames);
    this.frame = 0;
    this.marked = -1;
    this.pinned = false;
    this.timer = 0;
    this.options = { trails: false, particles: false, forces: false, measured: true, loads: Boolean(this.frames.loads), names: false, shade: 0 };
    this.listeners = [];
    this.chosen = [];
    this.drawing.resize();
    this.options.names = this.drawing.haveNamesRoom();
    this.wireControls();
    this.wirePointer();
    this.wireFocus();
    this.wireView();
    this.show(0);
  }

  onFrame(listener) { this.listeners.push(listener); }

  part(selector) { return this.root.querySelector(selector); }

  wireControls() {
    this.slider = this.part("input[type=range]");
    this.slider.max = this.frames.count - 1;
    this.slider.addEventListener("input", () => { this.pause(); this.show(Number(this.slider.value)); });
    for (const button of this.root.querySelectorAll(".player [data-act]")) {
      button.addEventListener("click", () => this.act(button.dataset.act));
    }
    this.speed = this.part("[data-option=speed]");
    const wanted = (this.frames.time[this.frames.count - 1] - this.frames.time[0]) / PLAY_SECONDS;
    const best = SPEEDS.reduce((one, other) => (Math.abs(Math.log(other / wanted)) < Math.abs(Math.log(one / wanted)) ? other : one));
    for (const speed of SPEEDS) this.speed.append(make("option", { value: speed, ...(speed === best && { selected: "" }) }, `${speed} ×`));
    this.speed.addEventListener("change", () => this.restartClock());
    this.wireShades();
    for (const name of Object.keys(this.options)) {
      const box = this.part(`[data-option=${name}]`);
      if (!box || name === "shade") continue;
      box.checked = this.options[name];
      box.addEventListener("change", () => { this.options[name] = box.checked; this.redraw(); });
    }
    this.root.addEventListener("keydown", (event) => this.key(event));
  }

  // A control that was clicked leaves the keys to the player; one that Tab has reached keeps them.
  wireFocus() {
    let wasClicked = false;
    const give = (event, controls) => {
      if (wasClicked && event.target.closest(controls)) this.canvas.focus({ preventScroll: true });
    };
    this.root.addEventListener("pointerdown", () => { wasClicked = true; }, true);
    this.root.addEventListener("keydown", () => { wasClicked = false; }, true);
    this.root.addEventListener("click", (event) => give(event, "button, summary"));
    this.root.addEventListener("change", (event) => give(event, "select, input"));
  }

  // What the elements of other systems are coloured by, with the value of the lightest colour.
  wireShades() {
    const select = this.part("[data-option=shade]");
    if (!select) return;
    const { shades } = this.frames.systems.find((system) => system.shades.length);
    shades.forEach(({ label, high }, at) => select.append(make("option", { value: at }, `${label}, up to ${Number(high.toPrecision(3))}`)));
    select.addEventListener("change", () => { this.options.shade = Number(select.value); this.redraw(); });
  }

  wireView() {
    new ResizeObserver(() => { this.fitAnew(); }).observe(this.canvas.parentElement);
    onTheme(() => { this.drawing.takeColours(); this.fitAnew(); });
  }

  fitAnew() {
    if (!matchMedia("print").matches) this.drawing.resize();
    this.redraw();
  }

  wirePointer() {
    const { canvas } = this;
    const down = new Map();
    let way = 0;
    const place = (event) => [event.offsetX, event.offsetY];
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      down.set(event.pointerId, place(event));
      way = 0;
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = down.get(event.pointerId);
      if (!before) { if (event.pointerType === "mouse") this.hover(...place(event)); return; }
      const now = place(event);
      way += Math.hypot(now[0] - before[0], now[1] - before[1]);
      this.drag(down, event.pointerId, before, now);
      down.set(event.pointerId, now);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => {
        if (down.delete(event.pointerId) && name === "pointerup" && way < 5) this.pin(...place(event));
        canvas.classList.remove("dragging");
      });
    }
    canvas.addEventListener("pointerleave", () => { if (!this.pinned) this.mark(-1); });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), ...place(event));
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.act("fit"));
  }

  // One finger moves the view, two zoom it.
  drag(down, id, before, now) {
    this.canvas.classList.add("dragging");
    const other = [...down].find(([key]) => key !== id)?.[1];
    if (other) {
      const apart = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]) || 1;
      this.drawing.view.zoom(apart(now) / apart(before), ...other);
    } else {
      this.drawing.view.move(now[0] - before[0], now[1] - before[1]);
    }
    this.redraw();
  }

  blockAt(px, py) { return this.frames.blockAt(this.frame, ...this.drawing.view.toScene(px, py)); }

  hover(px, py) { if (!this.pinned) this.mark(this.blockAt(px, py)); }

  // A click holds a block's state in view and adds the block to the histories; a click beside all lets it go.
  pin(px, py) {
    const block = this.blockAt(px, py);
    this.pinned = block >= 0;
    this.mark(block);
    if (block >= 0) this.listeners.forEach((listener) => listener.chosen?.(block));
  }

  mark(block) {
    if (block === this.marked) return;
    this.marked = block;
    this.redraw();
  }

  step(count) { this.pause(); this.show(this.frame + count); }

  show(frame) {
    this.frame = Math.min(Math.max(frame, 0), this.frames.count - 1);
    this.slider.value = this.frame;
    this.slider.setAttribute("aria-valuetext", `${shown(this.frames.time[this.frame], 4)} s`);
    this.part("output").textContent = `${shown(this.frames.time[this.frame], 4)} s · frame ${this.frame + 1} of ${this.frames.count}`;
    this.redraw();
    for (const listener of this.listeners) listener.frame?.(this.frame);
  }

  redraw() {
    if (!this.drawing.ratio) this.drawing.resize();
    if (!this.drawing.ratio) return;
    this.drawing.draw(this.frame, this.options, this.marked);
    this.tellState();
  }

  tellState() {
    const { frames, marked } = this;
    const box = this.part(".player .state");
    if (marked < 0) {
      box.replaceChildren(make("small", {}, "Hover, tap or press B: state of a block."));
      return;
    }
    const at = frames.blocks * this.frame + marked;
    const values = !frames.isThere(this.frame, marked) ? ["removed"] : [
      `x ${shown(frames.x[at])} mm`, `y ${shown(frames.y[at])} mm`, `rotation ${shown(frames.rotation[at])}°`,
      `vx ${shown(frames.vx[at], 1)} mm/s`, `vy ${shown(frames.vy[at], 1)} mm/s`, `spin ${shown(frames.spin[at], 1)} °/s`,
    ];
    const head = make("span", {}, make("strong", {}, "block ", isolated(frames.names[marked])), frames.scene.fixed[marked] ? " (fixed)" : "");
    box.replaceChildren(head, ...values.map((text) => make("span", {}, text)));
  }

  play() {
    if (this.frame === this.frames.count - 1) this.show(0);
    this.restartClock();
    this.setPlaying(true);
    this.timer = requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    cancelAnimationFrame(this.timer);
    this.timer = 0;
    this.setPlaying(false);
  }

  setPlaying(playing) {
    const button = this.part("[data-act=play]");
    button.setAttribute("aria-pressed", String(playing));
    button.setAttribute("aria-label", playing ? "Pause" : "Play");
    button.title = playing ? "Pause" : "Play";
  }

  restartClock() { this.clock = null; }

  tick(now) {
    if (!this.timer) return;
    this.clock ??= { started: now, time: this.frames.time[this.frame] };
    const time = this.clock.time + (now - this.clock.started) * 1e-3 * Number(this.speed.value);
    const frame = this.frames.at(time);
    if (frame !== this.frame) this.show(frame);
    if (frame === this.frames.count - 1) this.pause();
    else this.timer = requestAnimationFrame((later) => this.tick(later));
  }

  zoom(factor, px = 0.5 * this.canvas.clientWidth, py = 0.5 * this.canvas.clientHeight) {
    this.drawing.view.zoom(factor, px, py);
    this.redraw();
  }

  fit() {
    this.drawing.view.isFitted = true;
    this.drawing.resize();
    this.redraw();
  }

  shift(dx, dy) { this.drawing.view.move(dx, dy); this.redraw(); }

  toggle(name) { this.part(`[data-option=${name}]`)?.click(); }

  changeSpeed(by) {
    this.speed.selectedIndex = Math.min(Math.max(this.speed.selectedIndex + by, 0), SPEEDS.length - 1);
    this.restartClock();
  }

  walk(by) {
    this.pinned = true;
    this.mark((this.marked + by + (this.marked < 0 && by < 0 ? 1 : 0) + this.frames.blocks) % this.frames.blocks);
  }

  act(name) {
    const acts = {
      play: () => (this.timer ? this.pause() : this.play()),
      first: () => this.step(-this.frames.count),
      back: () => this.step(-1),
      next: () => this.step(1),
      last: () => this.step(this.frames.count),
      in: () => this.zoom(1.25),
      out: () => this.zoom(0.8),
      fit: () => this.fit(),
    };
    acts[name]();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || this.isOwn(event)) return;
    const far = event.shiftKey ? 10 : 1;
    const keys = {
      " ": () => this.act("play"), ArrowLeft: () => this.step(-far), ArrowRight: () => this.step(far),
      Home: () => this.act("first"), End: () => this.act("last"), "[": () => this.changeSpeed(-1), "]": () => this.changeSpeed(1),
      "+": () => this.act("in"), "=": () => this.act("in"), "-": () => this.act("out"), 0: () => this.act("fit"),
      w: () => this.shift(0, 40), a: () => this.shift(40, 0), s: () => this.shift(0, -40), d: () => this.shift(-40, 0),
      b: () => this.walk(1), B: () => this.walk(-1),
      t: () => this.toggle("trails"), n: () => this.toggle("names"), p: () => this.toggle("particles"), f: () => this.toggle("forces"), l: () => this.toggle("loads"),
      "?": () => this.part("details.keys").toggleAttribute("open"),
    };
    const action = keys[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  // Whether what has the focus does something by itself with a key.
  isOwn({ target, key }) {
    const box = target.closest(".wide, pre");
    const canScroll = box && (box.scrollWidth > box.clientWidth || box.scrollHeight > box.clientHeight);
    if (canScroll && SCROLLS.includes(key)) return true;
    return target.closest("select, input[type=search]") || (PRESSES.includes(key) && target.closest("a, button, input[type=checkbox], summary"));
  }

  // What is on the canvas: the frame, and the centres of all blocks in CSS pixels from its upper left corner.
  state() {
    const base = this.frame * this.frames.blocks;
    const centres = this.frames.names.map((_, block) => this.drawing.view.toPixels(this.frames.x[base + block], this.frames.y[base + block]));
    return { frame: this.frame, time: this.frames.time[this.frame], playing: this.timer !== 0, scale: this.drawing.view.scale, centres };
  }
}
