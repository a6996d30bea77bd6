// node drive_firefox.mjs PAGE.html FIREFOX: the page in Debian's Firefox ESR, on the display of DISPLAY (it has no WebGL2 without one),
// driven by puppeteer-core (npm, WebDriver BiDi) below DTR_PLAYWRIGHT. Uses it and prints what it found as JSON.
import { createRequire } from "node:module";
import { problemOf } from "../../../scripts/chromium.mjs";

const { default: puppeteer } = await import(createRequire(`${process.env.DTR_PLAYWRIGHT}/`).resolve("puppeteer-core"));
const [page_file, program] = process.argv.slice(2);
const found = { messages: [] };
const browser = await puppeteer.launch({
  browser: "firefox", executablePath: program, headless: false, defaultViewport: { width: 320, height: 200 },
  // Software, which Firefox else takes for too slow.
  extraPrefsFirefox: { "webgl.force-enabled": true, "webgl.disable-fail-if-major-performance-caveat": true },
});
const page = await browser.newPage();
page.on("console", (message) => found.messages.push(message.text()));
page.on("pageerror", (error) => found.messages.push(error.message));
await page.goto(`file://${page_file}`);
await page.waitForFunction(() => globalThis.dtrPage || !/^Loading/.test(document.getElementById("problem").textContent));
found.problem = await problemOf(page);
if (found.problem === "") {
  await page.evaluate(() => globalThis.dtrPage.allLoaded.then(() => true));
  await page.waitForFunction(() => globalThis.dtrPage.still, { timeout: 120000 });
  found.loaded = await page.evaluate(() => globalThis.dtrPage.renderer.store.loaded.size);
  // From where the first photo was taken: black pixels, and the mean difference of the others from that photo.
  Object.assign(found, await page.evaluate(() => {
    const { dtrPage } = globalThis, view = dtrPage.set.views[0];
    const { pixels } = dtrPage.render({ ...view, width: view.width, height: view.height });
    const { gl, store } = dtrPage.renderer, photo = new Uint8Array(4 * view.width * view.height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, store.framebuffer);
    gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, store.images, 0, store.layerOf(view));
    gl.readPixels(0, 0, view.width, view.height, gl.RGBA, gl.UNSIGNED_BYTE, photo);
    let black = 0, difference = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      black += pixels[i] + pixels[i + 1] + pixels[i + 2] === 0 ? 1 : 0;
      for (const c of [0, 1, 2]) difference += Math.abs(pixels[i + c] - photo[i + c]);
    }
    return { black: 4 * black / pixels.length, difference: 4 * difference / 3 / pixels.length };
  }));
  const camera = () => page.evaluate(() => globalThis.dtrPage.camera().centre.join(" "));
  const start = await camera();
  await page.mouse.move(160, 70);
  await page.mouse.down();
  await page.mouse.move(190, 78, { steps: 3 });
  await page.mouse.up();
  found.orbits = (await camera()) !== start;
  Object.assign(found, await page.evaluate(() => {
    const { set } = globalThis.dtrPage;
    return { next: `${(set.opening + 1) % set.views.length + 1} / ` };
  }));
  await page.keyboard.press(".");
  await page.waitForFunction(() => globalThis.dtrPage.navigation.jump === null);
  found.photo = await page.evaluate(() => document.getElementById("photo").textContent);
  await page.keyboard.press("m");
  await page.waitForFunction(() => globalThis.dtrPage.still);
  await page.mouse.click(100, 90);
  await page.mouse.click(200, 110);
  await page.waitForFunction(() => document.querySelector("#marks text"));
  found.distance = await page.evaluate(() => document.querySelector("#marks text").textContent);
}
await browser.close();
console.log(JSON.stringify(found));
