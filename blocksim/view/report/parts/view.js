// Which part of the scene the canvas shows: pixels = origin + scale * turned millimetres, y up.
class View {
  constructor(extent, tilt) {
    this.extent = extent;
    this.cos = Math.cos(tilt);
    this.sin = Math.sin(tilt);
    this.isFitted = true;
  }

  fit(width, height) {
    const [left, right, bottom, top] = this.extent;
    const below = 18;
    this.scale = Math.min(width / (right - left), (height - below) / (top - bottom));
    this.x0 = 0.5 * width - 0.5 * this.scale * (left + right);
    this.y0 = height - below + this.scale * bottom;
    this.isFitted = true;
  }

  toPixels(x, y) {
    return [this.x0 + this.scale * (this.cos * x - this.sin * y), this.y0 - this.scale * (this.sin * x + this.cos * y)];
  }

  toScene(px, py) {
    const u = (px - this.x0) / this.scale;
    const v = (this.y0 - py) / this.scale;
    return [this.cos * u + this.sin * v, this.cos * v - this.sin * u];
  }

  // Sets a context to a block's (or the scene's) own axes in mm.
  apply(context, ratio, x = 0, y = 0, angle = 0) {
    const scale = this.scale * ratio;
    const cos = Math.cos(angle) * this.cos - Math.sin(angle) * this.sin;
    const sin = Math.sin(angle) * this.cos + Math.cos(angle) * this.sin;
    const [px, py] = this.toPixels(x, y);
    context.setTransform(scale * cos, -scale * sin, -scale * sin, -scale * cos, px * ratio, py * ratio);
  }

  zoom(factor, px, py) {
    const next = Math.min(Math.max(this.scale * factor, 1e-3), 1e4);
    const change = next / this.scale;
    this.x0 = px + (this.x0 - px) * change;
    this.y0 = py + (this.y0 - py) * change;
    this.scale = next;
    this.isFitted = false;
  }

  move(dx, dy) {
    this.x0 += dx;
    this.y0 += dy;
    this.isFitted = false;
  }
}
