"""Sets out of numpy arrays."""

from __future__ import annotations

import json
import tempfile
import unicodedata
from pathlib import Path
from typing import Any, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _core
from ._jobs import PathLike, ProgressCallback, run
from ._set import Set, load

_MIN_DEPTH, _MAX_DEPTH = 1e-18, 1e18  # dtr/types/computable.h
_MAX_NAME_BYTES = 200  # file systems hold 255, extensions among them


def _fail(text: str) -> _core.UsageError:
    return _core.UsageError(text)


def _array(values: Any, what: str) -> npt.NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError:
        raise _fail(f"{what}: expected an array, found lists of unequal lengths") from None


def _shown(value: Any) -> str:
    """A value in one line."""
    return " ".join(repr(value).split())[:80]


def _image(image: Any, what: str) -> npt.NDArray[np.uint8]:
    array = _array(image, what)
    if array.dtype != np.uint8 or array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise _fail(
            f"{what}: expected shape (height, width, 3) of uint8, sRGB, "
            f"found {array.shape} of {array.dtype}"
        )
    return np.ascontiguousarray(array)


def _depth(depth: Any, what: str, image: npt.NDArray[np.uint8]) -> Optional[npt.NDArray[np.float32]]:
    if depth is None:
        return None
    array = _array(depth, what)
    if array.dtype.kind != "f" or array.ndim != 2 or 0 in array.shape:
        raise _fail(
            f"{what}: expected shape (height, width) of floats, plane z in scene units, 0 for a "
            f"hole, found {array.shape} of {array.dtype}"
        )
    scale = image.shape[0] // array.shape[0]
    if scale < 1 or (array.shape[0] * scale, array.shape[1] * scale) != image.shape[:2]:
        raise _fail(
            f"{what}: expected the size of its image, {image.shape[1]}x{image.shape[0]}, or a whole "
            f"fraction of it, found {array.shape[1]}x{array.shape[0]}"
        )
    with np.errstate(over="ignore"):
        narrow = np.ascontiguousarray(array, dtype=np.float32)
    wrong = ~((narrow == 0) | ((narrow >= _MIN_DEPTH) & (narrow <= _MAX_DEPTH)))
    if wrong.any():
        y, x = np.argwhere(wrong)[0]
        raise _fail(
            f"{what}: expected depths from {_MIN_DEPTH:g} to {_MAX_DEPTH:g}, or 0 for a hole, found "
            f"{array[y, x]} at x {x}, y {y}"
        )
    return narrow if narrow.any() else None  # as held-out views of a set are read


def _matrices(values: Any, count: int, shapes: Sequence[tuple[int, int]], what: str) -> Any:
    """A stack of `count` float64 matrices."""
    array = _array(values, what)
    if array.dtype.kind not in "fiu" or array.shape[-2:] not in shapes or array.ndim not in (2, 3):
        raise _fail(
            f"{what}: expected numbers of shape (N, {shapes[0][0]}, {shapes[0][1]}), "
            f"found {array.shape} of {array.dtype}"
        )
    if array.ndim == 2:
        array = np.broadcast_to(array, (count, *array.shape))
    if len(array) != count:
        raise _fail(f"{what}: expected one for each of {count} images, found {len(array)}")
    return array.astype(np.float64)


class ArraysSet:
    """Arrays that make a set once they are saved; made by `dtr.from_arrays`."""

    def __init__(
        self,
        images: list[npt.NDArray[np.uint8]],
        depths: list[Optional[npt.NDArray[np.float32]]],
        cameras: list[_core.Camera],
        unit: str,
        world_origin: list[float],
    ) -> None:
        self._images, self._depths, self._cameras = images, depths, cameras
        self._unit, self._world_origin = unit, world_origin

    def __len__(self) -> int:
        return len(self._images)

    def save(
        self,
        path: PathLike,
        *,
        force: bool = False,
        completion: bool = True,
        progress: Optional[ProgressCallback] = None,
        **options: Any,
    ) -> Set:
        """Write the set NAME.dtr and open it, as `dtr import` would of files.

        force: replace a set that exists. completion: complete depth where there is none, so that
        images are whole. Other options of `dtr import` by name: holdout="every:8", memory=8, ...
        Images are stored exactly, depth within 1 part in 65534 of its range of 1/z.
        """
        # At the end of the interpreter a thread may still write into it.
        with tempfile.TemporaryDirectory(prefix="dtr-", ignore_cleanup_errors=True) as folder:
            arguments = self._write(Path(folder))
            if "depth" in arguments:
                arguments.update(completion=completion, **self._held_out(options))
            arguments.update(options, force=force, output=path)
            try:
                run("import", progress=progress, **arguments)
            except _core.Error as error:  # of arrays, not of files that nobody knows
                shown = str(error).replace(f"{arguments['cameras']}", "from_arrays")
                raise type(error)(shown.replace(f"{folder}/", "from_arrays: ")) from None
        return load(path)

    def _held_out(self, options: dict[str, Any]) -> dict[str, Any]:
        """Views without depth are held out, where others have some."""
        without = [c.name for c, depth in zip(self._cameras, self._depths) if depth is None]
        if not without:
            return {}
        if any("," in name for name in without):
            raise _fail(
                "`names`: expected no comma in the name of a view without depth, found "
                f"{next(name for name in without if ',' in name)!r}"
            )
        if options.pop("holdout", None) is not None:
            raise _fail(
                f"`holdout`: views without depth, as {without[0]}, are held out anyway; leave it "
                "out, or give all views depth"
            )
        return {"holdout": without}

    def _write(self, folder: Path) -> dict[str, Any]:
        views = []
        (folder / "images").mkdir()
        (folder / "depth").mkdir()
        for image, depth, camera in zip(self._images, self._depths, self._cameras):
            K = camera.K
            view = {
                "name": f"{camera.name}.png",
                "width": image.shape[1],
                "height": image.shape[0],
                "fx": K[0, 0],
                "fy": K[1, 1],
                "cx": K[0, 2],
                "cy": K[1, 2],
                "cam_from_world": camera.cam_from_world.tolist(),
            }
            _core.write_image(folder / "images" / view["name"], image)
            if depth is not None:
                view["depth"] = f"{camera.name}.exr"
                _core.write_depth(folder / "depth" / view["depth"], depth)
            views.append(view)
        text = {"unit": self._unit, "world_origin": self._world_origin, "views": views}
        (folder / "cameras.json").write_text(json.dumps(text))
        arguments = {"cameras": folder / "cameras.json", "images": folder / "images"}
        if any(depth is not None for depth in self._depths):
            arguments["depth"] = folder / "depth"
        return arguments


def from_arrays(
    images: Sequence[Any],
    depths: Sequence[Any],
    K: Any,
    poses: Any,
    *,
    names: Optional[Sequence[str]] = None,
    unit: str = "unknown",
    world_origin: Union[Sequence[float], npt.NDArray[np.float64]] = (0.0, 0.0, 0.0),
) -> ArraysSet:
    """Make a set of arrays: `dtr.from_arrays(images, depths, K, poses).save("scene.dtr")`.

    images: N of shape (height, width, 3), uint8, sRGB, undistorted. depths: N of shape (height,
    width), floats, plane z in the camera's frame (not the distance), scene units, 0 for a hole; of
    the images' sizes or a whole fraction of them; None, or holes alone, for a view that is held out,
    to measure with.
    K: (3, 3), or one for each image, pixels with the origin at the outer corner of the top-left
    pixel (from OpenCV: add 0.5 to cx and cy). poses: (N, 4, 4) or (N, 3, 4), cam_from_world: p_cam = R p_world + t, camera
    axes x right, y down, z forward. names: of the views, default '0000', '0001', ... unit:
    'metre', 'arbitrary' or 'unknown'. world_origin: (3,), added to the poses' world gives the
    user's.

    Everything is checked here. Raises UsageError (a ValueError) that names the array.
    """
    images, depths = _list(images, "`images`"), _list(depths, "`depths`")
    count = len(images)
    if count == 0 or len(depths) != count:
        raise _fail(f"`depths`: expected one for each image, found {len(depths)} of {count}")
    if unit not in ("metre", "arbitrary", "unknown"):
        raise _fail(f"`unit`: expected metre, arbitrary or unknown, found {_shown(unit)}")
    origin = _array(world_origin, "`world_origin`")
    if origin.shape != (3,) or origin.dtype.kind not in "fiu" or not np.isfinite(origin).all():
        raise _fail(f"`world_origin`: expected 3 finite numbers, found {_shown(world_origin)}")
    chosen = [f"{i:04}" for i in range(count)] if names is None else _list(names, "`names`")
    _check_names(chosen, count)
    checked_images = [_image(image, f"`images` {i}") for i, image in enumerate(images)]
    checked_depths = [
        _depth(depth, f"`depths` {i}", checked_images[i]) for i, depth in enumerate(depths)
    ]
    intrinsics = _matrices(K, count, [(3, 3)], "`K`")
    cam_from_world = _matrices(poses, count, [(4, 4), (3, 4)], "`poses`")
    cameras = []
    for i, image in enumerate(checked_images):
        pose = np.eye(4)
        pose[: cam_from_world.shape[1]] = cam_from_world[i]
        try:
            cameras.append(
                _core.Camera(intrinsics[i], pose, image.shape[1], image.shape[0], chosen[i])
            )
        except _core.Error as error:
            raise _fail(f"view {i}: {error}") from None
    return ArraysSet(
        checked_images, checked_depths, cameras, unit, origin.astype(np.float64).tolist()
    )


def _list(values: Any, what: str) -> list[Any]:
    try:
        if not isinstance(values, (str, bytes)):
            return list(values)
    except TypeError:
        pass  # it has no items
    raise _fail(f"{what}: expected a list with one for each view, found {_shown(values)}")


def _check_names(names: Sequence[Any], count: int) -> None:
    for name in names:
        if not _is_file_name(name):
            raise _fail(f"`names`: expected names of files, found {_shown(name)}")
    if len(names) != count or len(set(names)) != count:
        raise _fail(f"`names`: expected {count} different ones, found {len(set(names))}")


def _is_file_name(name: Any) -> bool:
    """Also one that a line of text may hold."""
    if not isinstance(name, str) or not name or name.startswith("."):
        return False
    no_text = ("Cc", "Cs", "Zl", "Zp")  # control characters, halves of characters, ends of lines
    if any(c in "/\\" or unicodedata.category(c) in no_text for c in name):
        return False
    return len(name.encode()) <= _MAX_NAME_BYTES
