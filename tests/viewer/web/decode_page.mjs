// node decode_page.mjs PAGE.html VIEWER_WEB_FOLDER: what the page's own modules read out of a page, as JSON: per view the number of
// samples with measured and with completed depth and the sum of their inverse depths.
import { readFileSync } from "node:fs";

const [file, folder] = process.argv.slice(2);
const { bytesOfText, crc32 } = await import(`${folder}/js/bytes.js`);
const { decodeCodes, inverseDepthTable } = await import(`${folder}/js/depth_codes.js`);
const { parseHeader } = await import(`${folder}/js/header.js`);

const page = readFileSync(file, "utf8");
const elementText = (id) => {
  const from = page.indexOf(">", page.indexOf(` id="${id}"`)) + 1;
  return page.slice(from, page.indexOf("</script>", from));
};
const views = parseHeader(elementText("set")).views.map((view) => {
  const bytes = bytesOfText(elementText(`view-${view.index}`), view.bytes, view.name);
  const { first, end } = view.parts.depth, part = bytes.subarray(first, end);
  const codes = decodeCodes(part, view, view.name), table = inverseDepthTable(view);
  const found = { name: view.name, crc: crc32(bytes) === view.crc, jpeg: bytes[0] === 0xff && bytes[1] === 0xd8,
    measured: 0, completed: 0, inverse: 0, cut: 0 };
  for (const code of codes) {
    if (code === 0) continue;
    ++found[code <= view.measured.steps + 1 ? "measured" : "completed"];
    found.inverse += table[code];
  }
  // Bytes that are cut short or too many are never read as depth.
  const longer = new Uint8Array(part.length + 1);
  longer.set(part);
  for (const wrong of [part.subarray(0, part.length - 1), part.subarray(0, part.length >> 1), part.subarray(0, 3), longer]) {
    try {
      decodeCodes(wrong, view, view.name);
    } catch {
      ++found.cut;
    }
  }
  return found;
});
console.log(JSON.stringify(views));
