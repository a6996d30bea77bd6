"""outputs.py PAGE FOLDER: puts programs' outputs into a page.

A line `<!-- output LOG: EXPRESSION -->` in PAGE stands before a block of code, which becomes the lines
of FOLDER/LOG that the regular expression finds, cut to a page's width.
"""

import pathlib
import re
import sys

WIDTH = 140
BLOCK = re.compile(r"(<!-- output (\S+): ([^\n]+) -->\n```\n)(.*?)(```\n)", re.DOTALL)


def lines_of(log, expression):
    text = log.read_text().replace("\r", "\n")
    found = [line.rstrip() for line in text.splitlines() if re.search(expression, line)]
    if not found:
        sys.exit(f"{log}: expected lines that match {expression}, found none")
    return [line if len(line) <= WIDTH else line[:WIDTH].rsplit(" ", 1)[0] + " [...]" for line in found]


page, folder = (pathlib.Path(argument) for argument in sys.argv[1:3])
filled = BLOCK.sub(
    lambda block: block[1] + "\n".join(lines_of(folder / block[2], block[3])) + "\n" + block[5],
    page.read_text(),
)
page.write_text(filled)
