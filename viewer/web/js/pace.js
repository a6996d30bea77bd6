// When the image is drawn again while views arrive. Without a GPU a frame takes seconds of the processors that decode the views.

const kRest = 3;  // an arrival waits this many times as long as the last frame took: drawing has at most a quarter of the time

/** Measures how long frames take, on the GPU too, and says when a view that arrived may be drawn. */
export class Pace {
  constructor(gl) {
    Object.assign(this, { gl, fence: null, began: 0, ended: -Infinity, cost: 0 });
  }

  /** All commands of a frame that began at `now` (ms) were given. */
  drawn(now) {
    const { gl } = this;
    gl.deleteSync(this.fence);
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    this.began = now;
  }

  /** The GPU has finished the last frame. To be asked once per animation frame: the answer changes between them alone. */
  idle(now) {
    const { gl } = this;
    if (this.fence === null) return true;
    if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(this.fence);
    this.fence = null;
    this.ended = now;
    this.cost = now - this.began;
    return true;
  }

  /** An arrival may be drawn. */
  rested(now) {
    return this.idle(now) && now - this.ended >= kRest * this.cost;
  }
}
