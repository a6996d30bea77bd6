// The page of a set that is described by a header's text.
import { parseHeader } from "./header.js";
import { Page, showProblem } from "./page.js";

/** Fills the document in and starts the viewer; `globalThis.dtrPage` is the Page. A problem is said on the page. */
export function startPage(header, shaders, { dataOf, makeWorker }) {
  document.getElementById("problem").hidden = true;
  try {
    const set = parseHeader(header);
    document.getElementById("name").textContent = set.name;
    const validation = document.getElementById("validation");
    validation.textContent = `calibration: ${set.validation}`;
    validation.classList.toggle("failed", set.failed);
    document.getElementById("figures").replaceChildren(...set.figures.map(([name, value]) => {
      const row = document.createElement("tr");
      row.append(...[name, value].map((words) => Object.assign(document.createElement("td"), { textContent: words })));
      return row;
    }));
    globalThis.dtrPage = new Page(set, shaders, { dataOf, makeWorker });
  } catch (error) {
    showProblem(String(error.message ?? error));
  }
}
