// The frames of one run: n moments of b blocks, in mm and degrees.
class Frames {
  constructor(data) {
    this.names = data.names;
    this.scene = data.scene;
    this.measured = data.measured ?? [];
    this.outlines = data.outlines;
    this.startAngle = data.start_angle;
    this.time = decode(data.time);
    for (const [name, part] of Object.entries(data.channels)) this[name] = decode(part);
    this.systems = data.systems.map((one) => ({ ...one, x: decode(one.x), y: decode(one.y), shape: one.shape && decode(one.shape), shades: (one.shades ?? []).map((shade) => ({ ...shade, values: decode(shade.values) })) }));
    this.loads = data.loads && {
      ...data.loads,
      arrows: data.loads.arrows.map((one) => ({ ...one, ...Object.fromEntries(["x0", "y0", "x1", "y1"].map((name) => [name, decode(one[name])])) })),
      turns: data.loads.turns && { ...data.loads.turns, ...Object.fromEntries(["x", "y", "sweep"].map((name) => [name, decode(data.loads.turns[name])])) },
    };
    this.forces = data.forces && { ...data.forces, ...Object.fromEntries(["x", "y", "fx", "fy"].map((name) => [name, decode(data.forces[name])])) };
  }

  // Height of the ground at rest (mm).
  groundAt(x) {
    const { ground } = this.scene;
    const next = ground.findIndex(([place]) => place > x);
    if (next < 1) return ground[next < 0 ? ground.length - 1 : 0][1];
    const [[x0, y0], [x1, y1]] = [ground[next - 1], ground[next]];
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0 || 1);
  }

  get count() { return this.time.length; }

  get blocks() { return this.names.length; }

  // Angle of a block's own axes in rad.
  angle(frame, block) {
    return (this.rotation[frame * this.blocks + block] + this.startAngle[block]) * Math.PI / 180;
  }

  // Whether an event has not yet removed a block.
  isThere(frame, block) { return frame < (this.scene.gone[block] ?? Infinity); }

  // The walls that no event has removed yet.
  walls(frame) { return this.scene.walls.filter((_, wall) => frame < (this.scene.walls_gone[wall] ?? Infinity)); }

  offset(frame) { return this.scene.offset ? this.scene.offset[frame] : [0, 0]; }

  // From which to before which contact those of a frame are.
  contactsOf(frame) { return [frame > 0 ? this.forces.ends[frame - 1] : 0, this.forces.ends[frame]]; }

  // The last frame that is not later than a time (s).
  at(time) {
    let low = 0;
    let high = this.count - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  // Corners of a block along its own axes (mm).
  cornersOf(block) { return this.outlines.corners[this.outlines.which[block]]; }

  // Its line along the upper side, from end to end.
  upperOf(block) { return this.outlines.upper[this.outlines.which[block]]; }

  // The least distance of two parallel lines around a block (mm).
  widthOf(block) { return this.outlines.width[this.outlines.which[block]]; }

  // Whether a place along the axes of a block (mm) is in it.
  isIn(block, along, across) {
    const corners = this.cornersOf(block);
    return corners.every(([x, y], index) => {
      const [nextX, nextY] = corners[(index + 1) % corners.length];
      return (nextX - x) * (across - y) - (nextY - y) * (along - x) >= 0;
    });
  }

  // The block at a place (mm), the one drawn last where there are several; -1 where there is none.
  blockAt(frame, x, y) {
    for (let block = this.blocks - 1; block >= 0; block -= 1) {
      if (!this.isThere(frame, block)) continue;
      const dx = x - this.x[frame * this.blocks + block];
      const dy = y - this.y[frame * this.blocks + block];
      const angle = this.angle(frame, block);
      const along = Math.cos(angle) * dx + Math.sin(angle) * dy;
      const across = Math.cos(angle) * dy - Math.sin(angle) * dx;
      if (this.isIn(block, along, across)) return block;
    }
    return -1;
  }
}
