// WebGL2 in small pieces: programs of embedded shaders, textures, targets.
import { Problem } from "./problem.js";

/** The text of a shader with what it includes; `shaders`: name to text. */
export function shaderText(shaders, name, defines = {}) {
  const seen = new Set();
  const resolve = (file) => {
    if (seen.has(file)) return "";
    seen.add(file);
    if (!(file in shaders)) throw new Problem(`shader ${file}: not in the page; export it again`);
    return shaders[file].replace(/^#include "([^"]+)"$/gm, (_, included) => resolve(included));
  };
  const lines = Object.entries(defines).map(([key, value]) => `#define ${key} ${value}`);
  return ["#version 300 es", "precision highp float;", "precision highp int;", "precision highp usampler2D;",
    "precision highp usampler2DArray;", "precision highp sampler2DArray;", ...lines, resolve(name)].join("\n");
}

function compile(gl, type, text, name) {
  const shader = gl.createShader(type);
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  return { shader, name };
}

/** A program with its uniforms' places by name. */
export class Program {
  constructor(gl, shaders, vertex, fragment, defines = {}) {
    this.gl = gl;
    this.program = gl.createProgram();
    const parts = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([type, name]) =>
      compile(gl, type, shaderText(shaders, name, defines), name));
    for (const { shader } of parts) gl.attachShader(this.program, shader);
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = parts.map(({ shader, name }) => [name, gl.getShaderInfoLog(shader)]).filter(([, log]) => log);
      const log = logs.map((l) => l.join(": ")).join("; ") || gl.getProgramInfoLog(this.program);
      throw new Problem(`this browser's WebGL2 rejects a shader: ${log}`);
    }
    for (const { shader } of parts) gl.deleteShader(shader);
    this.places = new Map();
  }

  use() {
    this.gl.useProgram(this.program);
    return this;
  }

  place(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name);
  }

  /** Floats of 1 to 4, or a 3x3 matrix of rows. */
  set(name, ...values) {
    const { gl } = this;
    const at = this.place(name);
    if (Array.isArray(values[0])) gl.uniformMatrix3fv(at, true, values[0].flat());
    else gl[`uniform${values.length}f`](at, ...values);
    return this;
  }

  setInt(name, value) {
    this.gl.uniform1i(this.place(name), value);
    return this;
  }

  /** Binds a texture to a unit of its own. */
  bind(name, unit, target, texture) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(target, texture);
    return this.setInt(name, unit);
  }
}

const kUnits = 4;  // of textures that shaders use together

/** The state that the renderer expects, whatever another program left. */
export function takeState(gl) {
  for (const what of [gl.BLEND, gl.SCISSOR_TEST, gl.STENCIL_TEST, gl.DEPTH_TEST, gl.CULL_FACE, gl.POLYGON_OFFSET_FILL, gl.DITHER,
    gl.RASTERIZER_DISCARD, gl.SAMPLE_ALPHA_TO_COVERAGE, gl.SAMPLE_COVERAGE]) gl.disable(what);
  gl.colorMask(true, true, true, true);
  gl.depthRange(0, 1);
  gl.bindVertexArray(null);
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  gl.bindBuffer(gl.PIXEL_PACK_BUFFER, null);
  for (let i = 0; i < kUnits; ++i) gl.bindSampler(i, null);
  for (const name of [gl.UNPACK_FLIP_Y_WEBGL, gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL]) gl.pixelStorei(name, false);
  for (const name of [gl.UNPACK_ROW_LENGTH, gl.UNPACK_SKIP_ROWS, gl.UNPACK_SKIP_PIXELS, gl.UNPACK_SKIP_IMAGES, gl.UNPACK_IMAGE_HEIGHT,
    gl.PACK_ROW_LENGTH, gl.PACK_SKIP_ROWS, gl.PACK_SKIP_PIXELS]) gl.pixelStorei(name, 0);
}

/** A texture for texelFetch: nearest, clamped, without levels. */
export function makeTexture(gl, target, format, width, height, layers = 0) {
  const texture = gl.createTexture();
  gl.bindTexture(target, texture);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, gl.NEAREST);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
  if (layers > 0) gl.texStorage3D(target, 1, format, width, height, layers);
  else gl.texStorage2D(target, 1, format, width, height);
  return texture;
}

/** A framebuffer of textures of one size: colours in order, and depth. */
export class Target {
  constructor(gl, width, height, formats, withDepth = false) {
    Object.assign(this, { gl, width, height });
    this.framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    this.textures = formats.map((format, i) => {
      const texture = makeTexture(gl, gl.TEXTURE_2D, format, width, height);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0);
      return texture;
    });
    if (withDepth) {
      this.depth = makeTexture(gl, gl.TEXTURE_2D, gl.DEPTH_COMPONENT32F, width, height);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.depth, 0);
    }
    gl.drawBuffers(formats.length ? formats.map((_, i) => gl.COLOR_ATTACHMENT0 + i) : [gl.NONE]);
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost()) {
      throw new Problem("this browser's WebGL2 cannot draw into the formats that this page needs");
    }
  }

  bind() {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.framebuffer);
    this.gl.viewport(0, 0, this.width, this.height);
  }

  delete() {
    const { gl } = this;
    for (const texture of [...this.textures, this.depth]) if (texture) gl.deleteTexture(texture);
    gl.deleteFramebuffer(this.framebuffer);
  }
}
