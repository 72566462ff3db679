// Draws one frame. Blocks are filled colour by colour, so that a thousand of them stay quick.
class Drawing {
  constructor(canvas, frames) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.frames = frames;
    this.view = new View(frames.scene.extent, frames.scene.tilt);
    this.groups = this.grouped();
    this.takeColours();
  }

  takeColours() {
    this.colours = Object.fromEntries(["stage", "ground", "edge", "ink", "faint", "link"].map((name) => [name, colour(name)]));
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
    for (const [fill, blocks] of this.groups) this.drawBlocks(frame, blocks, fill ?? colours.ground);
    if (options.trails) this.drawTrails();
    if (options.particles) this.drawParticles(frame);
    if (options.names) this.drawNames(frame);
    if (marked >= 0) this.drawMark(frame, marked);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.drawScale(view.scale);
  }

  drawSupport(frame) {
    const { context, colours, view } = this;
    const { ground, walls } = this.frames.scene;
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
    for (const [x0, y0, x1, y1] of walls) {
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
    }
    context.strokeStyle = colours.faint;
    context.lineWidth = 1.5 / view.scale;
    context.stroke();
  }

  drawBlocks(frame, blocks, fill) {
    const { context, frames, view, ratio } = this;
    const base = frames.blocks * frame;
    const isClear = view.scale * Math.min(frames.sizeX[blocks[0]], frames.sizeY[blocks[0]]) >= 5;
    context.fillStyle = fill;
    context.strokeStyle = this.colours.edge;
    context.lineWidth = 1 / view.scale;
    for (const block of blocks) {
      const width = frames.sizeX[block];
      const height = frames.sizeY[block];
      view.apply(context, ratio, frames.x[base + block], frames.y[base + block], frames.angle(frame, block));
      context.fillRect(-0.5 * width, -0.5 * height, width, height);
      if (!isClear) continue;
      context.strokeRect(-0.5 * width, -0.5 * height, width, height);
      // a line along the block's own upper side shows turns
      const inset = 0.07 * Math.min(width, height);
      context.fillStyle = this.colours.edge;
      context.fillRect(inset - 0.5 * width, 0.5 * height - 1.4 * inset, width - 2 * inset, 0.4 * inset);
      context.fillStyle = fill;
    }
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
      const at = frames.blocks * frame + block;
      view.apply(context, this.ratio, frames.x[at], frames.y[at], frames.angle(frame, block));
      for (const [x, y] of outlines[which[block]]) context.fillRect(x - 0.5 * size, y - 0.5 * size, size, size);
    }
  }

  drawNames(frame) {
    const { context, frames, view, ratio } = this;
    const room = (block) => 0.85 * view.scale * Math.min(frames.sizeX[block], frames.sizeY[block]);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (let block = 0; block < frames.blocks; block += 1) {
      const size = Math.min(0.6 * room(block), 18);
      if (size < 8 || frames.names[block].length > 24) continue;
      context.font = `${size}px system-ui, sans-serif`;
      if (context.measureText(frames.names[block]).width > room(block)) continue;
      const [x, y] = view.toPixels(frames.x[frames.blocks * frame + block], frames.y[frames.blocks * frame + block]);
      const fill = this.fillOf(block);
      context.fillStyle = fill === "#0072B2" ? "#ffffff" : fill ? "#222222" : this.colours.ink;
      context.fillText(frames.names[block], x, y);
    }
  }

  drawMark(frame, block) {
    const { context, frames, view } = this;
    const at = frames.blocks * frame + block;
    view.apply(context, this.ratio, frames.x[at], frames.y[at], frames.angle(frame, block));
    context.strokeStyle = this.colours.link;
    context.lineWidth = 3 / view.scale;
    context.strokeRect(-0.5 * frames.sizeX[block], -0.5 * frames.sizeY[block], frames.sizeX[block], frames.sizeY[block]);
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
