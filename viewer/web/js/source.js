// Where a set's bytes come from: elements of the page, or files beside it that a server gives.
import { Problem, fail } from "./problem.js";

const kMaxHeaderBytes = 1 << 26;

/** Views that stand in this page as text. */
export const embeddedSource = {
  dataOf: async (view) => ({ text: document.getElementById(`view-${view.index}`)?.textContent ?? "" }),
};

// What a server gives, of at most so many bytes.
async function bytesAt(url, most, what) {
  const gone = () => { throw new Problem(`${what}: cannot be fetched; is there a connection?`); };
  const response = await fetch(url).catch(gone);
  if (!response.ok) throw new Problem(`${what}: the server answers ${response.status}`);
  const reader = response.body.getReader(), parts = [];
  let size = 0;
  for (let next = await reader.read().catch(gone); !next.done; next = await reader.read().catch(gone)) {
    size += next.value.length;
    if (size > most) {
      reader.cancel();
      fail(what, `at most ${most} bytes`, "more");
    }
    parts.push(next.value);
  }
  const bytes = new Uint8Array(size);
  parts.reduce((at, part) => (bytes.set(part, at), at + part.length), 0);
  return bytes;
}

/** The files that `dtr export -o folder/` writes; `address`: of its set.json. */
export class FolderSource {
  constructor(address) {
    this.address = new URL(address, document.baseURI);
  }

  /** The text of set.json. */
  async header() {
    return new TextDecoder().decode(await bytesAt(this.address, kMaxHeaderBytes, "set.json"));
  }

  async dataOf(view) {
    return { bytes: await bytesAt(new URL(`view-${view.index}.bin`, this.address), view.bytes, `photo ${view.name}`) };
  }
}
