// Where cameras are and what they see. A novel camera is {width, height, fx, fy, cx, cy, rotation, translation}: cam_from_world,
// x right, y down, z forward; pixel centres at + 0.5.
import { matrixOfQuaternion, scaled, times, transposed, unitQuaternion, add } from "./maths.js";

/** With what follows from the pose: matrix (cam_from_world) and centre in the world. */
export function placed(camera) {
  const rotation = unitQuaternion(camera.rotation);
  const matrix = matrixOfQuaternion(rotation);
  return { ...camera, rotation, matrix, centre: scaled(times(transposed(matrix), camera.translation), -1) };
}

/** A set with its views placed, and `steps`, the views of each time step. */
export function placedSet(set) {
  const views = set.views.map(placed);
  return { ...set, views, steps: set.times.map((_, i) => views.filter((view) => view.step === i)) };
}

/** A camera at `centre` with orientation `rotation`. */
export function cameraAt(intrinsics, rotation, centre) {
  return placed({ ...intrinsics, rotation, translation: scaled(times(matrixOfQuaternion(unitQuaternion(rotation)), centre), -1) });
}

/** The point in the camera's frame. */
export const inCamera = (camera, p) => add(times(camera.matrix, p), camera.translation);

/** Pixel of a point of the world; null behind the camera. */
export function pixelOf(camera, p) {
  const q = inCamera(camera, p);
  return q[2] > 0 ? [camera.fx * q[0] / q[2] + camera.cx, camera.fy * q[1] / q[2] + camera.cy] : null;
}

export const rayOf = (camera, [x, y]) => [(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1];

/** The point of the world at plane depth z behind a pixel. */
export const pointAt = (camera, pixel, z) => add(times(transposed(camera.matrix), scaled(rayOf(camera, pixel), z)), camera.centre);

/** The same camera for a canvas of another size, which the photo fills. */
export function filling(photo, width, height) {
  const scale = Math.max(width / photo.width, height / photo.height);
  return {
    width, height, fx: photo.fx * scale, fy: photo.fy * scale,
    cx: width / 2 + (photo.cx - photo.width / 2) * scale, cy: height / 2 + (photo.cy - photo.height / 2) * scale,
  };
}

/** fx, fy, cx, cy in pixels of a perspective projection matrix of OpenGL, 16 numbers, column by column. */
export function intrinsicsOf(projection, width, height) {
  const p = projection;
  return { fx: p[0] * width / 2, fy: p[5] * height / 2, cx: (1 - p[8]) * width / 2, cy: (1 + p[9]) * height / 2 };
}

/** Towards the sky, from how the photos were held: the mean of their upward axes. */
export function upOf(views) {
  const sum = views.reduce((total, view) => add(total, scaled(view.matrix[1], -1)), [0, 0, 0]);
  const length = Math.hypot(...sum);
  return length > 0.1 * views.length ? scaled(sum, 1 / length) : scaled(views[0].matrix[1], -1);
}
