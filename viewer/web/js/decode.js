// A view out of its bytes: what renderers need of it. Runs in workers, and without a document.
import { fail } from "./problem.js";
import { bytesOfText, crc32 } from "./bytes.js";
import { decodePlaces, decodeValues, inverseDepthTable } from "./depth_codes.js";
import { Samples, blockFlags } from "./breaks.js";
import { coverBlocks } from "./cover.js";
import { makeMesh } from "./mesh.js";
import { rimWidth } from "./selection.js";

const kMeshTolerancePx = 0.7;  // SPEC 5.1

// Of each pixel the chessboard distance to the nearest masked one, 0 at one.
function maskDistances(usable, view) {
  const { width, height } = view;
  const most = Math.min(rimWidth(view) + 1, 255);
  const distance = new Uint8Array(width * height);
  const at = (x, y) => (x >= 0 && y >= 0 && x < width && y < height ? distance[y * width + x] : most);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const around = Math.min(at(x - 1, y), at(x - 1, y - 1), at(x, y - 1), at(x + 1, y - 1), most - 1);
      distance[y * width + x] = usable[y * width + x] ? around + 1 : 0;
    }
  }
  for (let y = height - 1; y >= 0; --y) {
    for (let x = width - 1; x >= 0; --x) {
      const least = Math.min(at(x + 1, y), at(x + 1, y + 1), at(x, y + 1), at(x - 1, y + 1)) + 1;
      if (least < distance[y * width + x]) distance[y * width + x] = least;
    }
  }
  return distance;
}

// SPEC 2.1: samples whose image pixels are all masked.
function maskedSamples(distance, view) {
  const { columns, rows, scale, width } = view;
  const masked = new Uint8Array(columns * rows);
  for (let k = 0; k < masked.length; ++k) {
    const x0 = k % columns * scale, y0 = Math.floor(k / columns) * scale;
    let usable = false;
    for (let y = y0; y < y0 + scale && !usable; ++y) {
      for (let x = x0; x < x0 + scale && !usable; ++x) usable = distance[y * width + x] !== 0;
    }
    masked[k] = usable ? 0 : 1;
  }
  return masked;
}

// Measured and completed codes in one map.
function joined(measured, completed, measuredCodes) {
  for (let k = 0; k < measured.length; ++k) if (completed[k] !== 0) measured[k] = completed[k] + measuredCodes;
  return measured;
}

/**
 * The view of a header with its pixels, of {text} (bytes as text) or {bytes}: photo (ImageBitmap), codes, flags of blocks, mesh, mask
 * distances (null: no mask).
 */
export async function decodeView(view, data) {
  const where = `photo ${view.name}`;
  const bytes = data.bytes ?? bytesOfText(data.text, view.bytes, where);
  if (bytes.length !== view.bytes) fail(where, `${view.bytes} bytes`, String(bytes.length));
  if (crc32(bytes) !== view.crc) fail(where, "bytes of its checksum", "others");
  const part = (name) => bytes.subarray(view.parts[name].first, view.parts[name].end);
  const photo = await createImageBitmap(new Blob([part("image")], { type: "image/jpeg" }),
    { colorSpaceConversion: "none", premultiplyAlpha: "none" }).catch(() => fail(`${where}: image`, "a JPEG", "something else"));
  if (photo.width !== view.width || photo.height !== view.height) {
    fail(`${where}: image`, `${view.width}x${view.height} pixels`, `${photo.width}x${photo.height}`);
  }
  const { columns, rows } = view;
  const placesOf = (name, known) => decodePlaces(part(name), columns, rows, known, `${where}: ${name}`);
  const codesOf = (places, code, name) => decodeValues(part(name), places, columns, rows, code.steps + 1, `${where}: ${name}`);
  const measured = codesOf(placesOf("depth_places", null), view.measured, "depth");
  const codes = view.completed
    ? joined(measured, codesOf(placesOf("completed_places", measured), view.completed, "completed"), view.measured.steps + 1)
    : measured;
  const distance = view.parts.mask.size > 0
    ? maskDistances(decodePlaces(part("mask"), view.width, view.height, null, `${where}: mask`), view) : null;
  const masked = distance && maskedSamples(distance, view);
  if (masked) for (let k = 0; k < codes.length; ++k) if (masked[k]) codes[k] = 0;
  const table = inverseDepthTable(view);
  const w = new Float64Array(codes.length);
  for (let k = 0; k < w.length; ++k) w[k] = table[codes[k]];
  const pixel = 1 / (view.fx * view.baseline), samples = new Samples(w, columns, rows, pixel);
  const mesh = makeMesh(samples, coverBlocks(samples, kMeshTolerancePx * pixel));
  return { photo, codes, blocks: blockFlags(samples, masked), mesh, distance };
}

/** In a worker: takes {view, bytes}, answers {pixels} or {problem}. */
export function serveDecoding(scope) {
  scope.onmessage = async ({ data }) => {
    try {
      const pixels = await decodeView(data.view, data.bytes);
      const { photo, codes, blocks, mesh, distance } = pixels;
      scope.postMessage({ index: data.view.index, pixels }, [photo, codes.buffer, blocks.buffer, mesh.vertices.buffer,
        mesh.indices.buffer, mesh.cells.buffer, ...(distance ? [distance.buffer] : [])]);
    } catch (error) {
      scope.postMessage({ index: data.view.index, problem: String(error.message ?? error) });
    }
  };
}
