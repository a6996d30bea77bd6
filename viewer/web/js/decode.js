// A view out of the page's text: what renderers need of it. Runs in workers, and without a document.
import { fail } from "./problem.js";
import { bytesOfText, crc32, inflate } from "./bytes.js";
import { decodeCodes, inverseDepthTable } from "./depth_codes.js";
import { Samples, blockFlags } from "./breaks.js";
import { makeMesh, parseCover } from "./mesh.js";
import { rimWidth } from "./selection.js";

// Bits, rows padded to bytes, 1: usable. Of each pixel the chessboard distance to the nearest masked one, 0 at one.
function maskDistances(bits, view, where) {
  const { width, height } = view, rowBytes = (width + 7) >> 3;
  if (bits.length !== rowBytes * height) fail(where, `${rowBytes * height} bytes`, String(bits.length));
  const most = Math.min(rimWidth(view) + 1, 255);
  const distance = new Uint8Array(width * height);
  const at = (x, y) => (x >= 0 && y >= 0 && x < width && y < height ? distance[y * width + x] : most);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const usable = bits[y * rowBytes + (x >> 3)] >> (x & 7) & 1;
      distance[y * width + x] = usable ? Math.min(at(x - 1, y), at(x - 1, y - 1), at(x, y - 1), at(x + 1, y - 1), most - 1) + 1 : 0;
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

/** The view of a header with its pixels: photo (ImageBitmap), codes, flags of blocks, mesh, mask distances (null: no mask). */
export async function decodeView(view, text) {
  const where = `photo ${view.name}`;
  const bytes = bytesOfText(text, view.bytes, where);
  if (crc32(bytes) !== view.crc) fail(where, "bytes of its checksum", "others");
  const part = (name) => bytes.subarray(view.parts[name].first, view.parts[name].end);
  const inflated = (name) => (view.parts[name].size > 0 ? inflate(part(name), view.parts[name].size, `${where}: ${name}`) : null);
  const [mask, cover] = await Promise.all(["mask", "mesh"].map(inflated));
  const photo = await createImageBitmap(new Blob([part("image")], { type: "image/jpeg" }),
    { colorSpaceConversion: "none", premultiplyAlpha: "none" }).catch(() => fail(`${where}: image`, "a JPEG", "something else"));
  if (photo.width !== view.width || photo.height !== view.height) {
    fail(`${where}: image`, `${view.width}x${view.height} pixels`, `${photo.width}x${photo.height}`);
  }
  const { columns, rows } = view;
  const codes = decodeCodes(part("depth"), view, `${where}: depth`);
  const distance = mask && maskDistances(mask, view, `${where}: mask`);
  const masked = distance && maskedSamples(distance, view);
  if (masked) for (let k = 0; k < codes.length; ++k) if (masked[k]) codes[k] = 0;
  const table = inverseDepthTable(view);
  const w = Float64Array.from(codes, (code) => table[code]);
  const samples = new Samples(w, columns, rows, 1 / (view.fx * view.baseline));
  const mesh = makeMesh(samples, cover ? parseCover(cover, columns, rows, `${where}: mesh`) : [], `${where}: mesh`);
  return { photo, codes, blocks: blockFlags(samples, masked), mesh, distance };
}

/** In a worker: takes {view, text}, answers {pixels} or {problem}. */
export function serveDecoding(scope) {
  scope.onmessage = async ({ data }) => {
    try {
      const pixels = await decodeView(data.view, data.text);
      const { photo, codes, blocks, mesh, distance } = pixels;
      scope.postMessage({ index: data.view.index, pixels }, [photo, codes.buffer, blocks.buffer, mesh.vertices.buffer,
        mesh.indices.buffer, mesh.cells.buffer, ...(distance ? [distance.buffer] : [])]);
    } catch (error) {
      scope.postMessage({ index: data.view.index, problem: String(error.message ?? error) });
    }
  };
}
