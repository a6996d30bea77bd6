// The adaptive binary range decoder: see pipeline/detail/web/range_encoder.h. Never reads beyond its bytes.
import { fail } from "./problem.js";

/** Models of `count` bits: a fast and a slow probability of 1 for each, of 65536. */
export const bitModels = (count) => new Uint16Array(2 * count).fill(32768);

export class RangeDecoder {
  constructor(bytes, where) {
    Object.assign(this, { bytes, where, at: 0, range: 0xffffffff, code: 0 });
    for (let i = 0; i < 5; ++i) this.code = (this.code << 8 | this.next()) >>> 0;
  }

  next() {
    return this.at < this.bytes.length ? this.bytes[this.at++] : fail(this.where, "more bytes", "the end");
  }

  narrow(bound) {
    const bit = this.code < bound ? 1 : 0;
    if (bit) {
      this.range = bound;
    } else {
      this.code -= bound;
      this.range -= bound;
    }
    while (this.range < 0x1000000) {
      this.range = this.range * 256;
      this.code = (this.code << 8 | this.next()) >>> 0;
    }
    return bit;
  }

  /** The next bit, 0 or 1, by its model. */
  bit(models, index) {
    const k = 2 * index, fast = models[k], slow = models[k + 1];
    const probability = Math.min(Math.max((fast + slow) >> 2, 32), 32736);
    const bit = this.narrow((this.range >>> 15) * probability);
    models[k] = bit ? fast + ((65535 - fast) >> 4) : fast - (fast >> 4);
    models[k + 1] = bit ? slow + ((65535 - slow) >> 7) : slow - (slow >> 7);
    return bit;
  }

  /** Bits of which nothing is known, the highest first. */
  plain(bits) {
    let value = 0;
    for (; bits > 0; --bits) value = value << 1 | this.narrow(this.range >>> 1);
    return value;
  }

  /** Fails where bytes are left. */
  finish() {
    if (this.at !== this.bytes.length) fail(this.where, `${this.at} bytes`, String(this.bytes.length));
  }
}
