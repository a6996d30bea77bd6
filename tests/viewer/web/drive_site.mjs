// node drive_site.mjs SITE CHROMIUM EXAMPLES [SCREENSHOTS]: serves a site of `dtr export --format web` on this machine, with the example
// pages beside it, uses it, and prints what it found as JSON. three is looked for below DTR_PLAYWRIGHT.
import { existsSync, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { launchChromium, newPage, problemOf } from "../../../scripts/chromium.mjs";

const [site, program, examples, screenshots] = process.argv.slice(2);
const kTypes = { ".html": "text/html", ".js": "text/javascript", ".json": "application/json", ".bin": "application/octet-stream" };
const kSize = { width: 320, height: 200 };

const asked = [];
const server = createServer((request, response) => {
  const name = normalize(decodeURIComponent(new URL(request.url, "http://localhost").pathname)).replace(/^\/+/, "") || "index.html";
  asked.push(name);
  const file = [join(site, name), join(examples, name), join(process.env.DTR_PLAYWRIGHT, name)].find((path) => existsSync(path));
  response.writeHead(file ? 200 : 404, { "content-type": kTypes[extname(name)] ?? "text/plain" });
  response.end(file ? readFileSync(file) : "");
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const address = `http://127.0.0.1:${server.address().port}`;

const found = { messages: [] };
const browser = await launchChromium(program);

async function opened(name) {
  const report = (text) => { if (!/GPU stall|favicon/.test(text)) found.messages.push(`${name}: ${text}`); };
  const page = await newPage(browser, { viewport: kSize }, (text, url) => report(`${text} ${url}`));
  page.on("request", (request) => {
    if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url())) report(request.url());
  });
  await page.goto(`${address}/${name}`);
  return page;
}
const look = (page, name) => screenshots && page.screenshot({ path: `${screenshots}/${name}.png` });
// Mean colour of a rectangle of what is seen.
const colourOf = async (page, x, y, width, height) => {
  const image = (await page.screenshot({ clip: { x, y, width, height } })).toString("base64");
  return page.evaluate(async (url) => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(url), (c) => c.charCodeAt(0))]));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height), sum = [0, 0, 0];
    data.forEach((v, i) => { if (i % 4 < 3) sum[i % 4] += v; });
    return sum.map((v) => 4 * v / data.length);
  }, image);
};

const page = await opened("");
await page.waitForFunction(() => globalThis.dtrPage || !/^Loading/.test(document.getElementById("problem").textContent));
if (await page.evaluate(() => globalThis.dtrPage !== undefined)) {
  await page.evaluate(() => globalThis.dtrPage.allLoaded);
  found.loaded = await page.evaluate(() => globalThis.dtrPage.renderer.store.loaded.size);
  found.order = asked.filter((name) => name.endsWith(".bin")).map((name) => Number(name.match(/\d+/)[0]));
  found.nearestFirst = await page.evaluate(() => globalThis.dtrPage.order().map((view) => view.index));
  await look(page, "site");
}
found.problem = await problemOf(page);
await page.close();

if (found.loaded > 0 && !found.problem) {
  const plain = await opened("viewer.html");
  await plain.waitForFunction(() => globalThis.example);
  await plain.evaluate(() => globalThis.example.scene.allLoaded);
  await plain.waitForTimeout(500);
  found.plain = await colourOf(plain, 60, 40, 200, 100);
  await look(plain, "viewer");
  await plain.close();
}

found.three = existsSync(join(process.env.DTR_PLAYWRIGHT, "node_modules/three"));
if (found.loaded > 0 && !found.problem && found.three) {
  const page = await opened("three.html");
  await page.waitForFunction(() => globalThis.example);
  await page.evaluate(() => globalThis.example.object.userData.scene.allLoaded);
  await look(page, "three");
  // A red square that fills the image, at a distance along the camera's axis; null: none.
  const square = (distance) => page.evaluate((at) => new Promise((done) => {
    const { THREE, scene, camera, ring, redraw } = globalThis.example;
    scene.remove(scene.getObjectByName("square"));
    ring.visible = false;
    if (at !== null) {
      const made = new THREE.Mesh(new THREE.PlaneGeometry(9 * at, 9 * at), new THREE.MeshBasicMaterial({ color: 0xff0000 }));
      made.name = "square";
      made.quaternion.copy(camera.quaternion);
      made.position.copy(camera.position).add(camera.getWorldDirection(new THREE.Vector3()).multiplyScalar(at));
      scene.add(made);
    }
    redraw();
    requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(done)));
  }), distance);
  const [near, far] = await page.evaluate(() => { const { camera } = globalThis.example; return [2 * camera.near, 0.9 * camera.far]; });
  const middle = () => colourOf(page, 150, 90, 20, 20);
  await square(null);
  found.scene = await middle();
  await square(near);
  found.modelInFront = await middle();
  await square(far);
  found.modelBehind = await middle();
  // In the middle of the image, where the surface is: a tenth nearer, a tenth farther.
  const z = await page.evaluate(() => {
    const { renderer } = globalThis.example.object.userData.scene, { width, height } = renderer.targets.result;
    return renderer.depthAt([width / 2, height / 2]);
  });
  await page.evaluate(() => globalThis.example.renderer.resetState());
  const small = () => colourOf(page, 159, 99, 2, 2);
  await square(0.9 * z);
  found.tenthNearer = await small();
  await square(1.1 * z);
  found.tenthFarther = await small();
  await page.close();
}
await browser.close();
server.close();
console.log(JSON.stringify(found));
