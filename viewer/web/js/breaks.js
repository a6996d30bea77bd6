// Which samples belong to one surface: SPEC 2.2, 2.3, 2.6 and 5.3 of docs/RENDER_SPEC.md.

/** Inverse depth of a view's samples with the rule for depth breaks. */
export class Samples {
  /** `w`: 1/z per sample, 0 for none; `threshold`: a difference of 1/z. */
  constructor(w, columns, rows, threshold) {
    Object.assign(this, { w, columns, rows, threshold });
  }

  at(x, y) {
    return x >= 0 && y >= 0 && x < this.columns && y < this.rows ? this.w[y * this.columns + x] : 0;
  }

  continues(from, to, step) {
    return from > 0 && to > 0 && Math.abs(to - from - step) <= this.threshold;
  }

  /** SPEC 2.3: the edge from a sample to its neighbour, both of which exist. */
  edgeBreaks(x, y, dx, dy) {
    const w1 = this.at(x, y), w2 = this.at(x + dx, y + dy), step = w2 - w1;
    if (Math.abs(step) <= this.threshold) return false;
    const before1 = this.at(x - dx, y - dy), after1 = this.at(x + 2 * dx, y + 2 * dy);
    const before = this.continues(before1, w1, step), after = this.continues(w2, after1, step);
    if (before && after) return false;
    if (before && this.continues(this.at(x - 2 * dx, y - 2 * dy), before1, step)) return false;
    return !(after && this.continues(after1, this.at(x + 3 * dx, y + 3 * dy), step));
  }

  /** SPEC 2.2: both triangles of the block right of and below (x, y) are drawn. */
  bothTriangles(x, y) {
    const at = y * this.columns + x;
    const a = this.w[at], b = this.w[at + 1], c = this.w[at + this.columns], d = this.w[at + this.columns + 1];
    if (!(a > 0 && b > 0 && c > 0 && d > 0)) return false;
    if (Math.max(a, b, c, d) - Math.min(a, b, c, d) <= this.threshold) return true;
    const diagonal = Math.abs(b - c) < Math.abs(a - d) ? this.edgeBreaks(x + 1, y, -1, 1) : this.edgeBreaks(x, y, 1, 1);
    return !diagonal && !this.edgeBreaks(x, y, 1, 0) && !this.edgeBreaks(x, y + 1, 1, 0) &&
      !this.edgeBreaks(x, y, 0, 1) && !this.edgeBreaks(x + 1, y, 0, 1);
  }

  /** SPEC 5.3: the same, with the outermost samples once more around the grid. */
  isWhole(x, y) {
    const left = Math.max(x, 0), right = Math.min(x + 1, this.columns - 1);
    const top = Math.max(y, 0), bottom = Math.min(y + 1, this.rows - 1);
    if (left < right && top < bottom) return this.bothTriangles(left, top);
    if (!(this.at(left, top) > 0 && this.at(right, bottom) > 0)) return false;
    if (left === right && top === bottom) return true;
    return !this.edgeBreaks(left, top, right - left, bottom - top);
  }

  /** SPEC 2.6: slope of 1/z per sample at a sample that exists: the flatter of the two sides that hold. */
  slope(x, y, dx, dy) {
    const here = this.at(x, y), after = this.at(x + dx, y + dy), before = this.at(x - dx, y - dy);
    let slope = 0, found = false;
    if (after > 0 && !this.edgeBreaks(x, y, dx, dy)) {
      slope = after - here;
      found = true;
    }
    if (before > 0 && !this.edgeBreaks(x - dx, y - dy, dx, dy)) {
      const backward = here - before;
      if (!found || Math.abs(backward) < Math.abs(slope)) slope = backward;
    }
    return slope;
  }
}

/** What shaders read beside the codes, (columns + 1) x (rows + 1): bit 0: whole, bit 1: all four samples masked. */
export function blockFlags(samples, maskedSamples) {
  const { columns, rows } = samples;
  const flags = new Uint8Array((columns + 1) * (rows + 1));
  const masked = (x, y) => maskedSamples[Math.min(Math.max(y, 0), rows - 1) * columns + Math.min(Math.max(x, 0), columns - 1)];
  for (let y = -1, k = 0; y < rows; ++y) {
    for (let x = -1; x < columns; ++x, ++k) {
      if (samples.isWhole(x, y)) flags[k] = 1;
      else if (maskedSamples && masked(x, y) && masked(x + 1, y) && masked(x, y + 1) && masked(x + 1, y + 1)) flags[k] = 2;
    }
  }
  return flags;
}
