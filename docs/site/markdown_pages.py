"""What the site and the check of links both know of our Markdown: headings, anchors, links, code.

Anchors are those that hosts of repositories give headings, so that one link works there and on the site.
"""
import re
from pathlib import Path

FENCE = re.compile(r"^\s*(```|~~~)")
CODE_SPAN = re.compile(r"(`+)(.+?)\1(?!`)", re.DOTALL)
# [text](target): the text may hold code and one level of brackets, the target one level of parentheses.
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\[\]]*\])*)\]\(((?:[^()\s]|\([^()\s]*\))+)\)")
EXTERNAL = re.compile(r"^[a-z][a-z0-9+.-]*:")


def prose_and_fences(text):
    """Splits into (is_fence, text): blocks of code with their fences, and what lies between."""
    parts, lines, in_fence = [], [], False
    for line in text.splitlines(keepends=True):
        if FENCE.match(line):
            if not in_fence:
                parts.append((False, "".join(lines)))
                lines = [line]
            else:
                parts.append((True, "".join(lines) + line))
                lines = []
            in_fence = not in_fence
        else:
            lines.append(line)
    parts.append((in_fence, "".join(lines)))
    return [part for part in parts if part[1]]


def plain(heading):
    """A heading without its markup."""
    heading = LINK.sub(r"\2", heading)
    heading = re.sub(r"[`*]", "", heading)
    return heading.strip()


def anchors(headings):
    """The anchor of each heading of a page, in order."""
    found, seen = [], {}
    for heading in headings:
        slug = re.sub(r"[^\w\- ]", "", plain(heading).lower()).replace(" ", "-")
        count = seen.get(slug, 0)
        seen[slug] = count + 1
        found.append(slug if count == 0 else f"{slug}-{count}")
    return found


HEADING = re.compile(r"^(#{1,6})[ \t]+(.+?)[ \t]*#*[ \t]*$", re.MULTILINE)


def headings_of(text):
    """The texts of a page's headings, in order."""
    return [match.group(2) for fenced, part in prose_and_fences(text) if not fenced for match in HEADING.finditer(part)]


def links_of(text):
    """(line number, target) of each link and image outside code."""
    found, line = [], 1
    for fenced, part in prose_and_fences(text):
        if not fenced:
            prose = CODE_SPAN.sub(lambda m: re.sub(r"[^\n]", " ", m.group(0)), part)
            # A link's text may itself be code, blanked now; its brackets and target still stand.
            for match in LINK.finditer(prose):
                found.append((line + prose.count("\n", 0, match.start()), match.group(3)))
                # An image that is a link: its own target, too.
                for inner in LINK.finditer(match.group(2)):
                    found.append((line + prose.count("\n", 0, match.start()), inner.group(3)))
        line += part.count("\n")
    return found


def page_name(path):
    """The name of a Markdown file's page on the site: docs/accuracy/DEPTH.md is accuracy_depth."""
    if str(path) == "README.md":
        return "index"
    path = Path(path).with_suffix("")
    parts = path.parts[1:] if path.parts[0] == "docs" else path.parts
    return "_".join(parts).lower()


def label(page, anchor):
    """The name of a section among those of all pages."""
    return f"{page}_{anchor.replace('-', '_')}"
