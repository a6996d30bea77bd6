// Starts the page of one file, or, in a worker, the decoder of its views.
import { startPage } from "./start.js";
import { embeddedSource } from "./source.js";
import { serveDecoding } from "./decode.js";

function start() {
  const text = (id) => document.getElementById(id)?.textContent ?? "";
  const script = text("script");
  startPage(text("set"), JSON.parse(text("shaders")), {
    dataOf: embeddedSource.dataOf,
    makeWorker: () => new Worker(URL.createObjectURL(new Blob([script], { type: "text/javascript" }))),
  });
}

if (typeof document === "undefined") serveDecoding(globalThis);
else if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
else start();
