// Headless Chromium without a GPU for scripts/ and tests/viewer/web. playwright-core (npm) is looked for below DTR_PLAYWRIGHT, a
// folder with node_modules.
import { createRequire } from "node:module";
import { resolve } from "node:path";

/** Promise of a browser of playwright-core. `program`: the path of Chromium. */
export function launchChromium(program = "/usr/bin/chromium") {
  const { chromium } = createRequire(`${resolve(process.env.DTR_PLAYWRIGHT)}/`)("playwright-core");
  return chromium.launch({ executablePath: program, args: ["--no-sandbox", "--disable-dev-shm-usage", "--disable-background-networking",
    "--disable-component-update", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"] });
}

/** Promise of a new page, still empty. `report(text, url)` gets every line of its console and every error that it does not catch. */
export async function newPage(browser, options, report) {
  const page = await browser.newPage(options);
  page.on("console", (message) => report(message.text(), message.location().url));
  page.on("pageerror", (error) => report(error.message, ""));
  return page;
}

/** Until the page of a set (`dtr export --format web`) stands and is drawn in full. */
export function drawnInFull(page) {
  return page.waitForFunction(() => globalThis.dtrPage.still, null, { timeout: 600000 });
}

/** Promise of the line that the page shows when something cannot be shown; empty: none. */
export function problemOf(page) {
  return page.evaluate(() => {
    const box = document.getElementById("problem");
    return box.hidden ? "" : box.textContent;
  });
}
