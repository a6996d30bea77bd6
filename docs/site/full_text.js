// The search of full_text.html over kSections of full_text_index.js: sections that contain every word, those first whose title does.
const kShown = 60;
const kAround = 90;  // characters of the text on both sides of a word

function fold(text) {
  return text.toLowerCase().normalize("NFD").replace(/[\u0300-\u036f]/g, "");
}

function sectionsWith(words) {
  const found = [];
  kSections.forEach((section, order) => {
    const title = fold(section.title), text = fold(section.text);
    if (!words.every((word) => title.includes(word) || text.includes(word))) return;
    found.push({ section, order, inTitle: words.filter((word) => title.includes(word)).length });
  });
  return found.sort((a, b) => b.inTitle - a.inTitle || a.order - b.order);
}

// Text, with each of the words in it marked.
function appendMarked(parent, text, words) {
  const folded = fold(text);
  let at = 0;
  while (folded.length === text.length) {
    const hits = words.map((word) => [folded.indexOf(word, at), word.length]).filter(([start]) => start >= 0);
    if (hits.length === 0) break;
    const [start, length] = hits.reduce((a, b) => (b[0] < a[0] ? b : a));
    parent.append(text.slice(at, start));
    parent.append(Object.assign(document.createElement("mark"), { textContent: text.slice(start, start + length) }));
    at = start + length;
  }
  parent.append(text.slice(at));
}

function excerpt(text, words) {
  const hits = words.map((word) => fold(text).indexOf(word)).filter((start) => start >= 0);
  const start = Math.max(0, (hits.length > 0 ? Math.min(...hits) : 0) - kAround);
  return (start > 0 ? "... " : "") + text.slice(start, start + 3 * kAround) + (start + 3 * kAround < text.length ? " ..." : "");
}

function show(query) {
  const words = fold(query).split(/\s+/).filter((word) => word.length > 1);
  const list = document.getElementById("found"), count = document.getElementById("count");
  list.replaceChildren();
  count.textContent = "";
  if (words.length === 0) return;
  const found = sectionsWith(words);
  count.textContent = found.length > kShown ? `${found.length} sections, the first ${kShown}:` : `${found.length} sections`;
  for (const { section } of found.slice(0, kShown)) {
    const item = document.createElement("p");
    const link = Object.assign(document.createElement("a"), { href: section.address });
    appendMarked(link, section.page === section.title ? section.title : `${section.page}: ${section.title}`, words);
    item.append(link, document.createElement("br"));
    appendMarked(item, excerpt(section.text, words), words);
    list.append(item);
  }
}

const field = document.getElementById("words");
field.addEventListener("input", () => {
  history.replaceState(null, "", field.value ? `#${encodeURIComponent(field.value)}` : location.pathname);
  show(field.value);
});
field.value = decodeURIComponent(location.hash.slice(1));
show(field.value);
