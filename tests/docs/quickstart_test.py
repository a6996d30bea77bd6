"""./quickstart asks the program for what its text says, with stubs in the place of the compiler and the program."""
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Notes what it is asked for, and makes the files that quickstart looks for.
PROGRAM = """#!/bin/sh
echo "$@" >>"$CALLS"
case "$1" in
build) [ -z "$FAIL" ] || { echo "dtr: too dark"; exit 1; }; mkdir -p "$4" && touch "$4/set.json"; case "$*" in *--holdout*) echo 0003.jpg >"$4/held";; esac;;
info) [ ! -f "$2/held" ] || cat "$2/held";;
evaluate) echo "a table";;
esac
"""


class QuickstartTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        shutil.copy(ROOT / "quickstart", self.root / "quickstart")
        for stub in ("scripts/install-packages", "bin/cmake"):
            self.program(stub, "#!/bin/sh\n")
        self.program("build/release/cli/dtr", PROGRAM)
        for photos in ("datasets/plaza/images", "mine"):
            (self.root / photos).mkdir(parents=True)
            for i in range(8):
                (self.root / photos / f"{i:04}.jpg").touch()

    def program(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)

    def run_it(self, *arguments, code=0, fail=""):
        calls = self.root / "calls"
        environment = dict(os.environ, CALLS=str(calls), FAIL=fail, PATH=f"{self.root / 'bin'}:{os.environ['PATH']}")
        ran = subprocess.run([self.root / "quickstart", *arguments], env=environment, capture_output=True, text=True)
        self.assertEqual(ran.returncode, code, ran.stderr)
        return (ran.stderr if code else ran.stdout), calls.read_text().splitlines()

    def test_of_the_sample_photos_some_are_held_out(self):
        _, calls = self.run_it()
        self.assertRegex(calls[0], r"^build .*plaza/images -o .*plaza.dtr --holdout every:4$")
        self.assertTrue(any(call.startswith("render") and "--like 0003.jpg" in call for call in calls))

    def test_of_somebodys_own_photos_none_is(self):
        out, calls = self.run_it(str(self.root / "mine"))
        self.assertRegex(calls[0], r"^build .*/mine -o .*/mine.dtr$")
        self.assertFalse(any("holdout" in call or "--like" in call for call in calls))
        self.assertTrue(any(call.startswith("evaluate") and "--leave-one-out" in call for call in calls))
        self.assertIn("no photo is held out", out)

    def test_it_says_what_it_does_in_six_steps_and_ends_with_view_and_page(self):
        out, calls = self.run_it()
        self.assertEqual([line[:3] for line in out.splitlines() if line[1:3] == "/6"], [f"{i}/6" for i in range(1, 7)])
        self.assertLess(len(out.splitlines()), 30)
        self.assertRegex(calls[-1], r"^export .*plaza.dtr --format web -o .*plaza.html --force$")
        self.assertRegex(out, r"dtr view .*plaza.dtr")

    def test_a_step_that_fails_shows_the_end_of_the_log(self):
        error, calls = self.run_it(code=1, fail="build")
        self.assertIn("dtr: too dark", error)
        self.assertRegex(error, r"quickstart: failed \(exit code 1\): .*dtr build .*; the whole log: .*/out/quickstart.log")
        self.assertEqual(len(calls), 1)


if __name__ == "__main__":
    unittest.main()
