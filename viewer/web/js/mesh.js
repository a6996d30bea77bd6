// SPEC 5.1: a view's reduced mesh from the rectangles of its cover.

// Of a sample: a corner of a rectangle; which quarters of its cell are closed; inside a rectangle.
const kVertex = 1, kClosedAbove = 2 | 4, kClosedBelow = 8 | 16, kClosedLeft = 2 | 8, kClosedRight = 4 | 16, kInner = 32;
const kQuarterOfCorner = [16, 8, 4, 2];
const kFloatsPerVertex = 3, kFloatsPerCell = 5;

// A growing list of floats or whole numbers.
class List {
  constructor(Type) {
    this.values = new Type(1 << 14);
    this.length = 0;
  }
  push(...values) {
    if (this.length + values.length > this.values.length) {
      const longer = new this.values.constructor(2 * this.values.length);
      longer.set(this.values);
      this.values = longer;
    }
    for (const v of values) this.values[this.length++] = v;
  }
  get() {
    return this.values.slice(0, this.length);
  }
}

class MeshMaker {
  constructor(samples) {
    const count = samples.columns * samples.rows;
    this.samples = samples;
    this.state = new Uint8Array(count);
    this.number = new Uint32Array(count);
    this.vertices = new List(Float32Array);
    this.indices = new List(Uint32Array);
    this.cells = new List(Float32Array);
  }

  setState(x, y, state) {
    this.state[y * this.samples.columns + x] |= state;
  }

  mark(r) {
    const right = r.x + r.width, bottom = r.y + r.height;
    for (let k = 0; k < 4; ++k) this.setState(k & 1 ? right : r.x, k >> 1 ? bottom : r.y, kVertex | kQuarterOfCorner[k]);
    for (let x = r.x + 1; x < right; ++x) {
      this.setState(x, r.y, kClosedBelow);
      this.setState(x, bottom, kClosedAbove);
    }
    for (let y = r.y + 1; y < bottom; ++y) {
      this.setState(r.x, y, kClosedRight);
      this.setState(right, y, kClosedLeft);
      const row = y * this.samples.columns;
      this.state.fill(kInner, row + r.x + 1, row + right);
    }
  }

  // The vertices on a rectangle's border, clockwise from its first corner, and where its corners are.
  border(r) {
    const right = r.x + r.width, bottom = r.y + r.height;
    const points = [], corners = [];
    const walk = (x, y, dx, dy, n) => {
      corners.push(points.length);
      for (let i = 0; i < n; ++i, x += dx, y += dy) {
        if (this.state[y * this.samples.columns + x] & kVertex) points.push([x, y]);
      }
    };
    walk(r.x, r.y, 1, 0, r.width);
    walk(right, r.y, 0, 1, r.height);
    walk(right, bottom, -1, 0, r.width);
    walk(r.x, bottom, 0, -1, r.height);
    return { points, corners };
  }

  addRectangle(r) {
    const { points, corners } = this.border(r);
    const n = points.length;
    const at = (i) => points[i % n];
    if (n === 4) {
      const w = (i) => this.samples.at(...at(i));
      const apex = Math.abs(w(1) - w(3)) < Math.abs(w(0) - w(2)) ? 1 : 0;
      this.addTriangle(at(apex), at(apex + 1), at(apex + 2));
      this.addTriangle(at(apex), at(apex + 2), at(apex + 3));
      return;
    }
    const plain = (e) => (e === 3 ? n : corners[e + 1]) - corners[e] === 1;
    for (let e = 0; e < 4; ++e) {
      if (!plain(e) || !plain((e + 3) % 4)) continue;
      for (let i = 1; i + 1 < n; ++i) this.addTriangle(at(corners[e]), at(corners[e] + i), at(corners[e] + i + 1));
      return;
    }
    this.cutEars(points, 2 * r.width * r.height);
  }

  // Any other border: ears are cut off along the shortest diagonal that leaves no triangle without area.
  cutEars(points, left) {
    while (points.length > 3) {
      const n = points.length;
      let ear = -1, shortest = Infinity, earArea = 0;
      for (let i = 0; i < n; ++i) {
        const p = points[(i + n - 1) % n], q = points[i], next = points[(i + 1) % n];
        const area = (q[0] - p[0]) * (next[1] - p[1]) - (q[1] - p[1]) * (next[0] - p[0]);
        if (area <= 0 || area === left) continue;
        const diagonal = (next[0] - p[0]) ** 2 + (next[1] - p[1]) ** 2;
        if (diagonal < shortest) [ear, shortest, earArea] = [i, diagonal, area];
      }
      if (ear < 0) return;  // not with rectangles that do not overlap
      left -= earArea;
      this.addTriangle(points[(ear + n - 1) % n], points[ear], points[(ear + 1) % n]);
      points.splice(ear, 1);
    }
    this.addTriangle(points[0], points[1], points[2]);
  }

  // Where a surface ends its border moves out by half a sample, on the sample's local plane (SPEC 2.6).
  numberOf([x, y]) {
    const at = y * this.samples.columns + x;
    if (this.number[at] === 0) {
      const state = this.state[at];
      const outwards = (before, after) => ((state & after) === 0 ? 1 : 0) - ((state & before) === 0 ? 1 : 0);
      const dx = outwards(kClosedLeft, kClosedRight), dy = outwards(kClosedAbove, kClosedBelow);
      const here = this.samples.w[at];
      let w = here;
      if (dx !== 0) w += 0.5 * dx * this.samples.slope(x, y, 1, 0);
      if (dy !== 0) w += 0.5 * dy * this.samples.slope(x, y, 0, 1);
      this.vertices.push(2 * x + 1 + dx, 2 * y + 1 + dy, Math.max(w, 0.5 * here));
      this.number[at] = this.vertices.length / kFloatsPerVertex;
    }
    return this.number[at] - 1;
  }

  addTriangle(a, b, c) {
    this.indices.push(this.numberOf(a), this.numberOf(b), this.numberOf(c));
  }

  addCells() {
    const { samples } = this;
    for (let y = 0, at = 0; y < samples.rows; ++y) {
      for (let x = 0; x < samples.columns; ++x, ++at) {
        if (!(samples.w[at] > 0) || this.state[at] !== 0) continue;
        this.cells.push(2 * x + 1, 2 * y + 1, samples.w[at], samples.slope(x, y, 1, 0), samples.slope(x, y, 0, 1));
      }
    }
  }
}

/**
 * Vertices (x, y in half samples from the edge of the first cell, 1/z), triangles as indices, and the cells of samples that no
 * rectangle holds (x, y, 1/z, slopes of 1/z per sample).
 */
export function makeMesh(samples, rectangles) {
  const maker = new MeshMaker(samples);
  for (const r of rectangles) maker.mark(r);
  for (const r of rectangles) maker.addRectangle(r);
  maker.addCells();
  return {
    vertices: maker.vertices.get(), indices: maker.indices.get(), cells: maker.cells.get(),
    cellCount: maker.cells.length / kFloatsPerCell,
  };
}
