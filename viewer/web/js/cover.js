// SPEC 5.1: which rectangles of a view's samples are flat enough to be drawn as two triangles. The same rectangles as
// dtr/render/block_cover.cpp finds, in the same order.

const kRootSide = 16;
const kSmallestSquare = 8;  // smaller aligned squares would leave more pieces than they save corners
const kMinBlocks = 3;       // beside depth breaks smaller pieces are left to the cells of their samples
const kBroken = 0, kWhole = 1, kDone = 2;
const kStride = kRootSide + 2;

class RootMaker {
  constructor(samples, tolerance, rectangles) {
    Object.assign(this, { samples, tolerance, rectangles });
    this.blocks = new Uint8Array(kStride * kStride);
    this.sides = new Uint8Array(kRootSide * kRootSide);
  }

  make(x, y) {
    const { columns, rows } = this.samples;
    Object.assign(this, { x, y });
    this.width = Math.min(Math.max(columns - 1 - x, 0), kRootSide);
    this.height = Math.min(Math.max(rows - 1 - y, 0), kRootSide);
    this.findTriangles();
    this.coverSquares();
    for (let j = 0; j < this.height; ++j) for (let i = 0; i < this.width; ++i) if (this.at(i, j) === kWhole) this.takeLargest(i, j);
  }

  at(i, j) {
    return this.blocks[(j + 1) * kStride + i + 1];
  }

  // Also of the blocks around the root square; beyond the map nothing is missing.
  findTriangles() {
    const { samples, x, y } = this, { columns, rows } = samples;
    for (let j = -1; j <= this.height; ++j) {
      for (let i = -1; i <= this.width; ++i) {
        const inside = x + i >= 0 && y + j >= 0 && x + i + 1 < columns && y + j + 1 < rows;
        this.blocks[(j + 1) * kStride + i + 1] = !inside || samples.bothTriangles(x + i, y + j) ? kWhole : kBroken;
      }
    }
  }

  isBesideBreak(i, j) {
    for (let dy = -1; dy <= 1; ++dy) for (let dx = -1; dx <= 1; ++dx) if (this.at(i + dx, j + dy) === kBroken) return true;
    return false;
  }

  // Aligned squares, each of four that were flat themselves.
  coverSquares() {
    const { sides, width, height } = this;
    sides.fill(0);
    for (let j = 0; j < height; ++j) for (let i = 0; i < width; ++i) sides[j * kRootSide + i] = this.at(i, j) === kWhole ? 1 : 0;
    for (let side = 2; side <= kRootSide; side *= 2) {
      const h = side / 2;
      for (let j = 0; j + side <= height; j += side) {
        for (let i = 0; i + side <= width; i += side) {
          const k = j * kRootSide + i, below = k + h * kRootSide;
          if (sides[k] === h && sides[k + h] === h && sides[below] === h && sides[below + h] === h && this.isFlat(i, j, side, side)) {
            sides[k] = side;
          }
        }
      }
    }
    for (let side = kRootSide; side >= kSmallestSquare; side /= 2) {
      for (let j = 0; j + side <= height; j += side) {
        for (let i = 0; i + side <= width; i += side) {
          if (sides[j * kRootSide + i] === side && this.at(i, j) === kWhole) this.take(i, j, side, side);
        }
      }
    }
  }

  // The larger of what grows to the right first and what grows downwards first.
  takeLargest(i, j) {
    let bestWidth = 1, bestHeight = 1;
    for (const rightFirst of [true, false]) {
      let width = 1, height = 1;
      for (const right of [rightFirst, !rightFirst]) {
        while (this.canGrow(i, j, width, height, right)) right ? ++width : ++height;
      }
      if (width * height > bestWidth * bestHeight) [bestWidth, bestHeight] = [width, height];
    }
    if (bestWidth * bestHeight < kMinBlocks && this.isBesideBreak(i, j)) return;
    this.take(i, j, bestWidth, bestHeight);
  }

  // By a column or a row: what it has already is whole.
  canGrow(i, j, width, height, right) {
    if (right ? i + width + 1 > this.width : j + height + 1 > this.height) return false;
    for (let k = 0; k < (right ? height : width); ++k) {
      if (this.at(right ? i + width : i + k, right ? j + k : j + height) !== kWhole) return false;
    }
    return right ? this.isFlat(i, j, width + 1, height) : this.isFlat(i, j, width, height + 1);
  }

  take(i, j, width, height) {
    for (let y = j; y < j + height; ++y) this.blocks.fill(kDone, (y + 1) * kStride + i + 1, (y + 1) * kStride + i + 1 + width);
    this.rectangles.push({ x: this.x + i, y: this.y + j, width, height });
  }

  isFlat(i0, j0, width, height) {
    const { samples: { w, columns }, tolerance } = this;
    const first = (this.y + j0) * columns + this.x + i0, last = first + height * columns;
    const a = w[first], b = w[first + width], c = w[last], d = w[last + width];
    const alongBC = Math.abs(b - c) < Math.abs(a - d);
    const upper = (b - a) / width, lower = (d - c) / width, left = (c - a) / height, right = (d - b) / height;
    for (let j = 0, row = first; j <= height; ++j, row += columns) {
      for (let i = 0; i <= width; ++i) {
        let onPlane;
        if (alongBC) {
          onPlane = i * height + j * width <= width * height ? a + i * upper + j * left
            : d - (width - i) * lower - (height - j) * right;
        } else {
          onPlane = i * height >= j * width ? a + i * upper + j * right : a + i * lower + j * left;
        }
        if (!(Math.abs(w[row + i] - onPlane) <= tolerance)) return false;
      }
    }
    return true;
  }
}

/** Rectangles {x, y, width, height} in blocks of samples. `tolerance`: a difference of 1/z. */
export function coverBlocks(samples, tolerance) {
  const rectangles = [], maker = new RootMaker(samples, tolerance, rectangles);
  for (let y = 0; y < samples.rows; y += kRootSide) for (let x = 0; x < samples.columns; x += kRootSide) maker.make(x, y);
  return rectangles;
}
