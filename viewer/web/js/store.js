// The views on the GPU: texture arrays of one layer a view, meshes; least wanted views make room where memory is short.
import { Program, makeTexture } from "./gl.js";
import { rimWidth } from "./selection.js";
import { Problem } from "./problem.js";

const kGpuBytes = 512 << 20;
const kLinearFromSrgb = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const kSrgbFromLinear = (v) => (v <= 0.0031308 ? v * 12.92 : 1.055 * v ** (1 / 2.4) - 0.055);

// SPEC 4.4: each 8-bit value in the mean exposure of the set, RGBA.
function gainTable(gain) {
  const table = new Uint8Array(4 * 256).fill(255);
  for (let v = 0; v < 256; ++v) {
    for (let c = 0; c < 3; ++c) {
      const linear = kLinearFromSrgb(v / 255), g = gain[c];
      const exposed = g === 1 ? linear : g * linear / ((1 + (g ** 4 - 1) * linear ** 4) ** 0.25);
      table[4 * v + c] = g === 1 ? v : Math.floor(Math.min(kSrgbFromLinear(exposed), 1) * 255 + 0.5);
    }
  }
  return table;
}

/** What of the set is ready to be drawn. */
export class ViewStore {
  constructor(gl, shaders, views) {
    this.gl = gl;
    const side = (of) => Math.max(...views.map(of));
    const width = side((v) => v.width), height = side((v) => v.height);
    const columns = side((v) => v.columns) + 1, rows = side((v) => v.rows) + 1;
    const limit = gl.getParameter(gl.MAX_TEXTURE_SIZE);
    if (Math.max(width, height, columns, rows) > limit) {
      throw new Problem(`this browser's WebGL2 has textures of at most ${limit} pixels a side, a photo of this page has more`);
    }
    const bytes = width * height * 4 + columns * rows * 3;
    const layers = Math.max(1, Math.min(views.length, gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS), Math.floor(kGpuBytes / bytes)));
    const array = (format, w, h) => makeTexture(gl, gl.TEXTURE_2D_ARRAY, format, w, h, layers);
    this.images = array(gl.RGBA8, width, height);
    this.depths = array(gl.R16UI, columns, rows);
    this.blocks = array(gl.R8UI, columns, rows);
    this.free = Array.from({ length: layers }, (_, i) => layers - 1 - i);
    this.layers = layers;
    this.loaded = new Map();  // view's index to {layer, meshes}
    this.prepare = [0, 1].map((masked) => new Program(gl, shaders, "full_screen.vert", "prepare.frag", { MASKED: masked }));
    this.framebuffer = gl.createFramebuffer();
  }

  has(view) {
    return this.loaded.has(view.index);
  }

  layerOf(view) {
    return this.loaded.get(view.index).layer;
  }

  /** Room for one more view: the last of `order` that is loaded, most wanted first, goes. */
  makeRoom(order) {
    if (this.free.length > 0) return;
    const last = order.findLast((view) => this.has(view));
    if (last) this.drop(last);
  }

  drop(view) {
    const { gl } = this, entry = this.loaded.get(view.index);
    for (const mesh of [entry.triangles, entry.cells]) {
      gl.deleteVertexArray(mesh.array);
      mesh.buffers.forEach((buffer) => gl.deleteBuffer(buffer));
    }
    this.free.push(entry.layer);
    this.loaded.delete(view.index);
  }

  put(view, pixels) {
    if (this.has(view)) return;
    const { gl } = this, layer = this.free.pop();
    const upload = (texture, width, height, data, type) => {
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, width, height, 1, gl.RED_INTEGER, type, data);
    };
    gl.activeTexture(gl.TEXTURE0);
    upload(this.depths, view.columns, view.rows, pixels.codes, gl.UNSIGNED_SHORT);
    upload(this.blocks, view.columns + 1, view.rows + 1, pixels.blocks, gl.UNSIGNED_BYTE);
    this.putImage(view, pixels, layer);
    this.loaded.set(view.index, { layer, triangles: this.triangles(pixels.mesh), cells: this.cells(pixels.mesh) });
  }

  // A texture for the time of one draw.
  temporary(format, width, height, fill) {
    const { gl } = this;
    const texture = makeTexture(gl, gl.TEXTURE_2D, format, width, height);
    fill();
    return texture;
  }

  putImage(view, { photo, distance }, layer) {
    const { gl } = this, { width, height } = view;
    for (const name of [gl.UNPACK_FLIP_Y_WEBGL, gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL]) gl.pixelStorei(name, false);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    const source = this.temporary(gl.RGBA8, width, height, () =>
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, photo));
    const gain = this.temporary(gl.RGBA8, 256, 1, () =>
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, gainTable(view.gain)));
    const distances = distance && this.temporary(gl.R8UI, width, height, () =>
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RED_INTEGER, gl.UNSIGNED_BYTE, distance));
    photo.close();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, this.images, 0, layer);
    gl.viewport(0, 0, width, height);
    const program = this.prepare[distance ? 1 : 0].use().bind("photo", 0, gl.TEXTURE_2D, source).bind("gain", 1, gl.TEXTURE_2D, gain);
    if (distances) program.bind("distance_px", 2, gl.TEXTURE_2D, distances);
    gl.uniform2i(program.place("size_px"), width, height);
    program.set("rim_px", rimWidth(view));
    gl.bindVertexArray(null);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    for (const texture of [source, gain, distances]) if (texture) gl.deleteTexture(texture);
  }

  vertexArray(data, attributes, perInstance, indices) {
    const { gl } = this, array = gl.createVertexArray(), buffers = [gl.createBuffer()];
    const stride = 4 * attributes.reduce((sum, n) => sum + n, 0);
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    let offset = 0;
    attributes.forEach((count, i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, count, gl.FLOAT, false, stride, offset);
      gl.vertexAttribDivisor(i, perInstance ? 1 : 0);
      offset += 4 * count;
    });
    if (indices) {
      buffers.push(gl.createBuffer());
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    }
    gl.bindVertexArray(null);
    return { array, buffers };
  }

  triangles(mesh) {
    return { ...this.vertexArray(mesh.vertices, [3], false, mesh.indices), count: mesh.indices.length };
  }

  cells(mesh) {
    return { ...this.vertexArray(mesh.cells, [3, 2], true), count: mesh.cellCount };
  }
}
