"""Sets, and what is made of them."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from functools import partial
from typing import (
    Any,
    Callable,
    Iterable,
    Iterator,
    NoReturn,
    Optional,
    Sequence,
    SupportsIndex,
    Tuple,
    Union,
    overload,
)

import numpy as np
import numpy.typing as npt

from . import _core, _notebook
from ._core import Camera, View
from ._jobs import PathLike, ProgressCallback, note, python_messages, run

#: What View has one of per pixel.
PLANES = ("image", "mask", "depth", "completed_depth", "sigma")


class Views(Tuple[View, ...]):
    """Views of a time step in order: `views[3]`, or by the photo's name, `views["0003"]`.

    Names may be without their extension. `"0003" in views` is True where there is that view.
    """

    _index_of: Callable[[str], int]

    def __new__(cls, views: Iterable[View], index_of: Callable[[str], int]) -> Views:
        made = super().__new__(cls, tuple(views))
        made._index_of = index_of
        return made

    @overload
    def __getitem__(self, at: SupportsIndex) -> View: ...
    @overload
    def __getitem__(self, at: slice) -> tuple[View, ...]: ...
    @overload
    def __getitem__(self, at: str) -> View: ...
    def __getitem__(self, at: Union[SupportsIndex, slice, str]) -> Union[View, tuple[View, ...]]:
        if isinstance(at, str):
            with python_messages():
                at = self._index_of(at)
        return super().__getitem__(at)

    def __contains__(self, view: object) -> bool:
        if not isinstance(view, str):
            return super().__contains__(view)
        try:
            self._index_of(view)
        except _core.UsageError:
            return False
        return True

    def __repr__(self) -> str:
        names = [view.name for view in self]
        shown = names if len(names) <= 4 else [*names[:2], "...", names[-1]]
        return f"<dtr.Views {len(names)}: {', '.join(shown)}>"


@dataclass(frozen=True)
class TimeStep:
    """The views of one moment; a still scene has one time step."""

    time_s: float
    views: Views


# Compared as objects are: arrays have no one answer to ==.
@dataclass(frozen=True, eq=False, repr=False)
class Frame:
    """A rendered image. All arrays have the size of its camera.

    image: (height, width, 3) uint8, sRGB. depth: (height, width) float32, plane z in the camera's
    frame, scene units, 0 where no view saw anything. coverage: (height, width) uint8, 255 where some
    view saw the pixel (pixels that were filled are not). view_count: (height, width) uint8, views
    blended at the pixel. views_used: their names, nearest first. skipped: views that could not be
    read, with the reason. coverage_share: share of pixels that some view saw.
    """

    camera: Camera
    image: npt.NDArray[np.uint8]
    depth: npt.NDArray[np.float32]
    coverage: npt.NDArray[np.uint8]
    view_count: npt.NDArray[np.uint8]
    views_used: list[str]
    skipped: list[tuple[str, str]]
    coverage_share: float

    def _repr_png_(self) -> bytes:
        return _core.png(self.image)

    def __repr__(self) -> str:
        height, width = self.image.shape[:2]
        return (
            f"<dtr.Frame {self.camera.name}, {width}x{height} of {len(self.views_used)} views, "
            f"{100 * self.coverage_share:.1f} % seen>"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Points:
    """A view's pixels with depth as points, row by row of the depth map.

    points: (N, 3) float64, in the set's world, scene units; add `world_origin` for the user's own
    world. colours: (N, 3) uint8, sRGB. sigma: (N,) float64, standard deviation along the ray, scene
    units; NaN where it is not known. directions: (N, 3) float64, unit vectors of the world from the
    camera to the point: a point's error bar is `points ± sigma * directions`. pixels: (N, 2) int32,
    x and y in the depth map. completed: (N,) bool, True where depth was not measured.
    """

    points: npt.NDArray[np.float64]
    colours: npt.NDArray[np.uint8]
    sigma: npt.NDArray[np.float64]
    directions: npt.NDArray[np.float64]
    pixels: npt.NDArray[np.int32]
    completed: npt.NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        text = f"<dtr.Points {len(self)}"
        if self.completed.any():
            text += f", {self.completed.sum()} of them completed"
        if np.isfinite(self.sigma).any():
            text += f", median sigma {np.nanmedian(self.sigma):.3g}"
        return text + ">"


def load(path: PathLike) -> Set:
    """Open a set.

    Its description is read and checked now, pixels when they are asked for, each once; see
    `Set.load_pixels`. Raises FileNotFoundError where there is nothing, Error for a damaged set.
    """
    return Set(_core.OpenSet(os.fspath(path)), os.fspath(path))


class Set:
    """A Depth + Texture Representation of a scene, opened by `dtr.load`."""

    #: What `dtr.build` reported; None for a set that was loaded.
    build_report: Optional[dict[str, Any]] = None

    def __init__(self, opened: _core.OpenSet, path: str) -> None:
        self._open = opened
        self._path = path
        self._time_steps = tuple(
            TimeStep(time, Views(views, partial(opened.index_of, time_step=i)))
            for i, (time, views) in enumerate(zip(opened.times_s, opened.views()))
        )

    # ---- description

    @property
    def path(self) -> str:
        """The set's folder."""
        return self._path

    @property
    def unit(self) -> str:
        """What one scene unit is: 'metre', 'arbitrary' or 'unknown'."""
        return self._open.unit

    @property
    def world_origin(self) -> npt.NDArray[np.float64]:
        """(3,) float64: the user's world is the set's, in which all points and poses are, plus this."""
        return self._open.world_origin

    @property
    def scene_center(self) -> npt.NDArray[np.float64]:
        """(3,) float64, in the set's world: where angles between views are measured."""
        return self._open.scene_center

    @property
    def validation(self) -> dict[str, Any]:
        """What was found when the set was built: 'passed' and 'tests'; empty: not validated."""
        result: dict[str, Any] = json.loads(self._open.validation_json)
        return result

    @property
    def info(self) -> dict[str, Any]:
        """What `dtr info --json` gives."""
        result: dict[str, Any] = json.loads(self._open.info_json)
        return result

    @property
    def time_steps(self) -> tuple[TimeStep, ...]:
        """All of them, in order."""
        return self._time_steps

    @property
    def views(self) -> Views:
        """Those of the first time step, held-out ones too: `views[3]`, `views["0003"]`."""
        return self._time_steps[0].views

    def __len__(self) -> int:
        return len(self.views)

    @overload
    def __getitem__(self, at: Union[SupportsIndex, str]) -> View: ...
    @overload
    def __getitem__(self, at: slice) -> tuple[View, ...]: ...
    def __getitem__(self, at: Union[SupportsIndex, slice, str]) -> Union[View, tuple[View, ...]]:
        return self.views[at]

    def __iter__(self) -> Iterator[View]:
        return iter(self.views)

    def __contains__(self, view: object) -> bool:
        return view in self.views

    def view(self, name: str, time_step: int = 0) -> View:
        """The view of that photo, with or without its extension. Raises UsageError."""
        _require_count("time_step", time_step)
        with python_messages():
            index = self._open.index_of(name, time_step)
        return self._time_steps[time_step].views[index]

    # ---- pixels

    def load_pixels(
        self,
        planes: Iterable[str] = PLANES,
        *,
        threads: int = 0,
        progress: Optional[ProgressCallback] = None,
    ) -> None:
        """Read pixels of all views at once, on all cores; without it each view's are read alone.

        planes: of 'image', 'mask', 'depth', 'completed_depth', 'sigma'.
        """
        wanted = [planes] if isinstance(planes, str) else list(planes)
        for plane in wanted:
            if plane not in PLANES:
                raise _core.UsageError(
                    f"`planes`: expected some of {', '.join(PLANES)}, found {plane!r}"
                )
        _require_count("threads", threads)
        self._open.load_pixels(wanted, threads, progress, note)

    def drop_pixels(self) -> None:
        """Free the memory of all pixels and renderers. Arrays that are in use keep theirs."""
        self._open.drop_pixels()

    def unproject(self, view: Union[View, str], *, completed: bool = False) -> Points:
        """Every pixel of a view with depth as a point, with its standard deviation.

        completed: also where depth was not measured but completed. Raises Error for a view without
        depth.
        """
        chosen = self.view(view) if isinstance(view, str) else view
        return Points(**chosen._unproject(completed))

    # ---- images

    def render(
        self,
        camera: Union[Camera, View, str],
        views: Optional[int] = None,
        renderer: str = "auto",
        *,
        size: Optional[tuple[int, int]] = None,
        exclude: Union[str, Sequence[Union[str, View]]] = (),
        time_step: int = 0,
        measured_only: bool = False,
        threads: int = 0,
        memory: float = 4.0,
        gpu_memory: float = 4.0,
        **options: Any,
    ) -> Frame:
        """Draw the scene as a camera sees it: the same bytes as `dtr render`.

        camera: a Camera, or a view whose place and camera are meant, or its name.
        views: blend at most so many of the nearest valid views; 8, unless the set was pruned for
        another number. renderer: 'auto' ('gl' on a GPU, else 'simd'), 'gl', 'simd' or 'cpu', the
        slow reference. size: (width, height) in pixels, 0 for either keeps the proportions.
        exclude: views not to draw from. measured_only: without completed depth. memory: GB for the
        views' pixels; gpu_memory: GB for what a renderer makes of them.
        options: fill_holes, smooth_edges, method, blend, max_angle_deg, ..., as docs/FORMAT.md names
        them (2.1).

        Python's lock is released; threads may render from one set at once, each with views and
        renderer of its own.
        """
        chosen = self._camera(camera, time_step)
        if size is not None:
            width, height = size
            with python_messages():
                chosen = chosen.resized(width, height)
        settings = _core.RenderSettings()
        settings.renderer = renderer
        settings.memory_gb = memory
        settings.gpu_memory_gb = gpu_memory
        settings.exclude = _names(exclude)
        settings.time_step = time_step
        settings.measured_only = measured_only
        settings.threads = threads
        if views is not None:
            options["views"] = views
        if options.get("primitive") == "splat":
            options.setdefault("method", "two-pass")  # as the command line has it
        with python_messages():
            drawn = self._open.render(chosen, _json(options), settings, note)
        return Frame(camera=chosen, **drawn)

    def fly_through(self, frames: int, *, size: str = "") -> list[Camera]:
        """Cameras on a path along the set's own, as `dtr render --fly-through` has them.

        size: 'WxH', 0 for either keeps the proportions.
        """
        with python_messages():
            return self._open.fly_through(frames, size)

    def cameras(self, file: PathLike) -> list[Camera]:
        """Cameras of a file of any program that `dtr import --cameras` reads, in the set's world."""
        with python_messages():
            return self._open.cameras_of_file(os.fspath(file), note)

    def _camera(self, camera: Union[Camera, View, str], time_step: int) -> Camera:
        _require_count("time_step", time_step)
        if isinstance(camera, Camera):
            return camera
        if isinstance(camera, View):
            return camera.camera
        if isinstance(camera, str):
            with python_messages():
                return self._open.camera_like(camera, time_step)
        raise TypeError(
            f"camera: expected a dtr.Camera, a view or its name, found {type(camera).__name__}"
        )

    # ---- jobs

    def evaluate(
        self, *, progress: Optional[ProgressCallback] = None, **options: Any
    ) -> dict[str, Any]:
        """Render the held-out photos' views and compare: what `dtr evaluate --json` gives.

        `evaluate()["mean"]["psnr_db"]`. Options of the command by name: leave_one_out=True,
        depth=TRUTH, images=FOLDER, renderer="simd", ...
        """
        return run("evaluate", self._path, progress=progress, **options)

    def validate(
        self, *, progress: Optional[ProgressCallback] = None, **options: Any
    ) -> dict[str, Any]:
        """Test the calibration: what `dtr validate --json` gives, 'passed' among it.

        A test that fails is a result and raises nothing. Options by name: max_rms=0.8,
        report="page.html", ...
        """
        return run("validate", self._path, progress=progress, **options)

    def export(
        self,
        format: str,
        path: PathLike,
        *,
        progress: Optional[ProgressCallback] = None,
        **options: Any,
    ) -> dict[str, Any]:
        """Write the set for other programs: `dtr export --format FORMAT -o PATH`.

        format: 'web', 'ply', 'las', 'mesh', 'splat', 'depth', 'colmap', 'nerfstudio', 'mvsnet',
        'openmvs' or 'miv' (docs/EXPORT.md). Options by name: min_views=3, max_mb=8, ...
        """
        return run("export", self._path, progress=progress, format=format, output=path, **options)

    # ---- notebooks

    def page(
        self, path: Optional[PathLike] = None, *, height: int = 600, **options: Any
    ) -> _notebook.Page:
        """The web page of the set (`export("web", ...)`), which Jupyter shows in an IFrame.

        path: where the HTML file is kept; None: it lives as long as what is returned. height of the
        IFrame in pixels. Options of the export by name: max_mb=8, evaluate=False, ...
        """
        return _notebook.make_page(self, path, height, options)

    def _repr_html_(self) -> str:
        return _notebook.contact_sheet(self)

    def __reduce__(self) -> NoReturn:
        raise TypeError("Set: an open set cannot be pickled; pass its `path`, and dtr.load it there")

    def __repr__(self) -> str:
        views = self.views
        held_out = sum(view.role == "held_out" for view in views)
        return f"<dtr.Set {self._path}: {len(views) - held_out} views, {held_out} held out>"


def _require_count(name: str, value: int) -> None:
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 0:
        raise _core.UsageError(f"`{name}`: expected a whole number from 0 on, found {value!r}")


def _names(views: Union[str, Sequence[Union[str, View]]]) -> str:
    if isinstance(views, str):
        return views
    return ",".join(view if isinstance(view, str) else view.name for view in views)


def _json(options: dict[str, Any]) -> str:
    def plain(value: Any) -> Any:
        if isinstance(value, np.generic):
            return value.item()
        raise TypeError(f"expected text, a number, True or False, found {type(value).__name__}")

    try:
        return json.dumps(options, default=plain, allow_nan=False)
    except ValueError:
        raise _core.UsageError(
            "render: expected finite numbers, found NaN or infinity among the options"
        ) from None
