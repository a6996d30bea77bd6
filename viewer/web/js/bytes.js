// Bytes as the page holds them: text, a checksum, deflate. Nothing here trusts a length.
import { Problem, fail } from "./problem.js";

const kCrcTable = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; ++k) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c;
});

/** CRC-32 of ISO 3309, as zlib has it. */
export function crc32(bytes) {
  let c = 0xffffffff;
  for (let i = 0; i < bytes.length; ++i) c = kCrcTable[(c ^ bytes[i]) & 255] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}

// Values of 7 bits that HTML does not leave as they are; with the value after it each is one character from here on.
const kReplaced = [0, 13, 60], kPairs = 0x100;

/** `size` bytes out of text that holds 7 bits a character (docs/EXPORT.md, "Text"); a Problem where it holds others. */
export function bytesOfText(text, size, where) {
  if (8 * text.length < 4 * size) fail(where, `${size} bytes`, String(Math.floor(text.length * 7 / 8)));
  const bytes = new Uint8Array(size);
  let filled = 0, bits = 0, count = 0;
  const put = (value) => {
    bits = bits << 7 | value;
    count += 7;
    if (count < 8) return;
    count -= 8;
    if (filled < size) bytes[filled] = bits >> count;
    ++filled;
    bits &= (1 << count) - 1;
  };
  for (let i = 0; i < text.length; ++i) {
    const c = text.charCodeAt(i), pair = c - kPairs;
    if (c < 128) {
      put(c);
    } else if (pair >= 0 && pair < 128 * kReplaced.length) {
      put(kReplaced[pair >> 7]);
      put(pair & 127);
    } else {
      fail(where, "bytes of its checksum", "others");
    }
  }
  // A character of two values may add one at the end.
  return filled === size || filled === size + 1 ? bytes : fail(where, `${size} bytes`, String(filled));
}

/** Exactly `size` bytes out of a zlib stream (RFC 1950). No more than that is ever kept. */
export async function inflate(bytes, size, where) {
  const out = new Uint8Array(size);
  let filled = 0;
  try {
    const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
    for (;;) {
      const { done, value } = await reader.read();
      if (done) break;
      if (filled + value.length > size) {
        reader.cancel().catch(() => {});
        return fail(where, `${size} bytes`, "more");
      }
      out.set(value, filled);
      filled += value.length;
    }
  } catch (error) {
    if (error instanceof Problem) throw error;
    return fail(where, "a whole deflate stream", "a damaged one");
  }
  return filled === size ? out : fail(where, `${size} bytes`, String(filled));
}
