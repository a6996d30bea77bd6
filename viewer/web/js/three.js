// A set as an object of three.js. three.js itself is given by its user; nothing of it is here.
import { intrinsicsOf } from "./camera.js";
import { quaternionOfMatrix } from "./maths.js";
import { Problem } from "./problem.js";

const kShear = 1e-4;  // of a scale: what rounding leaves

// Rotation (w x y z), translation and uniform scale of a rigid matrix, column by column as three.js has them.
function similarityOf(matrix) {
  const e = matrix.elements, column = (j) => [e[4 * j], e[4 * j + 1], e[4 * j + 2]];
  const lengths = [0, 1, 2].map((j) => Math.hypot(...column(j))), scale = lengths[0];
  if (!(scale > 0) || lengths.some((length) => Math.abs(length - scale) > kShear * scale) || matrix.determinant() < 0) {
    throw new Problem("the object of a set can be moved, turned and scaled alike in all directions, not else");
  }
  return { scale, rows: [0, 1, 2].map((i) => [0, 1, 2].map((j) => column(j)[i] / scale)), translation: column(3).map((v) => v / scale) };
}

function cameraOf(THREE, camera, object, width, height) {
  const p = camera.projectionMatrix.elements;
  if (p[15] !== 0 || p[11] !== -1) throw new Problem("a set needs a perspective camera");
  // x right, y down, z forward, out of x right, y up, z back.
  const cam_from_set = new THREE.Matrix4().makeScale(1, -1, -1).multiply(camera.matrixWorldInverse).multiply(object.matrixWorld);
  const { scale, rows, translation } = similarityOf(cam_from_set);
  return {
    camera: { width, height, ...intrinsicsOf(p, width, height), rotation: quaternionOfMatrix(rows), translation },
    depthOf: [-p[10], p[14] / scale],
  };
}

/**
 * A THREE.Mesh that shows `scene` (a SetScene on the WebGL2 context of the WebGLRenderer that draws it). It writes depth, so that it
 * and other objects hide each other. Its own frame is the set's world; at first it is turned so that the set's up is +y.
 * `object.resolution` (1): pixels that are computed, per pixel of the viewport and axis. Not for logarithmic or reversed depth.
 */
export function threeObject(THREE, scene) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(9), 3));
  geometry.setDrawRange(0, 0);  // three.js draws nothing itself
  const object = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial());
  object.frustumCulled = false;
  object.resolution = 1;
  object.quaternion.setFromUnitVectors(new THREE.Vector3(...scene.up), new THREE.Vector3(0, 1, 0));
  object.onBeforeRender = (renderer, _, camera) => {
    const { gl } = scene, target = renderer.getRenderTarget();
    const framebuffer = gl.getParameter(gl.FRAMEBUFFER_BINDING), viewport = gl.getParameter(gl.VIEWPORT);
    const size = [2, 3].map((i) => Math.max(2, Math.round(viewport[i] * object.resolution)));
    const novel = cameraOf(THREE, camera, object, ...size);
    const frame = scene.draw(novel.camera);
    const linear = target !== null && target.texture.colorSpace !== THREE.SRGBColorSpace;
    if (frame) scene.compose(frame, framebuffer, viewport, novel.depthOf, linear);
    const face = renderer.getActiveCubeFace(), level = renderer.getActiveMipmapLevel();
    renderer.resetState();
    renderer.setRenderTarget(target, face, level);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.viewport(...viewport);
  };
  return object;
}
