"""Links of our documents, and of the site that is made of them: what is wrong with each that leads nowhere.

Addresses of other hosts are not asked for: whether they answer is not a matter of this repository.
"""
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

from markdown_pages import EXTERNAL, anchors, headings_of, links_of


def documents(root):
    """The Markdown files of the repository; of a copy without git, those of the folders that have some."""
    listed = subprocess.run(["git", "-C", root, "ls-files", "-co", "--exclude-standard", "*.md"], capture_output=True, text=True)
    if listed.returncode == 0 and listed.stdout:
        return [Path(line) for line in listed.stdout.splitlines() if (root / line).is_file()]
    return sorted(path.relative_to(root) for pattern in ("*.md", "docs/**/*.md", "datasets/**/*.md", "examples/**/*.md")
                  for path in root.glob(pattern))


def faults_of_documents(root):
    """A line for each link of a Markdown file to a file or section that is not there."""
    root = root.resolve()
    texts = {path: (root / path).read_text(encoding="utf-8") for path in documents(root)}
    known = {path: set(anchors(headings_of(text))) for path, text in texts.items()}
    faults = []
    for path, text in texts.items():
        for line, target in links_of(text):
            if EXTERNAL.match(target):
                continue
            where = f"{path}:{line}: {target}"
            file, _, anchor = unquote(target).partition("#")
            found = (root / path.parent / file).resolve() if file else root / path
            if not found.exists() or not found.is_relative_to(root):
                faults.append(f"{where}: no such file in the repository")
            elif anchor and found.relative_to(root) not in known:
                faults.append(f"{where}: a section of what is no document")
            elif anchor and anchor not in known[found.relative_to(root)]:
                faults.append(f"{where}: no such section; there are: {', '.join(sorted(known[found.relative_to(root)]))}")
    return faults


class Page(HTMLParser):
    """Anchors of a page, and what it refers to."""

    def __init__(self, path):
        super().__init__()
        self.anchors, self.targets = set(), []
        self.feed(path.read_text(encoding="utf-8", errors="replace"))

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("id", "name") and value:
                self.anchors.add(value)
            elif name in ("href", "src", "data") and value:
                self.targets.append(value)


def faults_of_site(folder, others=()):
    """A line for each link of the pages in `folder` that leads to no file of it, or to no anchor of a page.

    others: addresses that a script has.
    """
    pages = {path: Page(path) for path in sorted(folder.rglob("*.html"))}
    if not pages:
        return [f"{folder}: expected pages, found none"]
    faults = []
    targets = {path: page.targets for path, page in pages.items()}
    targets[folder / "(script)"] = others
    for path in targets:
        for target in dict.fromkeys(targets[path]):
            if EXTERNAL.match(target):
                continue
            file, _, anchor = unquote(target).partition("#")
            found = (path.parent / file).resolve() if file else path
            where = f"{path.relative_to(folder)}: {target}"
            if not found.is_file() or not found.is_relative_to(folder.resolve()):
                faults.append(f"{where}: no such file of the site")
            elif anchor and found in pages and anchor not in pages[found].anchors:
                faults.append(f"{where}: no such anchor")
    return faults
