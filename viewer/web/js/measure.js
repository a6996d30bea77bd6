// The distance between two points of the scene, with its standard deviation where the set states that of depth.
import { dot, norm, scaled, sub } from "./maths.js";
import { pixelOf, pointAt } from "./camera.js";

/** A point that was picked: where it is, along which ray, and the standard deviation along it. */
export function pickedPoint(camera, pixel, z, view) {
  const point = pointAt(camera, pixel, z);
  // 1/z of the nearest view's map is off by sigmaPx pixels of disparity; seen from there the point is at `depth`.
  const depth = dot(view.matrix[2], sub(point, view.centre));
  const sigma = view.sigmaPx > 0 && depth > 0 ? view.sigmaPx * depth * depth / (view.fx * view.baseline) : 0;
  const ray = sub(point, view.centre);
  return { point, ray: scaled(ray, 1 / Math.max(norm(ray), 1e-30)), sigma: sigma * Math.max(norm(ray) / Math.max(depth, 1e-30), 1) };
}

/** Distance in scene units and its standard deviation, 0 where unknown. */
export function distanceBetween(a, b) {
  const difference = sub(b.point, a.point), distance = norm(difference);
  const along = distance > 0 ? scaled(difference, 1 / distance) : [0, 0, 1];
  return { distance, sigma: Math.hypot(dot(along, a.ray) * a.sigma, dot(along, b.ray) * b.sigma) };
}

/** In words. */
export function distanceText({ distance, sigma }, unit) {
  const name = unit === "metre" ? " m" : " units";
  const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(Math.max(sigma > 0 ? sigma : distance, 1e-9)))  - (sigma > 0 ? 2 : 1)));
  const error = sigma > 0 ? ` ± ${sigma.toFixed(digits)}` : "";
  return `${distance.toFixed(digits)}${error}${name}`;
}

/** Draws the points and the line between them into an SVG over the canvas. */
export function drawMeasure(svg, camera, points, unit) {
  const seen = points.map((p) => pixelOf(camera, p.point));
  const parts = seen.filter(Boolean).map(([x, y]) => `<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="5"/>`);
  if (points.length === 2 && seen[0] && seen[1]) {
    const [a, b] = seen, text = distanceText(distanceBetween(points[0], points[1]), unit);
    parts.unshift(`<line x1="${a[0].toFixed(1)}" y1="${a[1].toFixed(1)}" x2="${b[0].toFixed(1)}" y2="${b[1].toFixed(1)}"/>`);
    parts.push(`<text x="${((a[0] + b[0]) / 2 + 8).toFixed(1)}" y="${((a[1] + b[1]) / 2 - 8).toFixed(1)}">${text}</text>`);
  }
  svg.setAttribute("viewBox", `0 0 ${camera.width} ${camera.height}`);
  svg.innerHTML = parts.join("");
}
