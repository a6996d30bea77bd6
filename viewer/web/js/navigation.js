// Where the novel camera goes: around a point, through the scene, from photo to photo.
import { cameraAt, filling, pointAt } from "./camera.js";
import {
  add, angleBetween, conjugate, dot, norm, quaternionAbout, quaternionProduct, scaled, slerp, sub, unitQuaternion,
} from "./maths.js";

const kMinOrbit = Math.PI / 8;   // radians by a drag across the canvas, which otherwise orbits by what the cameras span
const kLeastFromPole = 0.05;     // radians between the view and straight up or down
const kFlightShare = 0.6;        // of the distance to the pivot, per second
const kTurnPerSecond = 1;        // radians
const kPhotoMs = 500;

/** The novel camera as the user moves it. Angles are rotations of the camera in the world. */
export class Navigation {
  constructor(set, up) {
    this.set = set;
    this.up = up;
    this.jump = null;
    this.photo = set.opening;
    this.place(set.views[this.photo]);
  }

  /** At a photo's own place, at once. */
  place(view) {
    this.lens = view;
    this.rotation = view.rotation;
    this.centre = view.centre;
    this.pivot = this.ahead();
  }

  /** The camera for a canvas. */
  camera(width, height) {
    return cameraAt(filling(this.lens, width, height), this.rotation, this.centre);
  }

  get forward() {
    return cameraAt(this.lens, this.rotation, this.centre).matrix[2];
  }

  get distance() {
    return Math.max(norm(sub(this.pivot, this.centre)), 1e-9);
  }

  // The point in front of the camera that is as far as the scene's centre.
  ahead() {
    const forward = this.forward, depth = dot(sub(this.set.center, this.centre), forward);
    return add(this.centre, scaled(forward, depth > 0 ? depth : norm(sub(this.set.center, this.centre))));
  }

  // Rotates the camera in the world about a point.
  turn(axis, angle, about) {
    const q = quaternionAbout(axis, angle);
    const turned = (v) => quaternionProduct(quaternionProduct(q, [0, ...v]), conjugate(q)).slice(1);
    this.rotation = unitQuaternion(quaternionProduct(this.rotation, conjugate(q)));
    this.centre = add(about, turned(sub(this.centre, about)));
  }

  /** Drags the scene by pixels of the page, `side` of them along its longer side: the camera goes around the pivot. */
  orbit(dx, dy, side) {
    const perPx = Math.max(this.set.span, kMinOrbit) / side;
    this.rotateAbout(this.pivot, -dx * perPx, -dy * perPx);
  }

  // About the vertical and the camera's own horizontal axis.
  rotateAbout(about, yaw, pitch) {
    this.jump = null;
    this.turn(this.up, yaw, about);
    const right = cameraAt(this.lens, this.rotation, this.centre).matrix[0];
    const fromUp = angleBetween(this.forward, this.up);
    const next = fromUp - pitch;
    if ((next > kLeastFromPole || pitch < 0) && (next < Math.PI - kLeastFromPole || pitch > 0)) this.turn(right, pitch, about);
  }

  /** Moves the camera so that what is as far as the pivot moves by these pixels of the canvas. */
  pan(dx, dy, camera) {
    this.jump = null;
    const depth = Math.max(dot(sub(this.pivot, this.centre), camera.matrix[2]), 1e-9);
    const step = add(scaled(camera.matrix[0], -dx * depth / camera.fx), scaled(camera.matrix[1], -dy * depth / camera.fy));
    this.centre = add(this.centre, step);
    this.pivot = add(this.pivot, step);
  }

  /** Goes towards what is seen at a pixel: distances to it become `factor` times as large. `z`: its depth, if known. */
  dolly(factor, camera, pixel, z) {
    this.jump = null;
    const target = pointAt(camera, pixel, z ?? this.distance);
    this.centre = add(target, scaled(sub(this.centre, target), factor));
  }

  /** Flies on for some seconds; `keys`: how much to the right, down and forward, each -1, 0 or 1, then turns likewise. */
  fly(seconds, [x, y, z], [turnX, turnY]) {
    this.jump = null;
    const { matrix } = cameraAt(this.lens, this.rotation, this.centre);
    const step = scaled(add(add(scaled(matrix[0], x), scaled(matrix[1], y)), scaled(matrix[2], z)), seconds * kFlightShare * this.distance);
    this.centre = add(this.centre, step);
    this.pivot = add(this.pivot, step);
    if (turnX || turnY) {
      this.rotateAbout(this.centre, turnX * kTurnPerSecond * seconds, -turnY * kTurnPerSecond * seconds);
      this.pivot = add(this.centre, scaled(this.forward, this.distance));
    }
  }

  /** Goes to a photo within half a second. */
  goTo(index, now) {
    const { views } = this.set;
    this.photo = (index % views.length + views.length) % views.length;
    const view = views[this.photo];
    this.jump = { from: { rotation: this.rotation, centre: this.centre }, to: view, start: now };
    this.lens = view;
  }

  /** Moves on along a jump; true while there is one. */
  step(now) {
    if (!this.jump) return false;
    const share = Math.min((now - this.jump.start) / kPhotoMs, 1), eased = share * share * (3 - 2 * share);
    const { from, to } = this.jump;
    if (share === 1) {
      this.place(to);
      this.jump = null;
      return true;
    }
    this.rotation = slerp(from.rotation, to.rotation, eased);
    this.centre = add(scaled(from.centre, 1 - eased), scaled(to.centre, eased));
    return true;
  }
}
