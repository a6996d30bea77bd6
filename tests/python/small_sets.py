"""Small sets for tests, made by the program once a test file."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

PROGRAM = os.environ["DTR_PROGRAM"]


def run_program(*words):
    """Runs `dtr WORDS...`; gives what it printed. Fails the test with its words."""
    done = subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"dtr {' '.join(map(str, words))}: {done.stderr}")
    return done.stdout


def make_courtyard(folder, views=6, width=96, height=64):
    """A synthetic scene with true depth: images/, depth/, cameras.json."""
    run_program("dataset", "make", "courtyard", "-o", folder, "--views", views,
                "--width", width, "--height", height)


def import_courtyard(courtyard, target, *options):
    run_program("import", "--cameras", courtyard / "cameras.json", "--images", courtyard / "images",
                "--depth", courtyard / "depth", "-o", target, *options)


class WithSet(unittest.TestCase):
    """self.path: a set with true and completed depth and a held-out view, for reading only.
    self.folder: a folder of the test file."""

    @classmethod
    def setUpClass(cls):
        cls._temporary = tempfile.TemporaryDirectory(prefix="dtr-test-")
        cls.folder = Path(cls._temporary.name)
        cls.courtyard = cls.folder / "courtyard"
        cls.path = cls.folder / "courtyard.dtr"
        make_courtyard(cls.courtyard)
        import_courtyard(cls.courtyard, cls.path, "--holdout", "every:3")

    @classmethod
    def tearDownClass(cls):
        cls._temporary.cleanup()
