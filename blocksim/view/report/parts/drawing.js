// Draws one frame.
const FEW_ARROWS = 400;
const LEAST_NAME = 9; // px
const MOST_LETTERS = 24; // of a name

class Drawing {
  constructor(canvas, frames) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.frames = frames;
    this.view = new View(frames.scene.extent, frames.scene.tilt);
    this.groups = this.grouped();
    this.widths = []; // of names at their least size, px
    this.loads = new LoadDrawing(this);
    this.takeColours();
  }

  takeColours() {
    this.colours = Object.fromEntries(["stage", "ground", "edge", "ink", "faint", "link", "measured", "load"].map((name) => [name, colour(name)]));
  }

  fillOf(block) {
    const { fixed, colours } = this.frames.scene;
    return fixed[block] ? null : colours[block % colours.length];
  }

  grouped() {
    const groups = new Map();
    this.frames.names.forEach((_, block) => {
      const fill = this.fillOf(block);
      groups.set(fill, [...(groups.get(fill) ?? []), block]);
    });
    return groups;
  }

  resize() {
    const width = this.canvas.clientWidth;
    if (!width) return;
    const [left, right, bottom, top] = this.frames.scene.extent;
    const height = Math.round(Math.min(Math.max(width * (top - bottom) / (right - left) + 18, 160), Math.max(0.62 * innerHeight, 240)));
    this.canvas.style.height = `${height}px`;
    this.ratio = devicePixelRatio || 1;
    this.canvas.width = Math.round(width * this.ratio);
    this.canvas.height = Math.round(height * this.ratio);
    if (this.view.isFitted || !this.view.scale) this.view.fit(width, height);
  }

  draw(frame, options, marked) {
    const { context, colours, view, ratio } = this;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = colours.stage;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.drawSupport(frame);
    for (const system of this.frames.systems) this.drawSystem(system, frame, system.shades[options.shade]);
    this.drawBlocks(frame);
    if (options.trails) this.drawTrails();
    if (options.particles) this.drawParticles(frame);
    if (options.names) this.drawNames(frame);
    if (options.loads) this.loads.draw(frame);
    if (options.forces) this.drawForces(frame);
    if (options.measured) this.drawMeasured(frame);
    if (marked >= 0) this.drawMark(frame, marked);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawScale(view.scale);
  }

  drawSupport(frame) {
    const { context, colours, view } = this;
    const { ground } = this.frames.scene;
    const [dx, dy] = this.frames.offset(frame);
    view.apply(context, this.ratio, dx, dy);
    const depth = 1e3 * (this.canvas.height / view.scale);
    context.beginPath();
    for (const [x, y] of ground) context.lineTo(x, y);
    context.lineTo(ground[ground.length - 1][0], -depth);
    context.lineTo(ground[0][0], -depth);
    context.fillStyle = colours.ground;
    context.fill();
    context.beginPath();
    for (const [x, y] of ground) context.lineTo(x, y);
    for (const [x0, y0, x1, y1] of this.frames.walls(frame)) {
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
    }
    context.strokeStyle = colours.faint;
    context.lineWidth = 1.5 / view.scale;
    context.stroke();
  }

  // Draws the elements of a system below the blocks, in one path a colour. Those without a shape of their own have all corners.
  drawSystem({ colour: fill, count, corners, palette, shape, x, y }, frame, shade) {
    const { context, ratio, view } = this;
    const fills = shade ? palette : [fill];
    const paths = fills.map(() => new Path2D());
    for (let element = 0; element < count; element += 1) {
      const at = frame * count + element;
      const level = shade ? Math.floor(fills.length * shade.values[at] / shade.high) : 0;
      const path = paths[Math.min(Math.max(level || 0, 0), fills.length - 1)];
      for (let corner = 0; corner < corners; corner += 1) {
        const place = shape ? 2 * ((shape.length > 2 * corners ? element * corners : 0) + corner) : at * corners + corner;
        const [px, py] = shape ? view.toPixels(x[at] + shape[place], y[at] + shape[place + 1]) : view.toPixels(x[place], y[place]);
        if (corner) path.lineTo(px, py);
        else path.moveTo(px, py);
      }
      path.closePath();
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    paths.forEach((path, level) => {
      context.fillStyle = fills[level];
      context.fill(path);
    });
  }

  // Draws all blocks: one path for each colour and one for all edges, which takes half the time of a path for each.
  drawBlocks(frame) {
    const { context, ratio, colours } = this;
    this.takeCorners(frame);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.lineWidth = 1;
    context.strokeStyle = colours.edge;
    for (const [fill, blocks] of this.groups) {
      const path = new Path2D();
      for (const block of blocks) if (this.frames.isThere(frame, block)) this.trace(path, block);
      context.fillStyle = fill ?? colours.ground;
      context.fill(path);
      if (this.isClear) context.stroke(path);
    }
    if (this.isClear) this.drawUpperSides(frame);
  }

  // Keeps centre and a millimetre of every block in pixels, as vectors along its own axes.
  takeCorners(frame) {
    const { frames, view } = this;
    this.places ??= new Float64Array(6 * frames.blocks);
    let smallest = Infinity;
    for (let block = 0; block < frames.blocks; block += 1) {
      const at = frame * frames.blocks + block;
      const angle = frames.angle(frame, block);
      const cos = Math.cos(angle) * view.cos - Math.sin(angle) * view.sin;
      const sin = Math.sin(angle) * view.cos + Math.cos(angle) * view.sin;
      const [px, py] = view.toPixels(frames.x[at], frames.y[at]);
      this.places.set([px, py, cos * view.scale, -sin * view.scale, -sin * view.scale, -cos * view.scale], 6 * block);
      smallest = Math.min(smallest, 0.5 * frames.widthOf(block) * view.scale);
    }
    this.isClear = smallest >= 2.5;
  }

  trace(path, block) {
    const [px, py, ax, ay, bx, by] = this.places.subarray(6 * block, 6 * block + 6);
    const at = ([x, y]) => [px + x * ax + y * bx, py + x * ay + y * by];
    const [first, ...corners] = this.frames.cornersOf(block);
    path.moveTo(...at(first));
    for (const corner of corners) path.lineTo(...at(corner));
    path.closePath();
  }

  // A line along every block's own upper side shows turns.
  drawUpperSides(frame) {
    const { context, frames, places } = this;
    const path = new Path2D();
    let widest = 0;
    for (let block = 0; block < frames.blocks; block += 1) {
      if (!frames.isThere(frame, block)) continue;
      const [px, py, ax, ay, bx, by] = places.subarray(6 * block, 6 * block + 6);
      const smaller = 0.5 * frames.widthOf(block) * this.view.scale;
      widest = Math.max(widest, smaller);
      const [[x0, y0], [x1, y1]] = frames.upperOf(block);
      path.moveTo(px + x0 * ax + y0 * bx, py + x0 * ay + y0 * by);
      path.lineTo(px + x1 * ax + y1 * bx, py + x1 * ay + y1 * by);
    }
    context.lineWidth = Math.max(0.05 * widest, 0.6);
    context.stroke(path);
  }

  // The ways of all centres over the whole run, one path in mm, without the places where nothing moves.
  trails() {
    const { frames } = this;
    const [left, right] = frames.scene.extent;
    const least = 2e-3 * (right - left);
    const path = new Path2D();
    for (let block = 0; block < frames.blocks; block += 1) {
      let [x, y] = [frames.x[block], frames.y[block]];
      path.moveTo(x, y);
      for (let at = block; at < frames.x.length; at += frames.blocks) {
        if (Math.hypot(frames.x[at] - x, frames.y[at] - y) < least) continue;
        [x, y] = [frames.x[at], frames.y[at]];
        path.lineTo(x, y);
      }
    }
    return path;
  }

  drawTrails() {
    this.path ??= this.trails();
    this.view.apply(this.context, this.ratio);
    this.context.strokeStyle = this.colours.ink;
    this.context.globalAlpha = 0.55;
    this.context.lineWidth = 1 / this.view.scale;
    this.context.stroke(this.path);
    this.context.globalAlpha = 1;
  }

  drawParticles(frame) {
    const { context, frames, view } = this;
    const { outlines, which } = frames.scene.particles;
    const size = Math.max(2.5 / view.scale, 0.25);
    context.fillStyle = this.colours.ink;
    for (let block = 0; block < frames.blocks; block += 1) {
      if (!frames.isThere(frame, block)) continue;
      const at = frames.blocks * frame + block;
      view.apply(context, this.ratio, frames.x[at], frames.y[at], frames.angle(frame, block));
      for (const [x, y] of outlines[which[block]]) context.fillRect(x - 0.5 * size, y - 0.5 * size, size, size);
    }
  }

  // Writes all names; where one has no room on its block, its size stays readable and a margin parts it from what is below.
  drawNames(frame) {
    const { context, frames, view, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineJoin = "round";
    context.lineWidth = 3;
    for (let block = 0; block < frames.blocks; block += 1) {
      if (!frames.isThere(frame, block)) continue;
      const { text, size, fits } = this.nameOf(block);
      context.font = `${size}px system-ui, sans-serif`;
      const [x, y] = view.toPixels(frames.x[frames.blocks * frame + block], frames.y[frames.blocks * frame + block]);
      const fill = this.fillOf(block);
      context.fillStyle = fill === "#0072B2" ? "#ffffff" : fill ? "#222222" : this.colours.ink;
      context.strokeStyle = fill ?? this.colours.ground;
      if (!fits) context.strokeText(text, x, y);
      context.fillText(text, x, y);
    }
  }

  // The name of a block as it is written, its size in pixels, and whether it has room on the block.
  nameOf(block) {
    const { context, frames, view } = this;
    const name = frames.names[block];
    const text = name.length > MOST_LETTERS ? `${name.slice(0, MOST_LETTERS - 1)}…` : name;
    const room = 0.85 * view.scale * frames.widthOf(block);
    const wanted = Math.min(0.6 * room, 18);
    context.font = `${LEAST_NAME}px system-ui, sans-serif`;
    const most = LEAST_NAME * room / (this.widths[block] ??= context.measureText(text).width);
    return { text, size: Math.max(Math.min(wanted, most), LEAST_NAME), fits: Math.min(wanted, most) >= LEAST_NAME };
  }

  // Whether most names have room on their blocks, so that they are written without being asked for.
  haveNamesRoom() {
    const fitting = this.frames.names.filter((_, block) => this.nameOf(block).fits);
    return 2 * fitting.length >= this.frames.names.length;
  }

  // Draws an arrow for every contact in pixels, all in one path. Few get a light line around them, which
  // takes time; many get paler blocks below.
  drawForces(frame) {
    const { context, ratio, colours } = this;
    const [first, last] = this.frames.contactsOf(frame);
    const path = new Path2D();
    for (let at = first; at < last; at += 1) this.traceForce(path, at);
    const few = last - first <= FEW_ARROWS;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (!few) {
      context.globalAlpha = 0.55;
      context.fillStyle = colours.stage;
      context.fillRect(0, 0, this.canvas.width / ratio, this.canvas.height / ratio);
      context.globalAlpha = 1;
    }
    for (const [width, ink] of few ? [[4, colours.stage], [1.6, colours.ink]] : [[1, colours.ink]]) {
      context.lineWidth = width;
      context.strokeStyle = ink;
      context.stroke(path);
    }
  }

  traceForce(path, at) {
    const { view } = this;
    const { x, y, fx, fy, scale, longest } = this.frames.forces;
    const force = Math.hypot(fx[at], fy[at]);
    const reach = view.scale * Math.min(scale * force, longest);
    if (!(reach > 1)) return;
    const [px, py] = view.toPixels(x[at], y[at]);
    const ux = (view.cos * fx[at] - view.sin * fy[at]) / force;
    const uy = -(view.sin * fx[at] + view.cos * fy[at]) / force;
    this.traceArrow(path, px, py, px + reach * ux, py + reach * uy);
  }

  // Adds an arrow between two places (pixels) to a path.
  traceArrow(path, px, py, ex, ey) {
    const reach = Math.hypot(ex - px, ey - py);
    if (!(reach > 1)) return;
    const [ux, uy] = [(ex - px) / reach, (ey - py) / reach];
    path.moveTo(px, py);
    path.lineTo(ex, ey);
    const head = Math.min(6, 0.5 * reach);
    if (head < 2) return;
    path.moveTo(ex - head * (ux - 0.5 * uy), ey - head * (uy + 0.5 * ux));
    path.lineTo(ex, ey);
    path.lineTo(ex - head * (ux + 0.5 * uy), ey - head * (uy - 0.5 * ux));
  }

  // Draws mean and range of the measured centres within the ground, and a tick below every centre that was measured.
  drawMeasured(frame) {
    const { context, frames, ratio, colours } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.lineWidth = 2;
    for (const { block, quantity, minimum, mean, maximum } of frames.measured) {
      if (quantity !== "x") continue;
      const [left, middle, right] = [minimum, mean, maximum].map((x) => this.belowGround(x));
      context.strokeStyle = colours.measured;
      context.fillStyle = colours.measured;
      context.beginPath();
      context.moveTo(...left);
      context.lineTo(...right);
      for (const [px, py] of [left, right]) {
        context.moveTo(px, py - 4);
        context.lineTo(px, py + 4);
      }
      context.stroke();
      context.beginPath();
      context.arc(...middle, 3, 0, 2 * Math.PI);
      context.fill();
      const [px, py] = this.belowGround(frames.x[frame * frames.blocks + block]);
      context.strokeStyle = colours.ink;
      context.beginPath();
      context.moveTo(px, py - 8);
      context.lineTo(px, py - 3);
      context.stroke();
    }
  }

  // Where a mark for a place along the ground stands (pixels).
  belowGround(x) {
    const [px, py] = this.view.toPixels(x, this.frames.groundAt(x));
    return [px, py + 8];
  }

  drawMark(frame, block) {
    const { context, frames, view } = this;
    if (!frames.isThere(frame, block)) return;
    const at = frames.blocks * frame + block;
    view.apply(context, this.ratio, frames.x[at], frames.y[at], frames.angle(frame, block));
    context.strokeStyle = this.colours.link;
    context.lineWidth = 3 / view.scale;
    context.beginPath();
    for (const [x, y] of frames.cornersOf(block)) context.lineTo(x, y);
    context.closePath();
    context.stroke();
  }

  drawScale(scale) {
    const { context, colours } = this;
    const length = roundBelow(160 / scale);
    const y = this.canvas.height / this.ratio - 6;
    context.fillStyle = colours.ink;
    context.fillRect(10, y - 2, length * scale, 2);
    context.font = "11px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    context.fillText(`${brief(length)} mm`, 14 + length * scale, y + 1);
  }
}
