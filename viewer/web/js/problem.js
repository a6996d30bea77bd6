// What cannot be shown, in words for whoever opened the page.

/** The page's data, or this browser, do not allow what is to be done. */
export class Problem extends Error {}

/** Throws a Problem that says where, what was expected and what was found. */
export function fail(where, expected, found) {
  throw new Problem(`${where}: expected ${expected}, found ${found}; the page is damaged or cut short, export it again`);
}
