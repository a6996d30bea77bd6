// Modules of npm from the folder that DTR_PLAYWRIGHT names, which has node_modules.
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";

const { resolve: place } = createRequire(`${resolve(process.env.DTR_PLAYWRIGHT)}/`);

/** Promise of a module by its name; of one in CommonJS with its parts under their names. */
export async function npmModule(name) {
  const loaded = await import(pathToFileURL(place(name)));
  return { ...loaded.default, ...loaded };
}
