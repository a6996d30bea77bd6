"""Jobs of the command line as calls: the options of `dtr COMMAND` by their names."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import re
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator, Mapping, Optional, Union

from . import _core

if TYPE_CHECKING:
    from ._set import Set

PathLike = Union[str, "os.PathLike[str]"]
#: Called with the stage's name, how many of its items are done, and of how many (0: not known).
ProgressCallback = Callable[[str, int, int], Any]

_log = logging.getLogger("dtr")


def note(line: str) -> None:
    """Pass on a line that a job is worth saying: to the logger `dtr`."""
    level = logging.WARNING if line.startswith("WARNING") else logging.INFO
    _log.log(level, "%s", line.strip())


def _with_python_names(message: str) -> str:
    """--max-size, of the command line, as `max_size`."""
    return re.sub(
        r"(?<![\w-])--([a-z][a-z-]*[a-z])", lambda m: f"`{m[1].replace('-', '_')}`", message
    )


@contextlib.contextmanager
def python_messages() -> Iterator[None]:
    """Errors from inside name options as Python has them."""
    try:
        yield
    except _core.Error as error:
        message = _with_python_names(str(error))
        if message == str(error):
            raise
        raise type(error)(message) from None


def _words_of(name: str, value: Any) -> Union[bool, list[str]]:
    if isinstance(value, bool):
        return value
    if isinstance(value, str):
        return [value]
    if isinstance(value, os.PathLike):
        return [os.fspath(value)]
    if isinstance(value, (int, float)):
        return [repr(value)]
    # numpy's numbers are of no type of Python's.
    if hasattr(value, "item") and getattr(value, "ndim", None) == 0:
        return _words_of(name, value.item())
    if isinstance(value, Iterable) and not isinstance(value, (bytes, Mapping)):
        words: list[str] = []
        for item in value:
            word = _words_of(name, item)
            if isinstance(word, bool):
                break
            words += word
        else:
            return words
    raise TypeError(
        f"{name}: expected text, a path, a number, True or False, or a list of them, "
        f"found {type(value).__name__}"
    )


def run(
    *words: PathLike, progress: Optional[ProgressCallback] = None, **options: Any
) -> dict[str, Any]:
    """Run a command of `dtr` in this process and return what its `--json` gives.

    `run("stereo", "scene.dtr", preset="fast")` is `dtr stereo scene.dtr --preset fast`: options have
    their names of the command line with underscores; True and False set and unset flags, None is
    the default, lists are several values. `dtr COMMAND --help-all` describes them. The commands of
    windows and of measurements of the program (`view`, `bench`, `selftest`) are not there.

    A command whose checks failed (`validate`) returns all the same, with what it found. Notes and
    results for people go to the logger `dtr`. Python's lock is released meanwhile. Ctrl-C stops the
    work in order and raises KeyboardInterrupt; so does whatever `progress` raises.

    Raises UsageError (a ValueError) for wrong options, Error where the work cannot be done, OSError
    for files and folders that cannot be used.
    """
    given = [
        (name, _words_of(name, value)) for name, value in options.items() if value is not None
    ]
    with python_messages():
        _, text = _core.run([os.fspath(word) for word in words], given, progress, note)
    result: dict[str, Any] = json.loads(text) if text else {}
    return result


def build(
    photos: PathLike,
    output: PathLike,
    *,
    progress: Optional[ProgressCallback] = None,
    **options: Any,
) -> Set:
    """Build a set from a folder of photos, or from videos, and open it: `dtr build`.

    photos: the folder. output: the set to write, NAME.dtr. progress: called as
    `progress(stage, done, total)`, from any thread. Everything else is an option of `dtr build` by
    its name: holdout="every:8", preset="fast", max_size=800, force=True, ...

    The report of the build (photos without a camera, skipped files, cost of the stages) is
    `build_report` of the set that is returned. A build that was interrupted, by Ctrl-C too, goes on
    where it was with the same call.
    """
    from ._set import load

    report = run("build", photos, progress=progress, output=output, **options)
    built = load(output)
    built.build_report = report
    return built
