// Draws what acts on the blocks from outside, on a drawing's canvas.
class LoadDrawing {
  constructor(drawing) { this.drawing = drawing; }

  // Draws arrows of loads and driven bodies, round ones of moments, and in the corner what acts on all blocks.
  draw(frame) {
    const { context, ratio, colours, view, frames } = this.drawing;
    const { arrows, turns, marks } = frames.loads;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    for (const { colour: name, count, x0, y0, x1, y1 } of arrows) {
      const path = new Path2D();
      for (let at = frame * count; at < (frame + 1) * count; at += 1) {
        this.drawing.traceArrow(path, ...view.toPixels(x0[at], y0[at]), ...view.toPixels(x1[at], y1[at]));
      }
      this.strokeTwice(path, colours[name]);
    }
    const round = new Path2D();
    for (let turn = 0; turn < (turns?.radius.length ?? 0); turn += 1) this.traceTurn(round, turns, frame * turns.radius.length + turn, turns.radius[turn]);
    this.strokeTwice(round, colours.load);
    let left = 10;
    for (const [text, dx, dy] of marks[frame]) left = this.drawMark(text, dx, dy, left);
  }

  // Strokes a path above a light line that keeps it apart from what lies below.
  strokeTwice(path, ink) {
    const { context, colours } = this.drawing;
    for (const [width, style] of [[4, colours.stage], [1.8, ink]]) {
      context.lineWidth = width;
      context.strokeStyle = style;
      context.stroke(path);
    }
  }

  // A round arrow about the centre of a block, open at the right.
  traceTurn(path, { x, y, sweep }, at, radius) {
    if (Math.abs(sweep[at]) < 0.02) return;
    const { view } = this.drawing;
    const [px, py] = view.toPixels(x[at], y[at]);
    const size = radius * view.scale;
    const begin = Math.sign(sweep[at]) * 0.25 * Math.PI + Math.atan2(view.sin, view.cos);
    const end = begin + sweep[at];
    const place = (angle, reach) => [px + reach * Math.cos(angle), py - reach * Math.sin(angle)];
    path.moveTo(...place(begin, size));
    path.arc(px, py, size, -begin, -end, sweep[at] > 0);
    const back = end - Math.sign(sweep[at]) * Math.min(0.4, Math.abs(sweep[at]));
    for (const share of [0.75, 1.25]) {
      path.moveTo(...place(end, size));
      path.lineTo(...place(back, share * size));
    }
  }

  drawMark(text, dx, dy, left) {
    const { context, colours } = this.drawing;
    const [x, y] = [left + 9, 14];
    const path = new Path2D();
    this.drawing.traceArrow(path, x - 9 * dx, y + 9 * dy, x + 9 * dx, y - 9 * dy);
    this.strokeTwice(path, colours.load);
    context.font = "13px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.lineWidth = 4;
    context.strokeStyle = colours.stage;
    context.strokeText(text, left + 24, y);
    context.fillStyle = colours.load;
    context.fillText(text, left + 24, y);
    return left + 24 + context.measureText(text).width + 16;
  }
}
