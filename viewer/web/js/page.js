// The page: canvas, buttons and what they do, with the renderer behind them.
import { Renderer } from "./renderer.js";
import { Loader } from "./loader.js";
import { Navigation } from "./navigation.js";
import { Keys, Pointers } from "./input.js";
import { placed, placedSet, upOf } from "./camera.js";
import { kCandidates, kViews, sameSelection, wantedOrder } from "./selection.js";
import { Pace } from "./pace.js";
import { TimeControl } from "./time.js";
import { drawMeasure, pickedPoint } from "./measure.js";
import { Headset } from "./xr.js";
import { Problem } from "./problem.js";

const kMaxCanvasPixels = 2.1e6;
const kSlowMs = 60, kFastMs = 22;     // a frame while moving: coarser beyond, finer below
const kScales = [1, 0.75, 0.5, 0.35, 0.25];
const kMostStepS = 0.1;

const element = (id) => document.getElementById(id);

/** A line for people, until it is clicked away. */
export function showProblem(text) {
  const box = element("problem");
  box.textContent = text;
  box.hidden = false;
}

export class Page {
  /** `dataOf(view)`: promise of its bytes (loader.js); `makeWorker()`: a worker that decodes. */
  constructor(set, shaders, { dataOf, makeWorker }) {
    this.set = placedSet(set);
    this.canvas = element("canvas");
    const gl = this.canvas.getContext("webgl2", { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" });
    if (!gl) {
      throw new Problem("this page needs WebGL2, which this browser does not offer here; open it in a current Firefox, Chrome, Edge " +
        "or Safari, with graphics acceleration on");
    }
    this.renderer = new Renderer(gl, shaders, this.set);
    const up = upOf(this.set.views);
    this.navigation = new Navigation({ ...this.set, views: this.set.steps[0] }, up);
    this.headset = new Headset(this, gl, up, element("headset"));
    this.time = new TimeControl(this.set.times, element("time"), element("play"), () => { this.dirty = true; });
    this.options = { depth: false, compare: false, measure: false, split: 0.5 };
    this.points = [];
    this.eye = null;  // the camera of a headset's eye
    this.level = 0;
    this.dirty = true;
    this.arrivals = false;  // views that the image would be drawn from have arrived since it was drawn
    this.pace = new Pace(gl);
    this.last = 0;
    this.loader = new Loader({
      store: this.renderer.store, makeWorker, order: () => this.order(), dataOf,
      loaded: () => this.arrived(), failed: (view, problem) => this.missing(problem),
    });
    this.firstPicture = new Promise((resolve) => { this.pictured = resolve; });
    this.allLoaded = new Promise((resolve) => { this.complete = resolve; });
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.stopped = true;
      showProblem("the browser took the graphics memory away; reload the page");
    });
    this.connect();
    this.loader.run();
    requestAnimationFrame((now) => this.tick(now));
  }

  order() {
    return wantedOrder(this.set, this.time.step, this.eye ?? this.camera());
  }

  arrived() {
    this.arrivals = true;
    const loaded = this.renderer.store.loaded.size, wanted = Math.min(this.set.views.length, this.renderer.store.layers);
    element("progress").style.width = loaded < wanted ? `${100 * loaded / wanted}%` : "0";
    if (this.loader.done) this.complete();
  }

  // Views that have arrived are drawn at once where there is no image yet or nothing more is to come for it, else now and then.
  takeArrivals(now) {
    if (!this.arrivals) return;
    const { step } = this.renderer;
    this.chooseStep();
    if (!this.frame || this.renderer.step !== step) this.dirty = true;
    else if (!this.options.compare && sameSelection(this.renderer.select(this.frame.novel), this.frame.selection)) this.arrivals = false;
    else if (this.pace.rested(now) || (this.pace.idle(now) && (this.loader.done || this.nearestLoaded))) this.dirty = true;
  }

  // Views that follow in the order change nothing: SPEC 1.2 needs one more than it draws from.
  get nearestLoaded() {
    const count = (this.frame.perPixel ? kCandidates : kViews) + 1;
    return this.order().filter((view) => view.step === this.renderer.step && !this.loader.broken.has(view.index)).slice(0, count)
      .every((view) => this.renderer.store.has(view));
  }

  /** Nothing is to be drawn or being drawn; for programs that look at the page. */
  get still() {
    return this.loader.done && !this.dirty && !this.coarse && !this.arrivals && this.pace.idle(performance.now());
  }

  missing(problem) {
    showProblem(String(problem.message ?? problem));
    if (this.loader.done) this.complete();
  }

  /** The novel camera at the canvas' size times `scale`. */
  camera(scale = 1) {
    const { width, height } = this.canvas;
    return this.navigation.camera(Math.max(2, Math.round(width * scale)), Math.max(2, Math.round(height * scale)));
  }

  fitCanvas() {
    const box = this.canvas.getBoundingClientRect();
    const wanted = Math.max(1, box.width) * Math.max(1, box.height) * (devicePixelRatio || 1) ** 2;
    this.ratio = (devicePixelRatio || 1) * Math.min(1, Math.sqrt(kMaxCanvasPixels / wanted));
    const width = Math.max(2, Math.round(box.width * this.ratio)), height = Math.max(2, Math.round(box.height * this.ratio));
    if (this.canvas.width === width && this.canvas.height === height) return;
    this.canvas.width = width;
    this.canvas.height = height;
    this.dirty = true;
  }

  // Pixels of the page to those of the canvas.
  onCanvas(at) {
    return at.map((v) => v * this.ratio);
  }

  /** Depth of what is seen at a pixel of the canvas; null: nothing. */
  depthAt(pixel) {
    if (!this.frame) return null;
    const { novel } = this.frame;
    return this.renderer.depthAt([pixel[0] * novel.width / this.canvas.width, pixel[1] * novel.height / this.canvas.height]);
  }

  connect() {
    const { navigation } = this;
    const moved = () => { this.dirty = true; };
    this.pointers = new Pointers(this.canvas, {
      begin: (at) => this.begin(this.onCanvas(at)),
      orbit: (dx, dy) => {
        const windowPx = Math.max(this.canvas.width, this.canvas.height) / this.ratio;
        this.dragLine(dx) || navigation.orbit(dx, dy, windowPx);
        moved();
      },
      pan: (dx, dy) => { navigation.pan(dx * this.ratio, dy * this.ratio, this.camera()); moved(); },
      dolly: (factor, at) => { const p = this.onCanvas(at); navigation.dolly(factor, this.camera(), p, this.depthAt(p)); moved(); },
      click: (at) => this.click(this.onCanvas(at)),
    });
    const commands = {
      Period: () => this.stepPhoto(1), Comma: () => this.stepPhoto(-1), KeyC: () => this.toggle("compare"),
      KeyV: () => this.toggle("depth"), KeyM: () => this.toggle("measure"), KeyF: () => this.fullScreen(),
      KeyH: () => this.togglePanel(), Home: () => this.goTo(this.set.opening), Space: () => this.time.toggle(),
      KeyX: () => this.headset.toggle().catch((error) => showProblem(`the headset cannot be used: ${error.message}`)),
    };
    this.keys = new Keys(commands);
    for (const button of document.querySelectorAll("button[data-key]")) button.addEventListener("click", commands[button.dataset.key]);
    element("problem").addEventListener("click", () => { element("problem").hidden = true; });
    this.describe();
  }

  // Where a drag begins decides what it does: the line between image and photo, or the scene around what is there.
  begin(pixel) {
    const line = this.options.split * this.canvas.width;
    this.onLine = this.options.compare && Math.abs(pixel[0] - line) < 20 * this.ratio;
    const z = this.onLine ? null : this.depthAt(pixel);
    if (z) this.navigation.pivot = this.pointOf(pixel, z);
  }

  pointOf(pixel, z) {
    return pickedPoint(this.camera(), pixel, z, this.nearest()).point;
  }

  dragLine(dx) {
    if (!this.onLine) return false;
    this.options.split = Math.min(0.98, Math.max(0.02, this.options.split + dx * this.ratio / this.canvas.width));
    return true;
  }

  /** The photo taken nearest to where the camera is, of those loaded of the time step that is shown. */
  nearest() {
    const { step, store } = this.renderer;
    return this.order().find((view) => view.step === step && store.has(view)) ?? this.set.steps[step][0];
  }

  // The wanted time step is shown once the views that it is drawn from are there, or as much of them as can be.
  chooseStep() {
    const { renderer, loader } = this, wanted = this.order().filter((view) => view.step === this.time.step).slice(0, kViews);
    if (wanted.every((view) => renderer.store.has(view) || loader.broken.has(view.index)) || !this.pictureOf(renderer.step)) {
      renderer.step = this.time.step;
    }
  }

  pictureOf(step) {
    return this.set.steps[step].some((view) => this.renderer.store.has(view));
  }

  click(pixel) {
    if (!this.options.measure) return;
    const z = this.depthAt(pixel);
    if (!z) return;
    if (this.points.length === 2) this.points = [];
    this.points.push(pickedPoint(this.camera(), pixel, z, this.nearest()));
    this.dirty = true;
  }

  toggle(name) {
    this.options[name] = !this.options[name];
    if (name === "measure") this.points = [];
    document.querySelectorAll(`button[data-option=${name}]`).forEach((b) => b.setAttribute("aria-pressed", String(this.options[name])));
    this.canvas.classList.toggle("measuring", this.options.measure);
    this.dirty = true;
  }

  goTo(index) {
    this.navigation.goTo(index, performance.now());
    this.describe();
    this.dirty = true;
  }

  stepPhoto(by) {
    this.goTo(this.navigation.photo + by);
  }

  fullScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else document.documentElement.requestFullscreen?.().catch(() => {});
  }

  togglePanel() {
    element("panel").hidden = !element("panel").hidden;
  }

  describe() {
    const { photo } = this.navigation, views = this.set.steps[0];
    element("photo").textContent = `${photo + 1} / ${views.length}  ${views[photo].name}`;
  }

  // How coarse a frame is while the camera moves.
  adapt(ms) {
    if (ms > kSlowMs) this.level = Math.min(this.level + 1, kScales.length - 1);
    else if (ms < kFastMs) this.level = Math.max(this.level - 1, 0);
  }

  tick(now) {
    if (this.stopped || this.headset.active) return;
    const seconds = Math.min((now - this.last) / 1000, kMostStepS);
    this.fitCanvas();
    this.time.play(seconds, this.renderer.step === this.time.step);
    let moving = this.navigation.step(now);
    if (this.keys.flying) {
      const [x, y, z, turn] = this.keys.motion;
      this.navigation.fly(seconds, [x, y, z], [turn, 0]);
      moving = true;
    }
    moving ||= this.pointers.down.size > 0 && this.dirty;
    if (moving && this.wasMoving) this.adapt(now - this.last);
    this.takeArrivals(now);
    if (this.dirty || moving || this.coarse) this.drawFrame(moving ? kScales[this.level] : 1);
    this.wasMoving = moving;
    this.last = now;
    requestAnimationFrame((next) => this.tick(next));
  }

  drawFrame(scale) {
    this.dirty = this.arrivals = false;
    this.coarse = scale !== 1;
    this.chooseStep();
    if (!this.pictureOf(this.renderer.step)) return this.loader.run();
    this.frame = this.renderer.draw(this.camera(scale));
    const { options } = this;
    this.renderer.present(this.frame, {
      depth: options.depth, photo: options.compare ? this.nearest() : null, photoFrom: options.split * this.canvas.width,
      inverseDepths: this.inverseDepths(),
    });
    this.pace.drawn(performance.now());
    drawMeasure(element("marks"), this.camera(), this.points, this.set.unit);
    this.loader.run();
    this.pictured();
  }

  /** One eye's image into its part of a framebuffer. */
  drawEye(camera, framebuffer, viewport) {
    this.eye = camera;
    this.chooseStep();
    if (this.pictureOf(this.renderer.step)) this.renderer.compose(this.renderer.draw(camera), framebuffer, viewport, [0, 0], false);
    this.loader.run();
  }

  /** After the headset. */
  resume() {
    this.eye = null;
    this.dirty = true;
    requestAnimationFrame((now) => this.tick(now));
  }

  // The range of false colours: that of the measured depth of the views in use.
  inverseDepths() {
    const views = this.frame.views.length ? this.frame.views : this.set.views;
    return [1 / Math.min(...views.map((v) => v.measured.near)), 1 / Math.max(...views.map((v) => v.measured.far))];
  }

  /** For programs: the image of a camera {width, height, fx, fy, cx, cy, rotation, translation}, RGBA from the top row on. */
  render(camera, options = {}) {
    const frame = this.renderer.draw(placed(camera), options);
    const pixels = this.renderer.pixels(), seen = this.renderer.pixels(true);
    this.dirty = true;
    return { width: camera.width, height: camera.height, pixels, seen, views: frame.views.map((v) => v.name), perPixel: frame.perPixel };
  }
}
