"""What documents and examples show works: the code of docs/PYTHON.md and examples/python."""

import contextlib
import io
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

import dtr

from small_sets import WithSet, make_courtyard

ROOT = Path.cwd()
EXAMPLES = ROOT / "examples/python"


def blocks_of(page):
    return re.findall(r"^```python\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


class Documents(WithSet):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        make_courtyard(cls.folder / "photos", views=6, width=144, height=96)
        cls.cameras = cls.folder / "photos" / "cameras.json"
        # With known cameras no structure from motion is needed, which photos so small would not give.
        cls.built = dtr.build(cls.folder / "photos/images", cls.folder / "scene.dtr", poses=cls.cameras,
                              preset="fast", holdout="every:4")

    def test_the_code_of_the_page(self):
        blocks = blocks_of(ROOT / "docs/PYTHON.md")
        self.assertGreater(len(blocks), 5)
        os.chdir(self.folder)
        self.addCleanup(os.chdir, ROOT)
        names = {"__name__": "page"}
        shown = io.StringIO()
        with contextlib.redirect_stdout(shown):
            for block in blocks:
                # The page builds from photos with structure from motion; here the cameras are known.
                text = block.replace('dtr.build("photos/"', 'dtr.build("photos/images", poses="photos/cameras.json", output="my.dtr"'
                                     ).replace('output="my.dtr", "my.dtr"', 'output="my.dtr"')
                exec(compile(text, "docs/PYTHON.md", "exec"), names)
        self.assertTrue(shown.getvalue())

    def test_the_line_of_the_readme(self):
        code = re.search(r"`(import dtr; [^`]+)`", (ROOT / "README.md").read_text())[1]
        names = {}
        exec(code.replace("out/plaza.dtr", str(self.folder / "scene.dtr")), names)
        view = names["s"][re.search(r's\["(\w+)"\]\.depth', code)[1]]
        self.assertEqual(view.role, "source")
        self.assertTrue(view.depth.any())

    def run_example(self, name, *words, code=0):
        done = subprocess.run([sys.executable, EXAMPLES / name, *map(str, words)], capture_output=True, text=True,
                              cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stdout

    def skip_without_matplotlib(self):
        try:
            import matplotlib  # noqa: F401
        except ImportError as missing:
            self.skipTest(f"{missing} (Debian: python3-matplotlib)")

    def test_build_and_look(self):
        self.skip_without_matplotlib()
        out = self.run_example("build_and_look.py", "photos/images", "look.dtr", "--poses", self.cameras,
                               "--output", "look")
        self.assertRegex(out, r"5 views, 1 held out")
        self.assertRegex(out, r"PSNR +\d+\.\d dB")
        for file in ("comparison.png", "page.html"):
            self.assertGreater((self.folder / "look" / file).stat().st_size, 1000)

    def test_error_bars(self):
        self.skip_without_matplotlib()
        out = self.run_example("depth_error_bars.py", "scene.dtr", "0001", "--output", "cloud")
        count = int(re.search(r"(\d+) points", out)[1])
        self.assertGreater(count, 1000)
        with open(self.folder / "cloud.ply", "rb") as file:
            head = file.read(1000)
            self.assertIn(f"element vertex {count}".encode(), head)
        self.assertGreater((self.folder / "cloud.png").stat().st_size, 5000)

    def test_plot_validation(self):
        self.skip_without_matplotlib()
        passed = self.built.validate()["passed"]  # photos so small may not determine their cameras
        out = self.run_example("plot_validation.py", "scene.dtr", "--output", "validation.png",
                               code=0 if passed else 1)
        self.assertRegex(out, r"(passed|FAILED) held_out_rms_px")
        self.assertGreater((self.folder / "validation.png").stat().st_size, 5000)

    def test_examples_say_what_is_wrong(self):
        self.skip_without_matplotlib()
        for name in ("depth_error_bars.py", "plot_validation.py"):
            words = ["nothing.dtr", "0001"] if name.startswith("depth") else ["nothing.dtr"]
            done = subprocess.run([sys.executable, EXAMPLES / name, *words], capture_output=True, text=True)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertIn("expected the folder of a D+TR set", done.stderr)


if __name__ == "__main__":
    unittest.main()
