"""Imports the C++ half, or says what to do where it cannot be."""

import importlib
import sys
from pathlib import Path


def _reason() -> str:
    others = sorted(file.name for file in Path(__file__).parent.glob("_core.*.so"))
    if not others:
        return (
            "dtr._core is not built; build it: cmake --preset release && "
            "cmake --build --preset release --target dtr_python"
        )
    return (
        f"dtr._core is built for another Python ({others[0]}), this is {sys.executable} of version "
        f"{sys.version_info[0]}.{sys.version_info[1]}; start that one, on Debian /usr/bin/python3"
    )


try:
    importlib.import_module("._core", __package__)
except ModuleNotFoundError as missing:
    if missing.name != f"{__package__}._core":
        raise
    raise ImportError(_reason()) from None
