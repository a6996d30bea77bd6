// node drive_headset.mjs PAGE.html CHROMIUM: the page with a headset that this script plays (two eyes beside each other, no device), and
// what it found as JSON.
import { launchChromium, newPage } from "../../../scripts/chromium.mjs";

const [page_file, program] = process.argv.slice(2);
const found = { messages: [] };
const browser = await launchChromium(program);
const page = await newPage(browser, { viewport: { width: 320, height: 200 } }, (text) => found.messages.push(text));

// As much of WebXR as the page uses: https://www.w3.org/TR/webxr/.
await page.addInitScript(() => {
  const kSide = 120, kHalfEyes = 0.032;
  const eyes = [-1, 1].map((side) => ({
    projectionMatrix: Float32Array.from([1, 0, 0, 0, 0, 1.1, 0, 0, 0.1 * side, 0.05, -1, -1, 0, 0, -0.2, 0]),
    transform: { matrix: Float32Array.from([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, side * kHalfEyes, 0, 0, 1]) }, side,
  }));
  globalThis.XRWebGLLayer = class {
    constructor(session, gl) {
      this.framebuffer = gl.createFramebuffer();
      const buffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA8, 2 * kSide, kSide);
      gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, buffer);
      globalThis.layer = this;
    }
    getViewport(eye) {
      return { x: eye.side < 0 ? 0 : kSide, y: 0, width: kSide, height: kSide };
    }
  };
  class Session extends EventTarget {
    updateRenderState() {}
    requestReferenceSpace() { return Promise.resolve({}); }
    requestAnimationFrame(callback) {
      globalThis.frames_drawn = (globalThis.frames_drawn ?? -1) + 1;
      const pose = { views: eyes, transform: { matrix: Float32Array.from([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]) } };
      requestAnimationFrame((now) => callback(now, { getViewerPose: () => pose }));
    }
    end() {
      this.dispatchEvent(new Event("end"));
      return Promise.resolve();
    }
  }
  WebGL2RenderingContext.prototype.makeXRCompatible = () => Promise.resolve();
  Object.defineProperty(navigator, "xr", {
    value: { isSessionSupported: async (mode) => mode === "immersive-vr", requestSession: async () => new Session() },
  });
  globalThis.eyes = eyes;
});
await page.goto(`file://${page_file}`);
await page.evaluate(() => globalThis.dtrPage.allLoaded);
found.offered = await page.evaluate(() => !document.getElementById("headset").hidden);
await page.keyboard.press("KeyX");
await page.waitForFunction(() => globalThis.frames_drawn > 2, null, { timeout: 120000 });
// Each eye beside the page's own image of its camera at full size.
Object.assign(found, await page.evaluate(() => {
  const { dtrPage, layer, eyes } = globalThis, { headset, renderer } = dtrPage, { gl } = renderer;
  headset.level = 0;
  const seen = eyes.map((eye) => {
    const { x, y, width, height } = layer.getViewport(eye), camera = headset.eyeCamera(eye, width, height);
    dtrPage.drawEye(camera, layer.framebuffer, [x, y, width, height]);
    const pixels = new Uint8Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    gl.readPixels(x, y, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    const own = dtrPage.render(camera).pixels;
    let worst = 0, bright = 0;
    for (let v = 0; v < height; ++v) {
      for (let u = 0; u < 4 * width; ++u) {
        if (u % 4 === 3) continue;
        worst = Math.max(worst, Math.abs(pixels[4 * width * v + u] - own[4 * width * (height - 1 - v) + u]));
        bright += own[4 * width * v + u] > 8 ? 1 : 0;
      }
    }
    return { worst, bright: bright / (3 * width * height), centre: camera.centre, pixels };
  });
  const [left, right] = seen;
  return {
    worst: Math.max(left.worst, right.worst), bright: Math.min(left.bright, right.bright),
    apart: Math.hypot(...[0, 1, 2].map((i) => left.centre[i] - right.centre[i])) / headset.unitsPerMetre,
    // The right eye is to the right of the left one, as the page's camera sees it.
    right: [0, 1, 2].reduce((sum, i) => sum + dtrPage.camera().matrix[0][i] * (right.centre[i] - left.centre[i]), 0) > 0,
    differing: left.pixels.filter((v, i) => Math.abs(v - right.pixels[i]) > 8).length / left.pixels.length,
  };
}));
await page.keyboard.press("KeyX");
await page.waitForFunction(() => !globalThis.dtrPage.headset.active && globalThis.dtrPage.still, null, { timeout: 60000 });
found.back = true;
await browser.close();
console.log(JSON.stringify(found));
