// dtr-viewer.js: what other pages may use of the viewer (docs/EXPORT.md, "The module").
import { FolderSource } from "./source.js";
import { SetScene } from "./scene.js";
import { embeddedShaders } from "./shaders.js";
import { parseHeader } from "./header.js";
import { showProblem } from "./page.js";
import { serveDecoding } from "./decode.js";
import { startPage } from "./start.js";
import { threeObject } from "./three.js";

// A worker with this module, also of another server.
function moduleWorker() {
  const script = `import { serveWorker } from ${JSON.stringify(import.meta.url)}; serveWorker(globalThis);`;
  return new Worker(URL.createObjectURL(new Blob([script], { type: "text/javascript" })), { type: "module" });
}

/** In a worker: decodes views. */
export function serveWorker(scope) {
  serveDecoding(scope);
}

/** The whole page, with buttons and keys, in a document that has the elements of a site's index.html. `address`: of set.json. */
export async function openPage(address) {
  try {
    const source = new FolderSource(address);
    startPage(await source.header(), embeddedShaders, { dataOf: (view) => source.dataOf(view), makeWorker: moduleWorker });
  } catch (error) {
    showProblem(String(error.message ?? error));
  }
}

/**
 * Promise of a SetScene (scene.js) on a WebGL2 context. `address`: of set.json. `options.changed()`: draw again;
 * `options.failed(problem)`: a view cannot be shown.
 */
export function openScene(gl, address, options = {}) {
  return SetScene.open(gl, embeddedShaders, address, { makeWorker: moduleWorker, ...options });
}

/** Promise of a THREE.Mesh (three.js) for scenes that `renderer`, a THREE.WebGLRenderer, draws; `mesh.userData.scene`: its SetScene. */
export async function openThreeObject(THREE, renderer, address, options = {}) {
  const scene = await openScene(renderer.getContext(), address, options);
  renderer.resetState();
  const object = threeObject(THREE, scene);
  object.userData.scene = scene;
  return object;
}

/** The header of a set.json, as the viewer reads it. Throws where it is none. */
export function readHeader(text) {
  return parseHeader(text);
}
