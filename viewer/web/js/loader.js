// Views from where their bytes are into the store: the most wanted first, decoded beside the page's own thread.
import { decodeView } from "./decode.js";
import { Problem } from "./problem.js";

const kMostWorkers = 3;

// One place where views are decoded: a worker, or this thread where there are no workers.
class Decoder {
  constructor(makeWorker) {
    this.waiting = new Map();
    try {
      this.worker = makeWorker();
      this.worker.onmessage = ({ data }) => this.settle(data.index, data);
      this.worker.onerror = () => this.giveUp();
    } catch {
      this.worker = null;
    }
  }

  settle(index, data) {
    const promise = this.waiting.get(index);
    this.waiting.delete(index);
    if (data.problem) promise?.reject(new Problem(data.problem));
    else promise?.resolve(data.pixels);
  }

  // What the worker was asked for is decoded here.
  giveUp() {
    this.worker = null;
    for (const { view, bytes, resolve, reject } of this.waiting.values()) decodeView(view, bytes).then(resolve, reject);
    this.waiting.clear();
  }

  // `bytes`: {text} or {bytes}.
  decode(view, bytes) {
    if (!this.worker) return decodeView(view, bytes);
    return new Promise((resolve, reject) => {
      this.waiting.set(view.index, { view, bytes, resolve, reject });
      this.worker.postMessage({ view, bytes });
    });
  }
}

/** Keeps the store filled with the views that are wanted most. */
export class Loader {
  /**
   * `order()`: all views, most wanted first; `dataOf(view)`: promise of its bytes, {text} or {bytes}; `loaded(view)` and
   * `failed(view, problem)` are called; `upload(put)`: calls `put` when the GPU may be used, at once without it.
   */
  constructor({ store, makeWorker, order, dataOf, loaded, failed, upload = (put) => put() }) {
    Object.assign(this, { store, order, dataOf, loaded, failed, upload, broken: new Set(), busy: new Set() });
    const workers = Math.max(1, Math.min(kMostWorkers, (navigator.hardwareConcurrency || 2)));
    this.decoders = Array.from({ length: workers }, () => new Decoder(makeWorker));
  }

  // The views that the store has room for.
  wanted() {
    return this.order().filter((view) => !this.broken.has(view.index)).slice(0, this.store.layers);
  }

  /** All that is wanted is there. */
  get done() {
    return this.busy.size === 0 && this.wanted().every((view) => this.store.has(view));
  }

  next() {
    return this.wanted().find((view) => !this.store.has(view) && !this.busy.has(view.index));
  }

  /** Starts what is to be done and returns at once. The first view has the processor to itself: it is all that an image needs. */
  run() {
    const first = this.store.loaded.size === 0 && this.broken.size === 0;
    for (const decoder of first ? this.decoders.slice(0, 1) : this.decoders) if (!decoder.running) this.work(decoder);
  }

  async work(decoder) {
    decoder.running = true;
    for (let view = this.next(); view; view = this.next()) {
      this.busy.add(view.index);
      try {
        const pixels = await decoder.decode(view, await this.dataOf(view));
        await this.upload(() => {
          this.store.makeRoom(this.order());
          this.store.put(view, pixels);
        });
        this.busy.delete(view.index);
        this.loaded(view);
      } catch (error) {
        this.busy.delete(view.index);
        this.broken.add(view.index);
        this.failed(view, error);
        this.run();
      }
    }
    decoder.running = false;
  }
}
