"""D+TR sets in Python: photos with depth maps and calibrated cameras, and new views of them.

>>> import dtr
>>> s = dtr.load("scene.dtr")
>>> view = s["0003"]                             # or s[3]
>>> view.image.shape, view.depth.shape          # numpy, read-only, without copies
>>> frame = s.render(view, views=8)             # what `dtr render` writes
>>> frame.image, frame.depth, frame.coverage

Lengths are in the set's unit (`s.unit`), points relative to `s.world_origin`; pixels have their
origin at the outer corner of the top-left pixel. docs/PYTHON.md is a tour.
"""

from . import _built  # first: says what to do where the module is not there
from ._arrays import ArraysSet, from_arrays
from ._core import Camera, Error, UsageError, View, __version__
from ._jobs import build, run
from ._notebook import Page
from ._set import Frame, Points, Set, TimeStep, Views, load

del _built

# As people know them, in messages and in help().
for _public in (Camera, Error, UsageError, View):
    _public.__module__ = "dtr"

__all__ = [
    "ArraysSet",
    "Camera",
    "Error",
    "Frame",
    "Page",
    "Points",
    "Set",
    "TimeStep",
    "UsageError",
    "View",
    "Views",
    "__version__",
    "build",
    "from_arrays",
    "load",
    "run",
]
