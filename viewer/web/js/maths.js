// Vectors of 3, rotations as rows of 3x3 matrices, unit quaternions w x y z. Double precision throughout: the world's
// origin cancels before anything becomes a float (SPEC 0.5).

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
export const clamp = (v, low, high) => Math.min(Math.max(v, low), high);

export function unit(a) {
  const length = norm(a);
  return length > 0 ? scaled(a, 1 / length) : [0, 0, 1];
}

/** Angle in [0, pi], SPEC 1.1. */
export const angleBetween = (a, b) => Math.atan2(norm(cross(a, b)), dot(a, b));

export const times = (m, v) => [dot(m[0], v), dot(m[1], v), dot(m[2], v)];
export const transposed = (m) => [0, 1, 2].map((j) => [m[0][j], m[1][j], m[2][j]]);

export function product(a, b) {
  const columns = transposed(b);
  return a.map((row) => columns.map((column) => dot(row, column)));
}

export function matrixOfQuaternion([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

/** Of a rotation's rows; Shepperd 1978: from the largest of the four. */
export function quaternionOfMatrix([[a, b, c], [d, e, f], [g, h, i]]) {
  const squares = [1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i], largest = squares.indexOf(Math.max(...squares));
  const q = [[squares[0], h - f, c - g, d - b], [h - f, squares[1], b + d, c + g], [c - g, b + d, squares[2], f + h],
    [d - b, c + g, f + h, squares[3]]][largest];
  return unitQuaternion(q);
}

export function unitQuaternion(q) {
  const length = Math.hypot(...q);
  return q.map((v) => v / length);
}

/** Rotation about a unit axis. */
export function quaternionAbout(axis, angle) {
  const s = Math.sin(angle / 2);
  return [Math.cos(angle / 2), axis[0] * s, axis[1] * s, axis[2] * s];
}

export function quaternionProduct(a, b) {
  return [
    a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
    a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
    a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
    a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
  ];
}

export const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];

/** Angle of the rotation between two orientations. */
export function angularDistance(a, b) {
  const [w, x, y, z] = quaternionProduct(a, conjugate(b));
  return 2 * Math.atan2(Math.hypot(x, y, z), Math.abs(w));
}

/** From a (share 0) to b (share 1) at constant speed, the short way round. */
export function slerp(a, b, share) {
  let cosine = a.reduce((sum, v, i) => sum + v * b[i], 0);
  const sign = cosine < 0 ? -1 : 1;
  cosine = Math.min(Math.abs(cosine), 1);
  const angle = Math.acos(cosine);
  const [p, q] = angle < 1e-6 ? [1 - share, share]
    : [Math.sin((1 - share) * angle) / Math.sin(angle), Math.sin(share * angle) / Math.sin(angle)];
  return unitQuaternion(a.map((v, i) => p * v + sign * q * b[i]));
}
