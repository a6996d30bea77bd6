// WebXR: the page's scene in a headset, each eye from the views that it needs most.
import { intrinsicsOf, cameraAt } from "./camera.js";
import { add, cross, dot, quaternionOfMatrix, scaled, sub, times, transposed, unit } from "./maths.js";

const kMetresToPivot = 2;     // of sets whose unit is not known: how far away what the camera looks at is taken to be
const kFlightPerSecond = 1.5; // metres, with a stick pushed all the way
const kDeadStick = 0.15;
const kSlowEyesMs = 28, kFastEyesMs = 16;
const kEyeScales = [1, 0.75, 0.5, 0.35];

// Axes of the headset's space (x right, y up, z back) in the world, as rows: up is the set's, ahead is where the page looks.
function headsetAxes(forward, up) {
  const level = sub(forward, scaled(up, dot(forward, up)));
  const back = scaled(unit(level), -1);
  return [cross(up, back), up, back];
}

/** Offers the headset where the browser has one. */
export class Headset {
  /** `page`: {set, renderer, navigation, resume()}; `button` appears where immersive-vr is supported. */
  constructor(page, gl, up, button) {
    Object.assign(this, { page, gl, up, button, session: null, level: 0 });
    navigator.xr?.isSessionSupported?.("immersive-vr").then((can) => { button.hidden = !can; }, () => {});
  }

  get active() {
    return this.session !== null;
  }

  /** Into the headset, or out of it. Rejects where the browser does not let in. */
  async toggle() {
    if (this.session) return this.session.end();
    if (this.button.hidden) return;
    const session = await navigator.xr.requestSession("immersive-vr");
    await this.gl.makeXRCompatible();
    this.layer = new XRWebGLLayer(session, this.gl, { antialias: false, depth: false, stencil: false, alpha: false });
    session.updateRenderState({ baseLayer: this.layer });
    this.space = await session.requestReferenceSpace("local");
    this.begin();
    this.session = session;
    this.button.setAttribute("aria-pressed", "true");
    session.addEventListener("end", () => {
      this.session = null;
      this.button.setAttribute("aria-pressed", "false");
      this.page.resume();
    });
    session.requestAnimationFrame((now, frame) => this.tick(now, frame));
  }

  // Where the headset's space lies in the world.
  begin() {
    const { navigation, set } = this.page;
    this.axes = headsetAxes(navigation.forward, this.up);
    this.origin = navigation.centre;
    this.unitsPerMetre = set.unit === "metre" ? 1 : navigation.distance / kMetresToPivot;
    this.last = null;
  }

  inWorld(v) {
    return times(transposed(this.axes), v);
  }

  /** The camera of an eye, for so many pixels. */
  eyeCamera(eye, width, height) {
    const m = eye.transform.matrix, column = (j) => this.inWorld([m[4 * j], m[4 * j + 1], m[4 * j + 2]]);
    const rows = [column(0), scaled(column(1), -1), scaled(column(2), -1)];
    const centre = add(this.origin, scaled(column(3), this.unitsPerMetre));
    return cameraAt({ width, height, ...intrinsicsOf(eye.projectionMatrix, width, height) }, quaternionOfMatrix(rows), centre);
  }

  // Sticks fly to where the head looks.
  fly(seconds, pose) {
    for (const { gamepad } of this.session.inputSources ?? []) {
      const [x, y] = gamepad?.axes.length >= 4 ? gamepad.axes.slice(2, 4) : gamepad?.axes ?? [0, 0];
      if (!(Math.hypot(x, y) > kDeadStick)) continue;
      const m = pose.transform.matrix;
      const step = this.inWorld([0, 1, 2].map((i) => m[i] * x + m[8 + i] * y));
      this.origin = add(this.origin, scaled(step, seconds * kFlightPerSecond * this.unitsPerMetre));
    }
  }

  tick(now, frame) {
    if (!this.session) return;
    this.session.requestAnimationFrame((next, of) => this.tick(next, of));
    const ms = this.last === null ? kSlowEyesMs : now - this.last;
    if (ms > kSlowEyesMs) this.level = Math.min(this.level + 1, kEyeScales.length - 1);
    else if (ms < kFastEyesMs) this.level = Math.max(this.level - 1, 0);
    this.last = now;
    const pose = frame.getViewerPose(this.space);
    if (!pose) return;
    this.fly(Math.min(ms, 100) / 1000, pose);
    for (const eye of pose.views) {
      const { x, y, width, height } = this.layer.getViewport(eye), scale = kEyeScales[this.level];
      const camera = this.eyeCamera(eye, Math.max(2, Math.round(width * scale)), Math.max(2, Math.round(height * scale)));
      this.page.drawEye(camera, this.layer.framebuffer, [x, y, width, height]);
    }
  }
}
