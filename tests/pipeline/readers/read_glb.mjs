// node read_glb.mjs FILE.glb: what three.js' GLTFLoader reads (npm: three) and what Khronos' validator says of the file (npm:
// gltf-validator), as JSON.
import { readFileSync } from "node:fs";
import { npmModule } from "./npm_module.mjs";

globalThis.self = globalThis;  // of browsers, which the loader expects
const { GLTFLoader } = await npmModule("three/addons/loaders/GLTFLoader.js");
const { default: validator } = await npmModule("gltf-validator");
const file = readFileSync(process.argv[2]);
const { issues } = await validator.validateBytes(new Uint8Array(file), { maxIssues: 0 });
const bytes = file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength);
const gltf = await new GLTFLoader().parseAsync(bytes, "");
gltf.scene.updateMatrixWorld(true);
const objects = [];
gltf.scene.traverse((object) => {
  if (!object.geometry) return;
  const { geometry } = object, attributes = {};
  for (const [name, attribute] of Object.entries(geometry.attributes)) {
    const { itemSize, count } = attribute;
    // As shaders see them: 0 to 1 where they are normalised integers.
    const values = Array.from({ length: count * itemSize }, (_, i) => attribute.getComponent(Math.floor(i / itemSize), i % itemSize));
    attributes[name] = { itemSize, values };
  }
  const index = geometry.index ? Array.from(geometry.index.array) : null;
  objects.push({ type: object.type, matrix: object.matrixWorld.elements, attributes, index });
});
console.log(JSON.stringify({
  objects, json: gltf.parser.json, messages: issues.messages.map(({ code, severity, pointer }) => ({ code, severity, pointer })),
}));
