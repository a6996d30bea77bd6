"""Memory comes back: loads and renders, and what is dropped. DTR_LOADS: how many, default 60."""

import ctypes
import gc
import os
import unittest

import dtr
import numpy as np

from arrays_test import wall
from small_sets import WithSet

LOADS = int(os.environ.get("DTR_LOADS", "60"))
WARM_UP = 20  # until threads and libraries have what they keep
# A set of this test has 0.2 MB of pixels and its renderer as much again: one that is lost in a
# hundred would show. 60 and 1000 loads left 0.0 to 0.1 MB.
SLACK_MB = 0.5
# What the system's allocator keeps of its arenas varies from run to run.
RESIDENT_SLACK_MB = 12


class MallInfo(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in (
        "arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks", "uordblks", "fordblks",
        "keepcost")]


def in_use_mb():
    """What was allocated and not freed, by the allocator's own count (mallinfo2 of glibc 2.33)."""
    function = ctypes.CDLL(None).mallinfo2
    function.restype = MallInfo
    gc.collect()
    found = function()
    return (found.uordblks + found.hblkhd) / 1e6


def resident_mb():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


class Memory(WithSet):
    def setUp(self):
        if not hasattr(ctypes.CDLL(None), "mallinfo2"):
            self.skipTest("the C library has no mallinfo2")
        if "asan" in os.environ.get("LD_PRELOAD", ""):
            self.skipTest("the sanitizer has an allocator of its own, which keeps what was freed")

    def grows_by(self, work):
        """MB in use and resident after LOADS times `work`, less those before."""
        for _ in range(WARM_UP):
            work()
        in_use, resident = in_use_mb(), resident_mb()
        for _ in range(LOADS):
            work()
        grown = in_use_mb() - in_use, resident_mb() - resident
        print(f"{LOADS} times: {grown[0]:+.2f} MB in use, {grown[1]:+.1f} MB resident", flush=True)
        return grown

    def returns(self, work):
        in_use, resident = self.grows_by(work)
        self.assertLess(in_use, SLACK_MB)
        self.assertLess(resident, RESIDENT_SLACK_MB)

    def test_of_loads_and_renders(self):
        def work():
            s = dtr.load(self.path)
            s.load_pixels()
            self.assertEqual(s.views[0].image.ndim, 3)
            s.render("0000", renderer="simd")
            s.unproject("0001")

        self.returns(work)

    def test_of_errors(self):
        s = dtr.load(self.path)

        def work():
            for call in (lambda: s.render("0000", exclude="nobody"), lambda: s.unproject("0000"),
                         lambda: dtr.load(self.folder / "nothing.dtr")):
                with self.assertRaises(Exception):
                    call()

        self.returns(work)

    def test_a_leak_would_show(self):
        kept = []
        in_use, _ = self.grows_by(lambda: kept.append(dtr.load(self.path).views[1].image))
        self.assertGreater(in_use, SLACK_MB)

    def test_pixels_are_freed_with_the_set_but_for_those_in_use(self):
        made = dtr.from_arrays(*wall(3, 1200, 800))
        made.save(self.folder / "large.dtr", completion=False)
        before = in_use_mb()
        s = dtr.load(self.folder / "large.dtr")
        s.load_pixels()
        pixels_mb = 3 * 1200 * 800 * (3 + 4) / 1e6
        # No second copy anywhere.
        self.assertAlmostEqual(in_use_mb() - before, pixels_mb, delta=0.05 * pixels_mb)
        one = s.views[0].image
        del s
        self.assertAlmostEqual(in_use_mb() - before, one.nbytes / 1e6, delta=0.05 * pixels_mb)
        self.assertEqual(one.dtype, np.uint8)


if __name__ == "__main__":
    unittest.main()
