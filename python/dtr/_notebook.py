"""What Jupyter shows."""

from __future__ import annotations

import base64
import html
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Optional

from ._jobs import PathLike

if TYPE_CHECKING:
    from ._set import Set

_MAX_THUMBNAILS = 24
_CELL_PX = 160


def _evenly(count: int, most: int) -> list[int]:
    if count <= most:
        return list(range(count))
    return [i * (count - 1) // (most - 1) for i in range(most)]


def contact_sheet(s: Set) -> str:
    """The set's views as small images, evenly chosen where there are many."""
    views = s.views
    held_out = sum(view.role == "held_out" for view in views)
    validation = s.validation.get("passed")
    state = {None: "not validated", True: "passed", False: "FAILED"}[validation]
    facts = [f"{len(views) - held_out} views", f"{held_out} held out", f"unit: {s.unit}"]
    steps = len(s.time_steps)
    if steps > 1:
        facts.append(f"{steps} time steps")
    facts.append(f"calibration: {state}")
    cells = []
    chosen = _evenly(len(views), _MAX_THUMBNAILS)
    for i in chosen:
        view = views[i]
        jpeg = base64.b64encode(view.thumbnail(_CELL_PX)).decode()
        label = html.escape(view.name) + (" (held out)" if view.role == "held_out" else "")
        cells.append(
            f'<figure style="display:inline-block;width:{_CELL_PX}px;margin:2px;'
            f'text-align:center;font-size:80%;overflow:hidden">'
            f'<img src="data:image/jpeg;base64,{jpeg}" alt="{label}">'
            f"<figcaption>{label}</figcaption></figure>"
        )
    more = f"<p>{len(chosen)} of {len(views)} are shown</p>" if len(chosen) < len(views) else ""
    name = html.escape(Path(s.path).name or s.path)
    return f"<p><b>{name}</b>: {html.escape(', '.join(facts))}</p><div>{''.join(cells)}</div>{more}"


class Page:
    """The web page of a set as an HTML file; Jupyter shows it in an IFrame."""

    def __init__(self, path: str, height: int, folder: Optional[Any] = None) -> None:
        self._path, self._height = path, height
        self._folder = folder  # a temporary one, which ends with this

    @property
    def path(self) -> str:
        """The HTML file, which any browser opens."""
        return self._path

    def _repr_html_(self) -> str:
        # The page itself, not its address: a notebook's server gives no files of other folders.
        page = html.escape(Path(self._path).read_text(encoding="utf-8"))
        return (
            f'<iframe srcdoc="{page}" width="100%" height="{self._height}" '
            f'style="border:0" allowfullscreen></iframe>'
        )

    def __reduce__(self) -> tuple[Any, ...]:
        if self._folder is not None:
            raise TypeError(
                "Page: its file ends with it, so it cannot be pickled; make it by page(path), which "
                "keeps the file"
            )
        return Page, (self._path, self._height)

    def __repr__(self) -> str:
        return f"<dtr.Page {self._path}>"


def make_page(s: Set, path: Optional[PathLike], height: int, options: dict[str, Any]) -> Page:
    if path is not None:
        s.export("web", path, **options)
        return Page(os.fspath(path), height)
    folder = tempfile.TemporaryDirectory(prefix="dtr-page-")
    try:
        file = os.path.join(folder.name, "index.html")
        s.export("web", file, **options)
    except BaseException:
        folder.cleanup()
        raise
    return Page(file, height, folder)
