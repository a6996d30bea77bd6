// node drive_time.mjs PAGE.html CHROMIUM: moves the slider of a page of several time steps, plays it, and prints what it found as JSON.
import { launchChromium, newPage } from "../../../scripts/chromium.mjs";

const [page_file, program] = process.argv.slice(2);
const found = { messages: [] };
const browser = await launchChromium(program);
const page = await newPage(browser, { viewport: { width: 320, height: 200 } }, (text) => found.messages.push(text));
await page.goto(`file://${page_file}`);
await page.evaluate(() => globalThis.dtrPage.allLoaded);
found.slider = await page.evaluate(() => { const { hidden, max } = document.getElementById("time"); return { hidden, max }; });
// The image of the time step that the page shows, from the first photo's place: its bytes' sum and the share that differs from another.
const image = () => page.evaluate(() => {
  const { renderer, set } = globalThis.dtrPage, view = set.views[0];
  renderer.draw({ ...view, width: view.width, height: view.height });
  globalThis.dtrPage.dirty = true;
  return { step: renderer.step, pixels: Array.from(renderer.pixels()) };
});
const differing = (a, b) => a.pixels.filter((v, i) => Math.abs(v - b.pixels[i]) > 8).length / a.pixels.length;
const shown = (step) => page.waitForFunction((wanted) => globalThis.dtrPage.renderer.step === wanted, step, { timeout: 20000 });

const first = await image();
await page.evaluate(() => {
  const slider = document.getElementById("time");
  slider.value = "1";
  slider.dispatchEvent(new Event("input"));
});
await shown(1);
const second = await image();
found.moved = differing(first, second);
await page.keyboard.press("Space");  // plays on: back to the first
await shown(0);
found.playing = await page.evaluate(() => document.getElementById("play").getAttribute("aria-pressed"));
await page.keyboard.press("Space");
found.again = differing(first, await image());
await browser.close();
console.log(JSON.stringify(found));
