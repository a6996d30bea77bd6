// node read_las.mjs CLOUD.las: what the LAS reader of copc (npm, by Hobu, the makers of PDAL) reads, as JSON: the values of each
// dimension.
import { readFileSync } from "node:fs";
import { npmModule } from "./npm_module.mjs";

const { Las } = await npmModule("copc");
const file = new Uint8Array(readFileSync(process.argv[2]));
const get = async (begin, end) => file.slice(begin, end);
const header = Las.Header.parse(file);
const vlrs = await Las.Vlr.walk(get, header);
const extra = Las.ExtraBytes.parse(await Las.Vlr.fetch(get, Las.Vlr.at(vlrs, "LASF_Spec", 4)));
const facts = Buffer.from(await Las.Vlr.fetch(get, Las.Vlr.at(vlrs, "dtr", 1))).toString();
const view = Las.View.create(file.slice(header.pointDataOffset), header, extra);
const values = (name) => {
  const at = view.getter(name);
  return Array.from({ length: view.pointCount }, (_, i) => at(i));
};
const names = Object.keys(view.dimensions);
console.log(JSON.stringify({
  version: `${header.majorVersion}.${header.minorVersion}`, count: header.pointCount, min: header.min, max: header.max, facts,
  ...Object.fromEntries(names.map((name) => [name, values(name)])),
}));
