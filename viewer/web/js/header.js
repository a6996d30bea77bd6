// The page's description of the set, checked before anything is allocated for it.
import { fail } from "./problem.js";

const kVersion = 2;
const kMaxViews = 4096;
const kMaxSidePx = 16384;
const kMaxPixels = 1 << 26;
const kMaxCode = 65535;

function number(value, where, least, most) {
  if (typeof value === "number" && value >= least && value <= most) return value;
  return fail(where, `a number from ${least} to ${most}`, JSON.stringify(value));
}

function whole(value, where, least, most) {
  if (Number.isInteger(value) && value >= least && value <= most) return value;
  return fail(where, `a whole number from ${least} to ${most}`, JSON.stringify(value));
}

function numbers(value, count, where, least = -1e12, most = 1e12) {
  if (!Array.isArray(value) || value.length !== count) return fail(where, `${count} numbers`, JSON.stringify(value));
  return value.map((v, i) => number(v, `${where}[${i}]`, least, most));
}

function words(value, where) {
  return typeof value === "string" ? value : fail(where, "text", JSON.stringify(value));
}

// A range of inverse depth in steps; null where there is none.
function codeOf(value, where) {
  if (value === null) return null;
  if (typeof value !== "object") return fail(where, "an object", JSON.stringify(value));
  const near = number(value.near_z, `${where}.near_z`, 1e-30, 1e30);
  const far = number(value.far_z, `${where}.far_z`, near, 1e30);
  return { near, far, steps: whole(value.steps, `${where}.steps`, 1, kMaxCode - 1) };
}

const kParts = ["image", "depth_places", "depth", "completed_places", "completed", "mask"];

function partsOf(value, bytes, where) {
  const parts = {};
  let end = 0;
  for (const name of kParts) {
    const size = whole(value?.[name] ?? 0, `${where}.${name}`, 0, bytes);
    parts[name] = { first: end, end: end + size, size };
    end += size;
  }
  return end === bytes ? parts : fail(where, `parts of ${bytes} bytes together`, String(end));
}

function viewOf(value, index) {
  const where = `views[${index}]`;
  const width = whole(value?.width, `${where}.width`, 1, kMaxSidePx);
  const height = whole(value.height, `${where}.height`, 1, kMaxSidePx);
  if (width * height > kMaxPixels) fail(where, `at most ${kMaxPixels} pixels`, `${width}x${height}`);
  const scale = whole(value.depth_scale, `${where}.depth_scale`, 1, kMaxSidePx);
  if (width % scale || height % scale) fail(`${where}.depth_scale`, "a divisor of the image's sides", String(scale));
  const [fx, fy, cx, cy] = numbers(value.camera, 4, `${where}.camera`, -1e7, 1e7);
  if (!(fx > 0 && fy > 0)) fail(`${where}.camera`, "focal lengths above 0", `${fx}, ${fy}`);
  const measured = codeOf(value.depth, `${where}.depth`);
  const completed = codeOf(value.completed, `${where}.completed`);
  if (!measured) fail(`${where}.depth`, "a range of depth", "none");
  if (measured.steps + (completed ? completed.steps : 0) + 2 > kMaxCode) {
    fail(where, "steps that fit 16 bits together", "more");
  }
  const bytes = whole(value.bytes, `${where}.bytes`, 1, 1 << 30);
  const rotation = numbers(value.rotation_wxyz, 4, `${where}.rotation_wxyz`, -1.001, 1.001);
  if (!(Math.abs(Math.hypot(...rotation) - 1) < 1e-3)) fail(`${where}.rotation_wxyz`, "a unit quaternion", "none");
  return {
    index, name: words(value.name, `${where}.name`), width, height, scale,
    columns: width / scale, rows: height / scale, fx, fy, cx, cy, rotation,
    translation: numbers(value.translation, 3, `${where}.translation`),
    baseline: number(value.baseline, `${where}.baseline`, 1e-30, 1e30),
    gain: numbers(value.gain, 3, `${where}.gain`, 1e-3, 1e3), measured, completed,
    // 0: the set states none.
    sigmaPx: number(value.sigma_px, `${where}.sigma_px`, 0, 1e6),
    bytes, crc: whole(value.crc32, `${where}.crc32`, 0, 0xffffffff), parts: partsOf(value.parts, bytes, `${where}.parts`),
  };
}

// Views follow each other by their time step: to each of them the time step's index.
function timeStepsOf(value, count) {
  if (!Array.isArray(value) || value.length < 1 || value.length > count) {
    fail("set.time_steps", `1 to ${count} time steps`, String(value?.length));
  }
  const steps = value.map((step, i) => ({
    time: number(step?.time_s, `set.time_steps[${i}].time_s`, -1e12, 1e12),
    views: whole(step.views, `set.time_steps[${i}].views`, 1, count),
  }));
  const sum = steps.reduce((total, step) => total + step.views, 0);
  return sum === count ? steps : fail("set.time_steps", `${count} views together`, String(sum));
}

/** The set that the header's text describes. Throws a Problem for whatever the exporter cannot have written. */
export function parseHeader(text) {
  let json;
  try {
    json = JSON.parse(text);
  } catch {
    return fail("set", "a JSON object", "something else");
  }
  if (json?.format !== "dtr-web-page" || json.version !== kVersion) fail("set", `a dtr-web-page of version ${kVersion}`, "another format");
  if (!Array.isArray(json.views) || json.views.length < 1 || json.views.length > kMaxViews) {
    fail("set.views", `1 to ${kMaxViews} views`, String(json.views?.length));
  }
  const steps = timeStepsOf(json.time_steps, json.views.length);
  const stepOfView = steps.flatMap((step, i) => Array(step.views).fill(i));
  const bounds = json.bounds === null ? null
    : { min: numbers(json.bounds?.min, 3, "set.bounds.min"), max: numbers(json.bounds?.max, 3, "set.bounds.max") };
  return {
    name: words(json.name, "set.name"), unit: words(json.unit, "set.unit"), bounds,
    center: numbers(json.scene_center, 3, "set.scene_center"),
    // Pages exported before 0.2 have neither.
    opening: whole(json.opening_view ?? 0, "set.opening_view", 0, steps[0].views - 1),
    span: number(json.camera_span_rad ?? Math.PI, "set.camera_span_rad", 0, Math.PI),
    validation: words(json.validation, "set.validation"),
    failed: json.validation_failed === true,
    figures: Array.isArray(json.figures) ? json.figures.filter((f) => Array.isArray(f) && f.length === 2).map((f) => f.map(String)) : [],
    times: steps.map((step) => step.time),
    views: json.views.map((view, i) => ({ ...viewOf(view, i), step: stepOfView[i] })),
  };
}
