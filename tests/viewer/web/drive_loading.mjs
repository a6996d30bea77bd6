// node drive_loading.mjs PAGE.html CHROMIUM: opens a page on a computer whose frames take long, counts the images that it draws while
// its views arrive, and prints what it found as JSON.
import { drawnInFull, launchChromium, newPage } from "../../../scripts/chromium.mjs";

const kFrameMs = 400, kViewMs = 300;  // a frame takes longer than one more view
const [page_file, program] = process.argv.slice(2);
const found = { messages: [] };
const browser = await launchChromium(program);
const page = await newPage(browser, { viewport: { width: 320, height: 200 } }, (text) => found.messages.push(text));
await page.addInitScript(([frame_ms, view_ms]) => {
  globalThis.Worker = class extends Worker {
    set onmessage(receive) {
      super.onmessage = (event) => setTimeout(() => receive(event), view_ms);
    }
  };
  // Of each fence the time when it was made: it is signalled so much later. Each image makes one.
  const { fenceSync, getSyncParameter } = WebGL2RenderingContext.prototype, made = new WeakMap();
  globalThis.images = 0;
  WebGL2RenderingContext.prototype.fenceSync = function (...words) {
    const fence = fenceSync.apply(this, words);
    made.set(fence, performance.now());
    globalThis.images += 1;
    return fence;
  };
  WebGL2RenderingContext.prototype.getSyncParameter = function (fence, name) {
    return performance.now() - made.get(fence) < frame_ms ? this.UNSIGNALED : getSyncParameter.call(this, fence, name);
  };
}, [kFrameMs, kViewMs]);
await page.goto(`file://${page_file}`);
await page.evaluate(() => globalThis.dtrPage.allLoaded);
await drawnInFull(page);
Object.assign(found, await page.evaluate(() => {
  const { images, dtrPage } = globalThis, drawn = Array.from(dtrPage.frame.views, (view) => view.index);
  const wanted = dtrPage.renderer.select(dtrPage.camera()).views.map(({ view }) => view.index);
  return { images, loaded: dtrPage.renderer.store.loaded.size, drawn, wanted };
}));
await browser.close();
console.log(JSON.stringify(found));
