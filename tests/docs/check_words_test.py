"""Words to avoid are named in prose that a change adds, and nowhere else."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = Path(__file__).resolve().parents[2] / "scripts/check-words"

CPP = """#include "guess.h"
// What is drawn.
/* Returns the verdict
   anew. */
const char* kText = "cannot be told";  // Where it is read
const char* kKey = "verdict";
auto raw = R"(one
 verdict)";
int guess = 1'000'000;  // initial guess of a trust-region step, `guess`
/// Computes it.
/// Where it is absent, throws.
"""

PYTHON = '''"""Believed at once."""
text = "a verdict in a string"  # refused
"""
mended
"""
'''

SHELL = """#!/bin/sh
# Of two.
echo "# verdict" verdict $#  # Verdict
"""

MARKDOWN = """A verdict and `verdict`, [text](verdict.md) at https://example.org/verdict.
```
verdict
```
nobody asks
"""


class CheckWordsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)

    def run_it(self, *arguments, code):
        done = subprocess.run([sys.executable, PROGRAM, *arguments], cwd=self.root, capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr if code == 2 else [line.split(": write ")[0] for line in done.stdout.splitlines()]

    def found_in(self, name, text):
        (self.root / name).write_text(text)
        return [line.removeprefix(f"{name}:").split(": begin with")[0] for line in self.run_it(name, code=1)]

    def git(self, *arguments):
        subprocess.run(["git", "-c", "user.name=n", "-c", "user.email=e", *arguments], cwd=self.root, check=True, capture_output=True)

    def test_comments_and_messages_of_cpp_are_read_but_not_names(self):
        self.assertEqual(self.found_in("a.cpp", CPP), ["2: comment begins with What", "3: verdict", "4: anew", "5: told",
                                                       "5: comment begins with Where", "8: verdict"])

    def test_comments_of_scripts_and_prose_of_documents_are_read(self):
        self.assertEqual(self.found_in("a.py", PYTHON), ["1: Believed", "2: refused", "4: mended"])
        self.assertEqual(self.found_in("script", SHELL), ["2: comment begins with Of", "3: Verdict"])
        self.assertEqual(self.found_in("a.md", MARKDOWN), ["1: verdict", "5: nobody asks"])

    def test_only_lines_that_differ_from_the_commit_count(self):
        self.git("init", "-q")
        (self.root / "a.md").write_text("told\n\nend\n")
        (self.root / "gone.md").write_text("told\n")
        self.git("add", ".")
        self.git("commit", "-q", "-m", "first")
        self.assertEqual(self.run_it("--since", "HEAD", code=0), [])
        (self.root / "a.md").write_text("told\n++ anew\n\nend\ntells\n")
        (self.root / "gone.md").unlink()
        self.assertEqual(self.run_it("--since", "HEAD", code=1), ["a.md:2: anew", "a.md:5: tells"])

    def test_wrong_usage_ends_with_2(self):
        for arguments in ((), ("--since",), ("--since", "HEAD", "a.md"), ("--help",)):
            self.assertIn("usage: scripts/check-words", self.run_it(*arguments, code=2))


if __name__ == "__main__":
    unittest.main()
