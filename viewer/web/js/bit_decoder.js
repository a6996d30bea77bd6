// An adaptive binary range decoder (docs/EXPORT.md, "Coded maps"). Beyond the end of its bytes it reads zeros: no input can
// make it run longer than the map that it is asked for.

/** How probable a 0 is in each of `count` contexts: the mean of a quick and a slow estimate, in 65536ths. */
export class BitModels {
  constructor(count) {
    this.quick = new Uint16Array(count).fill(32768);
    this.slow = new Uint16Array(count).fill(32768);
  }
}

export class BitDecoder {
  constructor(bytes) {
    this.bytes = bytes;
    this.range = 0xffffffff;
    this.code = 0;
    this.at = 1;  // the first byte is the coder's own
    for (let i = 0; i < 4; ++i) this.code = (this.code << 8 | this.next()) >>> 0;
  }

  next() {
    return this.at < this.bytes.length ? this.bytes[this.at++] : (++this.at, 0);
  }

  /** All bytes were read, and none beyond them. */
  get ended() {
    return this.at === this.bytes.length;
  }

  /** 0 or 1 of context i. */
  get(models, i) {
    const { quick, slow } = models;
    const mean = quick[i] + slow[i] >> 1;
    const zeros = (this.range >>> 16) * (mean < 48 ? 48 : mean > 65488 ? 65488 : mean);
    const bit = this.code >= zeros ? 1 : 0;
    if (bit) {
      this.code -= zeros;
      this.range -= zeros;
      quick[i] -= quick[i] >> 4;
      slow[i] -= slow[i] >> 7;
    } else {
      this.range = zeros;
      quick[i] += 65535 - quick[i] >> 4;
      slow[i] += 65535 - slow[i] >> 7;
    }
    while (this.range < 0x1000000) {
      this.range = this.range * 256;
      this.code = (this.code << 8 | this.next()) >>> 0;
    }
    return bit;
  }
}
