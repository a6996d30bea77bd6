// Bytes as the page holds them: base64, a checksum, deflate. Nothing here trusts a length.
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

/** Bytes of base64 text; a Problem where it is none. */
export function bytesOfBase64(text, where) {
  try {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const binary = atob(text);
    const bytes = new Uint8Array(binary.length);
    for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
    return bytes;
  } catch {
    return fail(where, "base64 text", "something else");
  }
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
