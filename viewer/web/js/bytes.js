// Bytes as the page holds them: as text, with a checksum. Nothing here trusts a length.
import { fail } from "./problem.js";

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

// Of character codes 128 on: the bits of 128 to 255 stand for the first of what HTML lets not through, and so on.
const kForbidden = [0, 10, 13, 60];

/** The `size` bytes of a text: seven bits a character, fourteen in those beyond ASCII. A Problem where it is none. */
export function bytesOfText(text, size, where) {
  const bytes = new Uint8Array(size);
  let held = 0, count = 0, filled = 0;
  const put = (seven) => {
    held = (held << 7 | seven) & 0x7fff;
    count += 7;
    if (count < 8) return;
    count -= 8;
    if (filled < size) bytes[filled] = held >> count & 255;
    ++filled;
  };
  for (let i = 0; i < text.length; ++i) {
    const code = text.charCodeAt(i);
    if (code >= 128) {
      const forbidden = kForbidden[(code >> 7) - 1];
      if (forbidden === undefined) return fail(where, "bytes as text", "another character");
      put(forbidden);
    }
    put(code & 127);
  }
  // What remains are at most thirteen zeros that fill up the last character.
  return filled === size || filled === size + 1 ? bytes : fail(where, `${size} bytes`, String(filled));
}
