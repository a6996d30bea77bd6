// Starts the page, or, in a worker, the decoder of its views.
import { parseHeader } from "./header.js";
import { Page, showProblem } from "./page.js";
import { serveDecoding } from "./decode.js";

function start() {
  const text = (id) => document.getElementById(id)?.textContent ?? "";
  document.getElementById("problem").hidden = true;
  try {
    const set = parseHeader(text("set"));
    document.getElementById("name").textContent = set.name;
    const validation = document.getElementById("validation");
    validation.textContent = `calibration: ${set.validation}`;
    validation.classList.toggle("failed", set.failed);
    document.getElementById("figures").replaceChildren(...set.figures.map(([name, value]) => {
      const row = document.createElement("tr");
      row.append(...[name, value].map((words) => Object.assign(document.createElement("td"), { textContent: words })));
      return row;
    }));
    globalThis.dtrPage = new Page(set, JSON.parse(text("shaders")), text("script"));
  } catch (error) {
    showProblem(String(error.message ?? error));
  }
}

if (typeof document === "undefined") serveDecoding(globalThis);
else if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start);
else start();
