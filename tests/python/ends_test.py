"""The end of the interpreter while threads work in the module: no crash, no hang, the script's exit code."""

import subprocess
import sys
import time
import unittest

from small_sets import WithSet, make_courtyard

# A script's last words are the time; what it still takes to end is measured from there. Work is given about
# a second to stop; the rest is for machines under load. Each job would take far longer or never end.
MAX_SECONDS = 15

HEAD = """
import os, sys, threading, time
import dtr
path, folder, photos = sys.argv[1:4]
started = threading.Semaphore(0)
loops = []

def work_in_background(job, threads=1):
    def loop():
        started.release()
        while True:
            job()
    for _ in range(threads):
        thread = threading.Thread(target=loop, daemon=True)
        thread.start()
        loops.append(thread)
    for _ in range(threads):
        started.acquire()

def end(seconds=0.3):
    time.sleep(seconds)
    if not all(thread.is_alive() for thread in loops):
        print("a thread ended by itself", file=sys.stderr)
    print(time.time(), flush=True)
"""

BUILD = """
calls = []
def build(**options):
    dtr.build(photos + "/images", folder + "/built%d.dtr" % threading.get_ident(), poses=photos + "/cameras.json",
              preset="best", force=True, **options)
"""


class Ends(WithSet):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.photos = cls.folder / "photos"
        make_courtyard(cls.photos, views=8, width=384, height=256)

    def ends(self, script, code=0, err=""):
        command = [sys.executable, "-c", HEAD + script, str(self.path), str(self.folder), str(self.photos)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        ended = time.time()
        self.assertRegex(done.stderr, f"^{err}$")
        self.assertEqual(done.returncode, code)
        last_words = max(float(line) for line in done.stdout.splitlines() if line[:1].isdigit())
        self.assertLess(ended - last_words, MAX_SECONDS)

    def test_while_it_builds(self):
        self.ends(BUILD + "work_in_background(build); end(1)")

    def test_while_it_builds_with_a_callback(self):
        self.ends(BUILD + "work_in_background(lambda: build(progress=lambda *what: calls.append(what)))\n"
                  "while len(calls) < 3: time.sleep(0.01)\n"
                  "end(0)")

    def test_while_a_callback_prints(self):
        # A thread that stopped inside of print() would keep the lock of sys.stdout.
        self.ends(BUILD + "def show(*what):\n"
                  "    calls.append(what)\n"
                  "    print(what[1:], flush=True)\n"
                  "work_in_background(lambda: build(progress=show))\n"
                  "while len(calls) < 3: time.sleep(0.01)\n"
                  "import atexit\n"
                  # One write, on a line of its own: a thread that ends at work leaves half a line.
                  "atexit.register(lambda: sys.stdout.write(f'\\n{time.time()}\\n'))")

    def test_while_a_callback_sleeps(self):
        self.ends(BUILD + "def sleep(*what):\n"
                  "    calls.append(what)\n"
                  "    time.sleep(5)\n"
                  "work_in_background(lambda: build(progress=sleep))\n"
                  "while not calls: time.sleep(0.01)\n"
                  "end(0)")

    def test_while_a_callback_computes(self):
        # Python takes its lock from such a thread every few milliseconds.
        self.ends(BUILD + "def compute(*what):\n"
                  "    calls.append(what)\n"
                  "    while True: sum(range(100))\n"
                  "work_in_background(lambda: build(progress=compute))\n"
                  "while not calls: time.sleep(0.01)\n"
                  "end(0)")

    def test_while_it_renders(self):
        for renderer in ("simd", "cpu"):
            with self.subTest(renderer):
                self.ends("s = dtr.load(path)\n"
                          f"work_in_background(lambda: s.render('0000', renderer='{renderer}'))\n"
                          "end()")

    def test_while_it_renders_an_image_that_takes_long(self):
        self.ends("s = dtr.load(path)\n"
                  "work_in_background(lambda: s.render('0000', renderer='cpu', size=(12000, 0), threads=1))\n"
                  "end()")

    def test_while_several_threads_render(self):
        self.ends("s = dtr.load(path)\n"
                  "work_in_background(lambda: s.render('0000', renderer='simd', memory=1 + time.time() % 1), 6)\n"
                  "end()")

    def test_while_pixels_are_read(self):
        for job in ("s.load_pixels(); s.drop_pixels()", "s.load_pixels(progress=lambda *what: None); s.drop_pixels()",
                    "[v.image for v in s.views]; s.drop_pixels()", "s.views[1].thumbnail()",
                    "s.views[1].depth; s.views[0].depth; s.views[1].completed_depth; s.drop_pixels()",
                    "s.unproject('0001', completed=True)", "dtr.load(path)"):
            with self.subTest(job):
                self.ends(f"s = dtr.load(path)\ndef job(): {job}\nwork_in_background(job, 3); end(0.2)")

    def test_while_other_jobs_run(self):
        for job in ("s.evaluate(leave_one_out=True)",
                    "s.export('ply', folder + '/%s.ply' % time.time())",
                    "s.export('web', folder + '/%s.html' % time.time(), progress=lambda *what: None)",
                    "dtr.from_arrays([v.image for v in s.views], [v.depth for v in s.views], s.views[0].K,"
                    " [v.cam_from_world for v in s.views]).save(folder + '/%s.dtr' % time.time())"):
            with self.subTest(job):
                self.ends(f"s = dtr.load(path)\ndef job(): {job}\nwork_in_background(job); end(0.5)")

    def test_its_exit_code_is_the_scripts(self):
        render = "s = dtr.load(path)\nwork_in_background(lambda: s.render('0000', renderer='cpu'))\nend(0.2)\n"
        self.ends(render + "sys.exit(7)", code=7)
        self.ends(render + "raise ValueError('of the script')", code=1, err=r"(.*\n)*ValueError: of the script\n")

    def test_threads_that_are_no_daemons_are_waited_for(self):
        self.ends("s = dtr.load(path)\n"
                  "def render():\n"
                  "    for _ in range(3): s.render('0000', renderer='cpu')\n"
                  "    print(time.time(), flush=True)\n"
                  "threading.Thread(target=render).start()")

    def test_functions_of_the_end_still_use_it(self):
        # `atexit` calls what was registered before dtr after dtr's own.
        script = HEAD.replace("import dtr\n", "import atexit\natexit.register(lambda: last())\nimport dtr\n", 1)
        command = [sys.executable, "-c", script +
                   "s = dtr.load(path)\n"
                   "told = []\n"
                   "def last():\n"
                   "    image = s.render('0000', renderer='simd').image\n"
                   "    s.load_pixels(progress=lambda *what: told.append(what))\n"
                   "    print(image.shape, len(told) > 0, flush=True)\n"
                   "work_in_background(lambda: s.render('0003', renderer='cpu'))\n"
                   "time.sleep(0.2)", str(self.path), str(self.folder), str(self.photos)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "(64, 96, 3) True\n", ""))

    def test_a_forked_child_ends(self):
        self.ends("child = os.fork()\n"
                  "if child == 0: sys.exit(5)\n"
                  "assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 5\n"
                  "end(0)")

    def test_a_forked_child_ends_without_the_parents_work(self):
        self.ends("s = dtr.load(path)\n"
                  "work_in_background(lambda: s.render('0000', renderer='cpu', size=(4000, 0)))\n"
                  "time.sleep(0.2)\n"
                  "child = os.fork()\n"
                  "if child == 0: sys.exit(5)\n"
                  "assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 5\n"
                  "end(0)")


if __name__ == "__main__":
    unittest.main()
