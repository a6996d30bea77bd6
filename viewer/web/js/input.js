// Mouse, touch and keys: what they mean, told to the page as few kinds of movement.

const kWheelPerDoubling = 600;
const kClickPx = 5;
const kFlightKeys = {
  KeyD: [0, 1], KeyA: [0, -1], KeyE: [1, -1], KeyQ: [1, 1], KeyW: [2, 1], KeyS: [2, -1],
  ArrowUp: [2, 1], ArrowDown: [2, -1], ArrowRight: [3, 1], ArrowLeft: [3, -1],
};

/** Pointers on the canvas: one orbits (or pans, with another button), two pan and come nearer. */
export class Pointers {
  /** `on`: {begin(at), orbit(dx, dy), pan(dx, dy), dolly(factor, at), click(at)}, pixels of the page from the canvas' corner. */
  constructor(canvas, on) {
    Object.assign(this, { canvas, on, down: new Map(), moved: 0 });
    canvas.addEventListener("pointerdown", (event) => this.begin(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.end(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const px = event.deltaY * (event.deltaMode === 1 ? 30 : event.deltaMode === 2 ? 300 : 1);
      on.dolly(2 ** (Math.max(-300, Math.min(300, px)) / kWheelPerDoubling), this.at(event));
    }, { passive: false });
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  begin(event) {
    this.canvas.setPointerCapture?.(event.pointerId);
    this.canvas.focus();
    const at = this.at(event);
    if (this.down.size === 0) this.moved = 0;
    else this.moved = Infinity;
    this.down.set(event.pointerId, at);
    this.on.begin(at);
  }

  move(event) {
    const before = this.down.get(event.pointerId);
    if (!before) return;
    const at = this.at(event), dx = at[0] - before[0], dy = at[1] - before[1];
    this.moved += Math.hypot(dx, dy);
    if (this.down.size === 1) {
      this.down.set(event.pointerId, at);
      if (this.moved < kClickPx) return;
      if (event.buttons & 6 || event.shiftKey) this.on.pan(dx, dy);
      else this.on.orbit(dx, dy);
      return;
    }
    const spread = () => {
      const [a, b] = [...this.down.values()];
      return { middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], apart: Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1) };
    };
    const old = spread();
    this.down.set(event.pointerId, at);
    const now = spread();
    this.on.pan(now.middle[0] - old.middle[0], now.middle[1] - old.middle[1]);
    this.on.dolly(old.apart / now.apart, now.middle);
  }

  end(event) {
    if (!this.down.delete(event.pointerId) || this.down.size > 0) return;
    if (this.moved < kClickPx && event.type === "pointerup") this.on.click(this.at(event));
  }
}

/** Keys that are held down, for flying; `commands`: what a key does once, by its code. */
export class Keys {
  constructor(commands) {
    this.held = new Set();
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.code in commands && !event.repeat) commands[event.code]();
      else if (event.code in kFlightKeys) this.held.add(event.code);
      else return;
      event.preventDefault();
    });
    addEventListener("keyup", (event) => this.held.delete(event.code));
    addEventListener("blur", () => this.held.clear());
  }

  get flying() {
    return this.held.size > 0;
  }

  /** [right, down, forward, turn to the right], each from -1 to 1. */
  get motion() {
    const motion = [0, 0, 0, 0];
    for (const code of this.held) motion[kFlightKeys[code][0]] += kFlightKeys[code][1];
    return motion.map((v) => Math.max(-1, Math.min(1, v)));
  }
}
