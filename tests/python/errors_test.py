"""Errors: exceptions of Python's kinds with one line of ours."""

import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import dtr
import numpy as np

from small_sets import WithSet


class Import(unittest.TestCase):
    def imported_from(self, folder):
        done = subprocess.run([sys.executable, "-c", "import dtr"], capture_output=True, text=True,
                              env={"PYTHONPATH": str(folder), "PATH": "/usr/bin:/bin"}, cwd=folder)
        self.assertEqual(done.returncode, 1)
        return done.stderr.splitlines()[-1]

    def test_without_the_module(self):
        with tempfile.TemporaryDirectory(prefix="dtr-test-") as folder:
            package = Path(folder) / "dtr"
            shutil.copytree("python/dtr", package, ignore=shutil.ignore_patterns("__pycache__"))
            self.assertEqual(self.imported_from(folder),
                             "ImportError: dtr._core is not built; build it: cmake --preset release && "
                             "cmake --build --preset release --target dtr_python")
            (package / "_core.cpython-32-x86_64-linux-gnu.so").write_text("")
            self.assertRegex(self.imported_from(folder),
                             r"^ImportError: dtr\._core is built for another Python \(_core\.cpython-32-.*\), this is "
                             r"/.* of version 3\.\d+; start that one, on Debian /usr/bin/python3$")
            # A module that does not load says why.
            broken = package / Path(dtr._core.__file__).name
            broken.write_text("no module")
            self.assertIn(broken.name, self.imported_from(folder))


class Errors(WithSet):
    def rejected(self, kind, text, call, *args, **options):
        with self.assertRaisesRegex(kind, text) as caught:
            call(*args, **options)
        self.assertNotIn("\n", str(caught.exception))
        return str(caught.exception)

    def test_kinds(self):
        self.assertTrue(issubclass(dtr.UsageError, ValueError))
        self.assertTrue(issubclass(dtr.UsageError, dtr.Error))
        self.assertTrue(issubclass(dtr.Error, RuntimeError))

    def test_sets_that_are_none(self):
        self.rejected(FileNotFoundError, "expected the folder of a D.TR set, found nothing", dtr.load,
                      self.folder / "nothing.dtr")
        self.rejected(dtr.Error, "expected the folder of a D.TR set, found a file", dtr.load, __file__)
        empty = self.folder / "empty.dtr"
        empty.mkdir()
        self.rejected(dtr.Error, "expected the file that makes a folder a D.TR set", dtr.load, empty)
        (empty / "set.json").write_text("{")
        self.rejected(dtr.Error, "set.json", dtr.load, empty)
        with self.assertRaises(TypeError):
            dtr.load(7)

    def test_a_damaged_image(self):
        broken = self.folder / "broken.dtr"
        shutil.copytree(self.path, broken)
        image = next((broken / "images").glob("0001*"))
        data = image.read_bytes()
        image.write_bytes(data[: len(data) // 2] + b"\0" * (len(data) - len(data) // 2))
        s = dtr.load(broken)
        self.rejected(dtr.Error, "0001", lambda: s.views[1].image)
        self.assertEqual(s.views[2].image.ndim, 3)  # others are as they were
        self.rejected(dtr.Error, "0001", s.load_pixels)

    def test_names(self):
        s = dtr.load(self.path)
        self.rejected(dtr.UsageError, "nobody", s.view, "nobody")
        self.rejected(dtr.UsageError, "nobody", s.render, "nobody")
        self.rejected(dtr.UsageError, "nobody", s.render, "0000", exclude=["nobody"])
        self.rejected(dtr.UsageError, "`time_step`: expected a whole number", s.view, "0000", -1)
        self.rejected(dtr.UsageError, "frame", s.render, "0000", time_step=3)
        self.rejected(TypeError, "camera: expected a dtr.Camera", s.render, np.eye(3))
        self.rejected(dtr.UsageError, "`planes`: expected some of", s.load_pixels, ["colour"])

    def test_options_of_rendering(self):
        s = dtr.load(self.path)
        self.rejected(dtr.UsageError, "`renderer`: expected one of auto, .*found 'vulkan'", s.render, "0000",
                      renderer="vulkan")
        self.rejected(dtr.UsageError, "render: views: expected 1 to 1024, found 0", s.render, "0000", 0)
        self.rejected(dtr.UsageError, "found colour", s.render, "0000", colour=True)
        self.rejected(dtr.UsageError, "render: exponent", s.render, "0000", exponent="high")
        self.rejected(dtr.UsageError, "found NaN", s.render, "0000", exponent=float("nan"))
        self.rejected(dtr.UsageError, "`memory`: expected gigabytes", s.render, "0000", memory=0)
        self.rejected(dtr.UsageError, "`memory`: expected gigabytes", s.render, "0000", memory=float("nan"))
        self.rejected(dtr.UsageError, "`threads`: expected 0", s.render, "0000", threads=-2)
        self.rejected(dtr.UsageError, "`size`", s.render, "0000", size=(0, 0))
        self.rejected(dtr.UsageError, "`size`", s.render, "0000", size=(-5, 10))
        self.rejected(dtr.UsageError, "`max_side_px`", s.views[0].thumbnail, 0)
        self.rejected(TypeError, "expected text, a number", s.render, "0000", exponent=object())
        self.rejected(dtr.UsageError, "`frames`: expected 2 to", s.fly_through, 10**6)
        # A session that failed is not drawn with again.
        self.assertEqual(s.render("0000").image.shape, (64, 96, 3))

    def test_options_of_commands_have_their_names_here(self):
        s = dtr.load(self.path)
        self.rejected(dtr.UsageError, "export: `format`: .*nonsense", s.export, "nonsense", self.folder / "x")
        text = self.rejected(dtr.UsageError, "max_mb", s.export, "ply", self.folder / "x.ply", max_mb=3)
        self.assertNotIn("--", text)
        text = self.rejected(dtr.UsageError, "no option is called 'quality'; there are .*leave_one_out",
                             s.evaluate, quality=3)
        self.assertNotIn("no_", text)
        self.rejected(dtr.UsageError, "evaluate: `leave_one_out`: expected true or false", s.evaluate,
                      leave_one_out="yes")
        self.rejected(dtr.UsageError, "`max_rms`: expected a value, found true", s.validate, max_rms=True)
        self.rejected(dtr.UsageError, "no command is called 'vieww'", dtr.run, "vieww")
        self.rejected(dtr.UsageError, "no command is called 'calibrate nothing'; there are .*board", dtr.run,
                      "calibrate", "nothing")
        self.rejected(TypeError, "threads: expected text, a path, a number", s.evaluate, threads={})
        self.rejected(TypeError, "holdout: expected", dtr.build, "photos", "x.dtr", holdout=[True])

    def test_arguments_that_look_like_options(self):
        self.rejected(dtr.Error, "version.*expected the folder", dtr.run, "info", "--version")
        self.rejected(dtr.UsageError, "argument 3: expected no control characters", dtr.run, "info", "a\nb")

    def test_outputs(self):
        s = dtr.load(self.path)
        s.export("ply", self.folder / "there.ply")
        self.rejected(dtr.UsageError, "there.ply", s.export, "ply", self.folder / "there.ply")
        with self.assertRaises((OSError, dtr.Error)):
            s.export("ply", Path("/proc/nothing/x.ply"))

    def test_nothing_is_left_of_a_page_that_failed(self):
        s = dtr.load(self.path)
        self.rejected(dtr.UsageError, "jpeg_quality", s.page, jpeg_quality=0)

    def test_what_a_callback_raises_comes_back(self):
        class Enough(Exception):
            pass

        def stop(*what):
            raise Enough(what[0])

        s = dtr.load(self.path)
        with self.assertRaises(Enough):
            s.evaluate(leave_one_out=True, progress=stop)
        with self.assertRaises(Enough):
            s.load_pixels(progress=stop)


if __name__ == "__main__":
    unittest.main()
