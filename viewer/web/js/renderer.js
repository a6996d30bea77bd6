// The deferred method of docs/RENDER_SPEC.md (sections 4, 5, 7 and 8) on WebGL2.
import { Program, Target } from "./gl.js";
import { ViewStore } from "./store.js";
import { codeRange } from "./depth_codes.js";
import { norm, sub } from "./maths.js";
import { clippedOf, fadingOf, frameExposure, kCandidates, kMaxAngle, kViews, placementOf, selectViews } from "./selection.js";

const kFloatsPerView = 36;  // view.glsl

// The view's uniform block, view.glsl.
function blockOf(view, placement, cut, fading, clipped, layer, masked) {
  const codes = codeRange(view), scale = 1 / view.scale;
  const rows = placement.rotation.flatMap((row, i) => [...row, placement.translation[i]]);
  return [...rows, view.fx, view.fy, view.cx, view.cy, view.width, view.height, view.columns, view.rows,
    view.fx * scale, view.fy * scale, view.cx * scale, view.cy * scale,
    codes.measured.first, codes.measured.step, codes.completed.first, codes.completed.step,
    layer, masked ? 1 : 0, codes.measuredCodes, 1 / (view.fx * view.baseline), cut, fading.gain, fading.offset, clipped];
}

// Positions of the mesh, half samples, to the novel screen, times z.
function gridPlacement(view, placement, novel) {
  const half = 0.5 * view.scale;
  const rayFromGrid = [[half / view.fx, 0, -view.cx / view.fx], [0, half / view.fy, -view.cy / view.fy], [0, 0, 1]];
  const screen = (v) => [novel.fx * v[0] + novel.cx * v[2], novel.fy * v[1] + novel.cy * v[2], v[2]];
  const columns = [0, 1, 2].map((j) => screen(placement.rotation.map((row) =>
    row[0] * rayFromGrid[0][j] + row[1] * rayFromGrid[1][j] + row[2] * rayFromGrid[2][j])));
  return { fromGrid: [0, 1, 2].map((i) => columns.map((c) => c[i])), fromCentre: screen(placement.translation) };
}

/** Draws images of a set's loaded views. */
export class Renderer {
  constructor(gl, shaders, set) {
    Object.assign(this, { gl, shaders, set });
    // Half floats for hole filling where they can be drawn into, else sRGB's 8 bits, which every WebGL2 has.
    const floats = gl.getExtension("EXT_color_buffer_float") ?? gl.getExtension("EXT_color_buffer_half_float");
    this.cellFormat = floats ? gl.RGBA16F : gl.SRGB8_ALPHA8;
    this.store = new ViewStore(gl, shaders, set.views);
    this.step = 0;  // the time step that is drawn
    const program = (vertex, fragment, defines) => new Program(gl, shaders, vertex, fragment, defines);
    const screen = (fragment, defines) => program("full_screen.vert", fragment, defines);
    this.triangles = program("coarse_triangles.vert", "coarse.frag");
    this.cells = program("coarse_cells.vert", "coarse.frag");
    this.resolve = new Map();
    this.pullFinest = screen("pull.frag", { FINEST: 1 });
    this.pull = screen("pull.frag", { FINEST: 0 });
    this.push = screen("push.frag");
    this.fill = screen("fill.frag");
    this.smooth = screen("smooth.frag", { MAX_VIEWS: kCandidates });
    this.show = screen("show.frag");
    this.composer = null;
    this.blocks = gl.createBuffer();
    this.targets = null;
    this.leastInverseDepth = set.bounds ? 1 / Math.max(norm(sub(set.bounds.max, set.bounds.min)), 1e-30) : 0;
  }

  // Two variants: few views, or the candidates of SPEC 1.3.
  resolver(perPixel) {
    if (!this.resolve.has(perPixel)) {
      this.resolve.set(perPixel, new Program(this.gl, this.shaders, "full_screen.vert", "resolve.frag",
        { MAX_VIEWS: perPixel ? kCandidates : kViews, PER_PIXEL: perPixel ? 1 : 0 }));
    }
    return this.resolve.get(perPixel);
  }

  fit(width, height) {
    if (this.targets?.result.width === width && this.targets.result.height === height) return;
    const { gl } = this;
    this.forgetTargets();
    const levels = [];
    for (let w = width, h = height; w > 1 || h > 1;) {
      w = (w + 1) >> 1;
      h = (h + 1) >> 1;
      levels.push({ pulled: new Target(gl, w, h, [this.cellFormat]), pushed: new Target(gl, w, h, [this.cellFormat]) });
    }
    this.targets = {
      coarse: new Target(gl, width, height, [], true), result: new Target(gl, width, height, [gl.RGBA8, gl.R32UI]),
      filled: new Target(gl, width, height, [gl.RGBA8]), smoothed: new Target(gl, width, height, [gl.RGBA8]), levels,
    };
  }

  forgetTargets() {
    if (!this.targets) return;
    const { coarse, result, filled, smoothed, levels } = this.targets;
    for (const target of [coarse, result, filled, smoothed, ...levels.flatMap((l) => [l.pulled, l.pushed])]) target.delete();
    this.targets = null;
  }

  /** Views that this camera's image would be drawn from, of those that are loaded. */
  select(novel) {
    return selectViews(this.set, this.set.steps[this.step].filter((view) => this.store.has(view)), novel);
  }

  /** Draws; the image is in targets.smoothed, seen pixels and their depth in targets.result. Returns the frame's facts. */
  draw(novel, { fill = true, smooth = true } = {}) {
    const { gl } = this;
    this.fit(novel.width, novel.height);
    const selection = this.select(novel);
    const placements = selection.views.map(({ view }) => placementOf(view, novel));
    const exposure = selection.views.length ? frameExposure(this.set, selection.views, novel) : [1, 1, 1];
    gl.disable(gl.BLEND);
    gl.disable(gl.SCISSOR_TEST);
    this.drawCoarse(novel, selection, placements);
    this.drawResult(novel, selection, placements, exposure);
    if (fill) this.fillHoles();
    this.finish(novel, placements, fill, smooth);
    return { novel, selection, views: selection.views.map(({ view }) => view), perPixel: selection.perPixel, exposure };
  }

  drawCoarse(novel, selection, placements) {
    const { gl, targets } = this;
    targets.coarse.bind();
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.depthFunc(gl.GREATER);
    gl.clearDepth(0);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.frontFace(gl.CCW);
    gl.cullFace(gl.BACK);
    this.leastNearZ = Math.min(...placements.map((p) => p.nearZ));
    for (const [program, kind] of [[this.triangles, "triangles"], [this.cells, "cells"]]) {
      program.use().set("size_px", novel.width, novel.height).set("least_near_z", this.leastNearZ);
      // Squares turn no back; triangles are drawn from their front alone.
      if (kind === "triangles") gl.enable(gl.CULL_FACE);
      else gl.disable(gl.CULL_FACE);
      selection.views.forEach(({ view }, i) => {
        const mesh = this.store.loaded.get(view.index)[kind], placed = gridPlacement(view, placements[i], novel);
        if (mesh.count === 0) return;
        program.set("screen_from_grid", placed.fromGrid).set("screen_from_centre", ...placed.fromCentre).set("near_z", placements[i].nearZ);
        gl.bindVertexArray(mesh.array);
        if (kind === "triangles") gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
        else gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, mesh.count);
      });
    }
    gl.bindVertexArray(null);
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.DEPTH_TEST);
  }

  /** The uniform block `name` of a program, of these floats. */
  setBlock(program, name, floats) {
    const { gl } = this;
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.blocks);
    gl.bufferData(gl.UNIFORM_BUFFER, floats, gl.STREAM_DRAW);
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.blocks);
    gl.uniformBlockBinding(program.program, gl.getUniformBlockIndex(program.program, name), 0);
  }

  drawResult(novel, selection, placements, exposure) {
    const { gl, targets, store } = this;
    targets.result.bind();
    if (selection.views.length === 0) {
      gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
      gl.clearBufferuiv(gl.COLOR, 1, [0, 0, 0, 0]);
      return;
    }
    const program = this.resolver(selection.perPixel).use();
    const floats = new Float32Array(kFloatsPerView * (selection.perPixel ? kCandidates : kViews));
    selection.views.forEach(({ view, cut }, i) => {
      const fading = fadingOf(this.set, view, placements[i], novel), clipped = clippedOf(view, exposure);
      floats.set(blockOf(view, placements[i], cut, fading, clipped, store.layerOf(view), view.parts.mask.size > 0), kFloatsPerView * i);
    });
    this.setBlock(program, "Views", floats);
    program.bind("images", 0, gl.TEXTURE_2D_ARRAY, store.images).bind("depths", 1, gl.TEXTURE_2D_ARRAY, store.depths)
      .bind("blocks", 2, gl.TEXTURE_2D_ARRAY, store.blocks).bind("coarse", 3, gl.TEXTURE_2D, targets.coarse.depth)
      .setInt("view_count", selection.views.length).setInt("nearest_views", kViews)
      .set("novel_camera", novel.fx, novel.fy, novel.cx, novel.cy).set("least_near_z", this.leastNearZ)
      .set("max_angle_rad", kMaxAngle).set("pixel_angle_rad", Math.atan2(1, novel.fx))
      .set("least_inverse_depth", this.leastInverseDepth).set("exposure", ...exposure);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  fillHoles() {
    const { gl, targets } = this, { levels } = targets;
    let finer = targets.result;
    levels.forEach((level, i) => {
      level.pulled.bind();
      const program = (i === 0 ? this.pullFinest : this.pull).use().bind("finer", 0, gl.TEXTURE_2D, finer.textures[0]);
      gl.uniform2i(program.place("finer_size"), finer.width, finer.height);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      finer = level.pulled;
    });
    for (let i = levels.length - 2; i >= 0; --i) {
      const coarser = i === levels.length - 2 ? levels[i + 1].pulled : levels[i + 1].pushed;
      levels[i].pushed.bind();
      this.push.use().bind("pulled", 0, gl.TEXTURE_2D, levels[i].pulled.textures[0]);
      this.drawFrom(this.push, coarser);
    }
    targets.filled.bind();
    this.fill.use().bind("image", 0, gl.TEXTURE_2D, targets.result.textures[0]);
    this.drawFrom(this.fill, levels.length > 1 ? levels[0].pushed : levels[0].pulled);
  }

  drawFrom(program, coarser) {
    const { gl } = this;
    program.bind("coarser", 1, gl.TEXTURE_2D, coarser.textures[0]);
    gl.uniform2i(program.place("coarser_size"), coarser.width, coarser.height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  finish(novel, placements, filled, smooth) {
    const { gl, targets } = this;
    this.image = filled ? targets.filled : targets.result;
    if (!smooth) return;
    const program = this.smooth.use().bind("image", 0, gl.TEXTURE_2D, this.image.textures[0])
      .bind("depth", 1, gl.TEXTURE_2D, targets.result.textures[1])
      .set("novel_camera", novel.fx, novel.fy, novel.cx, novel.cy).setInt("view_count", placements.length);
    gl.uniform2i(program.place("size_px"), novel.width, novel.height);
    if (placements.length) gl.uniform3fv(program.place("centres"), placements.flatMap((p) => p.translation));
    targets.smoothed.bind();
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    this.image = targets.smoothed;
  }

  /** Puts the drawn image on the canvas. `photo`: the view right of `photoFrom` (canvas pixels). */
  present(frame, { depth = false, photo = null, photoFrom = Infinity, inverseDepths = [1, 0] } = {}) {
    const { gl, targets, store } = this, width = gl.drawingBufferWidth, height = gl.drawingBufferHeight, { novel } = frame;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    const shown = photo && store.has(photo) ? photo : null;
    const program = this.show.use().bind("image", 0, gl.TEXTURE_2D, this.image.textures[0])
      .bind("depth", 1, gl.TEXTURE_2D, targets.result.textures[1]).bind("images", 2, gl.TEXTURE_2D_ARRAY, store.images)
      .set("image_from_canvas", novel.width / width, novel.height / height).set("canvas_height", height)
      .set("novel_camera", novel.fx, novel.fy, novel.cx, novel.cy).setInt("show_depth", depth ? 1 : 0)
      .set("inverse_depths", ...inverseDepths).set("photo_from_px", shown ? photoFrom : 1e9)
      .set("exposure", ...(shown ? shown.gain.map((g) => 1 / g) : [1, 1, 1]));
    const block = new Float32Array(kFloatsPerView);
    if (shown) block.set(blockOf(shown, placementOf(shown, novel), 1, { gain: 1, offset: 0 }, store.layerOf(shown), false));
    this.setBlock(program, "Photo", block);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** The drawn image with its depth into another framebuffer (SetScene.compose). */
  compose({ novel }, framebuffer, [x, y, width, height], depthOf, linear) {
    const { gl } = this;
    this.composer ??= new Program(gl, this.shaders, "full_screen.vert", "compose.frag");
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.viewport(x, y, width, height);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(true);
    this.composer.use().bind("image", 0, gl.TEXTURE_2D, this.image.textures[0])
      .bind("depth", 1, gl.TEXTURE_2D, this.targets.result.textures[1]).set("viewport", x, y, width, height)
      .set("image_from_viewport", novel.width / width, novel.height / height).set("depth_of", ...depthOf).setInt("linear", linear ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.DEPTH_TEST);
  }

  /** Plane z of the surface at a pixel of the last image; null where none was seen. */
  depthAt([x, y]) {
    const { gl, targets } = this, { width, height } = targets.result;
    const bits = new Uint32Array(4);
    gl.bindFramebuffer(gl.FRAMEBUFFER, targets.result.framebuffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT1);
    gl.readPixels(Math.min(Math.max(Math.floor(x), 0), width - 1), Math.min(Math.max(Math.floor(y), 0), height - 1), 1, 1,
      gl.RGBA_INTEGER, gl.UNSIGNED_INT, bits);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    const w = new Float32Array(bits.buffer)[0];
    return w > 0 ? 1 / w : null;
  }

  /** The last image, RGBA from its top row on; `seen`: alpha 255 where a view saw something (of the image before filling). */
  pixels(seen = false) {
    const { gl } = this, target = seen ? this.targets.result : this.image;
    const rgba = new Uint8Array(4 * target.width * target.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(0, 0, target.width, target.height, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    return rgba;
  }
}
