// node drive_page.mjs PAGE.html CHROMIUM [SCREENSHOTS|CAMERA.json]: uses a page as people do and prints what it found as JSON. With a
// camera {width, height, fx, fy, cx, cy, rotation, translation} it draws that alone and
// writes its RGBA pixels to CAMERA.rgba.
import { readFileSync, writeFileSync } from "node:fs";
import { launchChromium, newPage, problemOf } from "../../../scripts/chromium.mjs";

const [page_file, program, third] = process.argv.slice(2);
const novel = third?.endsWith(".json") ? JSON.parse(readFileSync(third, "utf8")) : null, screenshots = novel ? undefined : third;

const found = { messages: [] };
const browser = await launchChromium(program);
const page = await newPage(browser, { viewport: { width: 320, height: 200 }, hasTouch: true }, (text) => found.messages.push(text));
page.on("request", (request) => { if (!/^(file|blob|data):/.test(request.url())) found.messages.push(request.url()); });
await page.goto(`file://${page_file}`);

const look = (name) => screenshots && page.screenshot({ path: `${screenshots}/${name}.png` });
// What the canvas' camera is, as numbers that change when it moves.
const camera = () => page.evaluate(() => globalThis.dtrPage.camera().centre.join(" "));
// Until two frames were drawn.
const drawn = () => page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))));

if (await page.evaluate(() => globalThis.dtrPage !== undefined)) {
  await page.evaluate(() => globalThis.dtrPage.allLoaded);
  found.loaded = await page.evaluate(() => globalThis.dtrPage.renderer.store.loaded.size);
  found.problem = await problemOf(page);
  if (novel) {
    const pixels = await page.evaluate((camera) => Array.from(globalThis.dtrPage.render(camera).pixels), novel);
    writeFileSync(third.replace(/json$/, "rgba"), Buffer.from(pixels));
  } else if (found.loaded > 0) {
    await page.evaluate(() => globalThis.dtrPage.firstPicture);
    await look("first");
    const box = { x: 160, y: 70 };
    const centre = () => page.evaluate(([x, y]) => {
      const { renderer, camera } = { renderer: globalThis.dtrPage.renderer, camera: globalThis.dtrPage.camera() };
      renderer.draw(camera);
      const pixels = renderer.pixels(), { width } = camera;
      globalThis.dtrPage.dirty = true;
      let black = 0;
      for (let i = 0; i < pixels.length; i += 4) black += pixels[i] + pixels[i + 1] + pixels[i + 2] === 0 ? 1 : 0;
      return { black: 4 * black / pixels.length, colour: Array.from(pixels.slice(4 * (y * width + x), 4 * (y * width + x) + 3)) };
    }, [box.x, box.y]);
    found.black = (await centre()).black;

    const start = await camera();
    await page.mouse.move(box.x, box.y);
    await page.mouse.down();
    await page.mouse.move(box.x + 30, box.y + 8, { steps: 3 });
    await page.mouse.up();
    found.orbits = (await camera()) !== start;
    const orbited = await camera();
    await page.mouse.wheel(0, -200);
    await drawn();
    found.dollies = (await camera()) !== orbited;
    const before_key = await camera();
    await page.keyboard.down("KeyW");
    await drawn();
    await drawn();
    await page.keyboard.up("KeyW");
    found.flies = (await camera()) !== before_key;

    const touched = await camera();
    const touch = await page.context().newCDPSession(page);
    const fingers = (type, ...points) => touch.send("Input.dispatchTouchEvent",
      { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
    await fingers("touchStart", [120, 80]);
    await fingers("touchMove", [150, 80]);
    await fingers("touchEnd");
    found.oneFinger = (await camera()) !== touched;
    const pinched = await camera();
    await fingers("touchStart", [120, 80], [180, 80]);
    await fingers("touchMove", [100, 80], [200, 80]);
    await fingers("touchEnd");
    found.twoFingers = (await camera()) !== pinched;

    Object.assign(found, await page.evaluate(() => {
      const { set, navigation } = globalThis.dtrPage;
      return { photoAtStart: navigation.photo, span: set.span, next: `${(set.opening + 1) % set.views.length + 1} / ` };
    }));
    await page.keyboard.press("Period");
    await page.waitForFunction(() => globalThis.dtrPage.navigation.jump === null);
    found.photo = await page.evaluate(() => document.getElementById("photo").textContent);
    await page.keyboard.press("KeyC");
    await drawn();
    found.compares = await page.evaluate(() => document.querySelector("button[data-option=compare]").getAttribute("aria-pressed"));
    await look("compare");
    await page.keyboard.press("KeyC");
    await page.keyboard.press("KeyV");
    await drawn();
    await look("depth");
    await page.keyboard.press("KeyV");
    await page.keyboard.press("KeyM");
    await drawn();
    await page.mouse.click(100, 90);
    await page.mouse.click(200, 110);
    await drawn();
    found.distance = await page.evaluate(() => document.querySelector("#marks text")?.textContent ?? "");
    await look("distance");

    await page.setViewportSize({ width: 390, height: 844 });  // a phone held upright
    found.outside = await page.evaluate(() => [...document.querySelectorAll("nav > *")]
      .filter((element) => !element.hidden)
      .filter((element) => {
        const box = element.getBoundingClientRect();
        return box.left < 0 || box.right > innerWidth || box.bottom > innerHeight;
      }).map((element) => element.textContent));
  }
} else {
  found.problem = await problemOf(page);
}
await browser.close();
console.log(JSON.stringify(found));
