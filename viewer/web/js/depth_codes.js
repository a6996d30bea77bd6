// Coded maps (docs/EXPORT.md): where there are values, and residuals of their prediction.
import { BitDecoder, BitModels } from "./bit_decoder.js";
import { fail } from "./problem.js";

const kActivities = 14, kPlainActivities = 6, kSlopes = 4, kUnarySteps = 18, kGammaBits = 17;

/** 1 for each element that there is, of columns x rows; none is stored where `known` is not 0. */
export function decodePlaces(bytes, columns, rows, known, where) {
  const decoder = new BitDecoder(bytes), models = new BitModels(1 << 12);
  // With a border of two elements, so that no neighbour is off the map.
  const stride = columns + 4;
  const here = new Uint8Array(stride * (rows + 3)), other = new Uint8Array(here.length);
  for (let y = 0; known && y < rows; ++y) {
    for (let x = 0; x < columns; ++x) other[(y + 2) * stride + x + 2] = known[y * columns + x] ? 1 : 0;
  }
  const places = new Uint8Array(columns * rows);
  for (let y = 0, k = 0; y < rows; ++y) {
    for (let x = 0, i = (y + 2) * stride + 2; x < columns; ++x, ++i, ++k) {
      if (other[i]) continue;
      const above = i - stride;
      const context = here[i - 1] | here[above] << 1 | here[above - 1] << 2 | here[above + 1] << 3 | here[i - 2] << 4 |
        here[above - stride] << 5 | here[above + 2] << 6 | here[above - 2] << 7 | other[i + 1] << 8 | other[i + stride] << 9 |
        other[i - 1] << 10 | other[above] << 11;
      here[i] = places[k] = decoder.get(models, context);
    }
  }
  return decoder.ended ? places : fail(where, "the bits of this map", "others");
}

function magnitudeBits(v) {
  return 32 - Math.clz32(v);
}

class ResidualDecoder {
  constructor(bytes) {
    this.decoder = new BitDecoder(bytes);
    this.zero = new BitModels(kActivities * kSlopes);
    this.sign = new BitModels(kActivities);
    this.unary = new BitModels(kActivities * kUnarySteps);
    this.length = new BitModels(kGammaBits + 1);
    this.digit = new BitModels(kGammaBits);
  }

  get(activity, slope) {
    const { decoder } = this;
    if (!decoder.get(this.zero, activity * kSlopes + slope)) return 0;
    const negative = decoder.get(this.sign, activity);
    let more = 0;
    while (more < kUnarySteps && decoder.get(this.unary, activity * kUnarySteps + more)) ++more;
    if (more === kUnarySteps) {
      let bits = 1, rest = 1;
      while (bits < kGammaBits && decoder.get(this.length, bits)) ++bits;
      for (let i = bits - 2; i >= 0; --i) rest = 2 * rest + decoder.get(this.digit, i);
      more += rest - 1;
    }
    return negative ? -1 - more : 1 + more;
  }
}

/** Codes from 1 to `largest` where there are places, else 0. */
export function decodeValues(bytes, places, columns, rows, largest, where) {
  const residual = new ResidualDecoder(bytes);
  const codes = new Uint16Array(columns * rows);
  let values = new Int32Array(columns + 2), aboveValues = new Int32Array(columns + 2);
  let residuals = new Int32Array(columns + 2), aboveResiduals = new Int32Array(columns + 2);
  for (let y = 0, k = 0; y < rows; ++y) {
    for (let x = 0; x < columns; ++x, ++k) {
      const i = x + 1;
      const above = y === 0 ? (x === 0 ? 0 : values[i - 1]) : aboveValues[i];
      const left = x === 0 ? above : values[i - 1];
      const aboveLeft = y === 0 || x === 0 ? above : aboveValues[i - 1];
      const low = Math.min(left, above), high = Math.max(left, above);
      const predicted = Math.max(low, Math.min(high, left + above - aboveLeft));
      const west = x === 0 ? 0 : Math.abs(residuals[i - 1]), north = Math.abs(aboveResiduals[i]);
      if (!places[k]) {
        values[i] = predicted;
        residuals[i] = west + north >> 2;
        continue;
      }
      const sum = 2 * (west + north) + Math.abs(aboveResiduals[i + 1]) + Math.abs(aboveResiduals[i - 1]);
      const activity = sum < kPlainActivities ? sum : Math.min(kActivities - 1, 3 + magnitudeBits(sum));
      const step = Math.max(Math.abs(left - aboveLeft), Math.abs(above - aboveLeft));
      const found = residual.get(activity, step === 0 ? 0 : step < 3 ? 1 : step < 12 ? 2 : 3);
      const value = predicted + found;
      if (value < 1 || value > largest) return fail(where, `codes from 1 to ${largest}`, String(value));
      codes[k] = values[i] = value;
      residuals[i] = found;
    }
    [values, aboveValues] = [aboveValues, values];
    [residuals, aboveResiduals] = [aboveResiduals, residuals];
  }
  return residual.decoder.ended ? codes : fail(where, "the values of this map", "others");
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
