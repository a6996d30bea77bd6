// A set on a WebGL2 context that belongs to another program: views are fetched, nearest first, and drawn when that program asks.
import { Loader } from "./loader.js";
import { Renderer } from "./renderer.js";
import { FolderSource } from "./source.js";
import { parseHeader } from "./header.js";
import { placed, placedSet, upOf } from "./camera.js";
import { wantedOrder } from "./selection.js";
import { takeState } from "./gl.js";

/**
 * What is drawn of a set. A camera is {width, height, fx, fy, cx, cy, rotation, translation}: pixels, their centres at + 0.5;
 * rotation (w x y z) and translation take points of the set's world to the camera (x right, y down, z forward).
 */
export class SetScene {
  /**
   * `set`: of a header; `source.dataOf(view)`: its bytes. `changed()` is called when more can be drawn than before,
   * `failed(problem)` for each view that cannot be shown.
   */
  constructor(gl, shaders, set, { source, makeWorker, changed = () => {}, failed = () => {} }) {
    this.gl = gl;
    this.set = placedSet(set);
    this.up = upOf(this.set.views);  // towards the sky, a unit vector of the set's world
    this.step = 0;             // the time step that is shown, of set.times
    this.uploads = [];
    takeState(gl);
    this.renderer = new Renderer(gl, shaders, this.set);
    this.camera = this.set.views[this.set.opening];
    this.allLoaded = new Promise((resolve) => { this.complete = resolve; });
    const settled = () => { if (this.loader.done) this.complete(); };
    this.loader = new Loader({
      store: this.renderer.store, makeWorker, order: () => this.order(), dataOf: (view) => source.dataOf(view),
      // To the GPU when the scene is drawn: at other times its state belongs to others.
      upload: (put) => new Promise((resolve, reject) => {
        this.uploads.push(() => { try { resolve(put()); } catch (error) { reject(error); } });
        changed();
      }),
      loaded: settled, failed: (view, problem) => { settled(); failed(problem); },
    });
    this.loader.run();
  }

  /** The set behind the address of a set.json. Rejects with a Problem where it cannot be had. */
  static async open(gl, shaders, address, options) {
    const source = new FolderSource(address);
    return new SetScene(gl, shaders, parseHeader(await source.header()), { source, ...options });
  }

  order() {
    return wantedOrder(this.set, this.step, this.camera);
  }

  /** Draws into textures of its own; null while no view is there. Leaves the context's state changed. */
  draw(camera) {
    takeState(this.gl);
    this.camera = placed(camera);
    for (const put of this.uploads.splice(0)) put();
    this.renderer.step = this.step;
    const frame = this.set.steps[this.step].some((view) => this.renderer.store.has(view)) ? this.renderer.draw(this.camera) : null;
    this.loader.run();
    return frame;
  }

  /** Draws what `draw` drew over the whole canvas; depth is neither read nor written. */
  present(frame) {
    this.renderer.present(frame);
  }

  /**
   * Draws it into a framebuffer with depth. `viewport`: x, y, width, height; `depthOf`: [a, b], depth in normalised device
   * coordinates is a + b / z; `linear`: linear light instead of sRGB.
   */
  compose(frame, framebuffer, viewport, depthOf, linear = false) {
    this.renderer.compose(frame, framebuffer, viewport, depthOf, linear);
  }
}
