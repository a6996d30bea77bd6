// Codes of inverse depth without loss: validity bits, residuals of a prediction, wide residuals
// (docs/FORMAT.md 4.1, as one band).
import { fail } from "./problem.js";

function countOfBits(byte) {
  let n = 0;
  for (; byte; byte &= byte - 1) ++n;
  return n;
}

// Undoes each row's XOR with the one above it.
function undoRows(bits, rowBytes) {
  for (let i = rowBytes; i < bits.length; ++i) bits[i] ^= bits[i - rowBytes];
}

/** The codes of columns x rows pixels from the inflated parts, one after the other; 0 where there is none. */
export function decodeCodes(bytes, columns, rows, largest, where) {
  const rowBytes = (columns + 7) >> 3;
  const validityBytes = rowBytes * rows;
  if (bytes.length < validityBytes) fail(where, `at least ${validityBytes} bytes`, String(bytes.length));
  const validity = bytes.slice(0, validityBytes);
  undoRows(validity, rowBytes);
  let valid = 0;
  for (let i = 0; i < validityBytes; ++i) valid += countOfBits(validity[i]);
  const wideStart = validityBytes + valid;
  if (bytes.length < wideStart) fail(where, `${valid} residuals`, "fewer");

  const codes = new Uint16Array(columns * rows);
  const row = new Int32Array(columns + 1);
  let residual = validityBytes, wide = wideStart, wrong = false;
  for (let y = 0; y < rows; ++y) {
    let left = y === 0 ? 0 : row[1], aboveLeft = left;
    for (let x = 0; x < columns; ++x) {
      const above = y === 0 ? left : row[x + 1];
      let value = left;
      if (y !== 0) {
        const low = Math.min(left, above), high = Math.max(left, above);
        value = Math.max(low, Math.min(high, left + above - aboveLeft));
      }
      if (validity[y * rowBytes + (x >> 3)] >> (x & 7) & 1) {
        if (residual >= wideStart) return fail(where, "bits of the map alone", "more");
        let folded = bytes[residual++];
        if (folded === 255) {
          if (wide + 2 > bytes.length) return fail(where, "wide residuals", "the end");
          folded = bytes[wide] | bytes[wide + 1] << 8;
          wide += 2;
        }
        value = value + ((folded >> 1) ^ -(folded & 1)) & 0xffff;
        wrong ||= value === 0 || value > largest;
        codes[y * columns + x] = value;
      }
      aboveLeft = row[x + 1];
      row[x + 1] = left = value;
    }
  }
  if (wrong || residual !== wideStart || wide !== bytes.length) fail(where, `codes from 1 to ${largest}`, "others");
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
