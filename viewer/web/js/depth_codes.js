// Codes of inverse depth without loss: pipeline/detail/web/depth_coder.cpp writes them (docs/EXPORT.md, "Depth").
import { fail } from "./problem.js";
import { RangeDecoder, bitModels } from "./range_decoder.js";

// The same numbers stand in pipeline/detail/web/depth_coder.cpp.
const kClassNeighbours = 729;
const kActivities = 16, kSides = 3;
const kMaxError = 64;
const kUnary = 14;
const kZero = 0, kNegative = 1, kMore = 2, kLength = kMore + kUnary, kModels = 36;
const kMaxLength = 16;
const kRough = [12, 16, 23, 32, 45, 64, 91];

function activityLevel(activity) {
  if (activity < 8) return activity;
  let level = 8;
  while (level < 15 && activity >= kRough[level - 8]) ++level;
  return level;
}

// Per pixel: 0 no depth, 1 measured, 2 completed.
function decodeClasses(decoder, columns, rows) {
  const models = bitModels(2 * kClassNeighbours);
  const classes = new Uint8Array(columns * rows);
  const at = (x, y) => (x >= 0 && y >= 0 && x < columns ? classes[y * columns + x] : 0);
  for (let y = 0, k = 0; y < rows; ++y) {
    for (let x = 0; x < columns; ++x, ++k) {
      const context = ((((at(x - 1, y) * 3 + at(x, y - 1)) * 3 + at(x - 1, y - 1)) * 3 + at(x + 1, y - 1)) * 3 + at(x - 2, y)) * 3 + at(x, y - 2);
      if (decoder.bit(models, 2 * context)) classes[k] = 1;
      else if (decoder.bit(models, 2 * context + 1)) classes[k] = 2;
    }
  }
  return classes;
}

function decodeResidual(decoder, models, first) {
  if (!decoder.bit(models, first + kZero)) return 0;
  const negative = decoder.bit(models, first + kNegative);
  let magnitude = 1;
  while (magnitude <= kUnary && decoder.bit(models, first + kMore + magnitude - 1)) ++magnitude;
  if (magnitude > kUnary) {
    let length = 0;
    while (decoder.bit(models, first + kLength + length)) {
      if (++length > kMaxLength) return fail(decoder.where, `residuals of ${kMaxLength} bits`, "more");
    }
    magnitude = kUnary + (1 << length | decoder.plain(length));
  }
  return negative ? -magnitude : magnitude;
}

// Adds `offset` + the codes 1 to `largest` of the pixels of one class.
function decodeSurface(decoder, classes, wanted, columns, rows, largest, offset, codes) {
  const models = bitModels(kActivities * kSides * kModels);
  const row = new Int32Array(columns), errors = new Int32Array(columns + 1);
  for (let y = 0, k = 0; y < rows; ++y) {
    let left = row[0], aboveLeft = left, leftError = 0;
    for (let x = 0; x < columns; ++x, ++k) {
      const above = y === 0 ? left : row[x];
      if (y === 0) aboveLeft = left;
      const predicted = Math.max(Math.min(left, above), Math.min(Math.max(left, above), left + above - aboveLeft));
      let value = predicted;
      if (classes[k] === wanted) {
        const aboveRight = y > 0 && x + 1 < columns ? row[x + 1] : above;
        const activity = Math.abs(left - aboveLeft) + Math.abs(above - aboveLeft) + Math.abs(aboveRight - above) +
          leftError + errors[x] + errors[x + 1];
        const side = left < above ? 0 : left === above ? 1 : 2;
        value += decodeResidual(decoder, models, (activityLevel(activity) * kSides + side) * kModels);
        if (value < 1 || value > largest) fail(decoder.where, `codes from 1 to ${largest}`, "others");
        codes[k] = offset + value;
      }
      aboveLeft = above;
      row[x] = left = value;
      errors[x] = leftError = Math.min(Math.abs(value - predicted), kMaxError);
    }
  }
}

/** The codes of a view's samples out of its bytes: 1 to steps + 1 measured, what follows completed, 0 none. */
export function decodeCodes(bytes, view, where) {
  const { columns, rows, measured, completed } = view;
  const decoder = new RangeDecoder(bytes, where);
  const classes = decodeClasses(decoder, columns, rows);
  if (!completed && classes.includes(2)) fail(where, "measured depth alone", "completed depth");
  const codes = new Uint16Array(columns * rows);
  decodeSurface(decoder, classes, 1, columns, rows, measured.steps + 1, 0, codes);
  if (completed) decodeSurface(decoder, classes, 2, columns, rows, completed.steps + 1, measured.steps + 1, codes);
  decoder.finish();
  return codes;
}

/** How the codes of both maps stand for 1/z: see inverseDepthTable. */
export function codeRange(view) {
  const measuredCodes = view.measured.steps + 1;
  const line = (code) => {
    const first = 1 / code.far;
    const step = (1 / code.near - first) / code.steps;
    return { first: first - step, step };
  };
  const m = line(view.measured);
  const c = view.completed ? line(view.completed) : { first: 0, step: 0 };
  return { measuredCodes, codes: measuredCodes + (view.completed ? view.completed.steps + 1 : 0), measured: m, completed: c };
}

/** 1/z of each code, through float32 depth as the programs hold it; [0] = 0, no depth. */
export function inverseDepthTable(view) {
  const range = codeRange(view);
  const table = new Float64Array(range.codes + 1);
  const put = (at, code, line) => {
    for (let c = 1; c <= code.steps + 1; ++c) {
      const z = c === 1 ? code.far : c === code.steps + 1 ? code.near
        : Math.min(Math.max(1 / (line.first + c * line.step), code.near), code.far);
      table[at + c] = 1 / Math.fround(z);
    }
  };
  put(0, view.measured, range.measured);
  if (view.completed) put(range.measuredCodes, view.completed, range.completed);
  return table;
}
