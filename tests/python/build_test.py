"""Builds: photos to a set, Ctrl-C, and the depth's standard deviations."""

import os
import signal
import subprocess
import sys
import unittest

import dtr
import numpy as np

from small_sets import WithSet, make_courtyard

# Says each stage; the test interrupts it in the middle.
SCRIPT = """
import sys, dtr
try:
    s = dtr.build(sys.argv[1], sys.argv[2], poses=sys.argv[3], preset="fast", completion=False,
                  progress=lambda stage, done, total: print(stage, done, total, flush=True))
    print("finished", s, flush=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
    sys.exit(130)
"""


class Build(WithSet):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.photos = cls.folder / "photos"
        make_courtyard(cls.photos, views=6, width=144, height=96)

    def build(self, output, **options):
        return dtr.build(self.photos / "images", output, poses=self.photos / "cameras.json", preset="fast",
                         completion=False, **options)

    def test_gives_a_set_with_its_report(self):
        told = []
        s = self.build(self.folder / "built.dtr", holdout="every:4",
                       progress=lambda *what: told.append(what))
        self.assertEqual([v.role for v in s.views].count("held_out"), 2)
        self.assertEqual(s.build_report["not_registered"], [])
        self.assertTrue(s.build_report["stages"])
        self.assertIsNone(dtr.load(self.folder / "built.dtr").build_report)
        stages = [stage for stage, _, _ in told]
        self.assertGreater(len(set(stages)), 3)
        for stage, done, total in told:
            self.assertTrue(0 <= done and (total == 0 or done <= total), (stage, done, total))
        self.check_sigma(s)
        self.check_validation(s)

    def check_sigma(self, s):
        """Standard deviations are of 1/z, and mean what they say of true depth."""
        view = s.views[1]
        self.assertEqual((view.sigma.shape, view.sigma.dtype), (view.depth.shape, np.float32))
        self.assertEqual(view.sigma.ctypes.data, view._address("sigma"))
        cloud = s.unproject(view)
        x, y = cloud.pixels.T
        z = view.depth[y, x].astype(np.float64)
        rays = np.linalg.norm(cloud.points + view.cam_from_world[:3, :3].T @ view.cam_from_world[:3, 3], axis=1)
        np.testing.assert_allclose(cloud.sigma, z * z * view.sigma[y, x] * (rays / z), rtol=1e-6)
        self.assertTrue((cloud.sigma > 0).all())

    def check_validation(self, s):
        report = s.validate()
        self.assertEqual({"passed", "tests"} - set(report), set())
        strict = s.validate(max_rms=1e-9)  # a failed test is a result
        self.assertFalse(strict["passed"])
        self.assertTrue(any(not test["passed"] for test in strict["tests"]))

    def test_ctrl_c_ends_it_and_the_same_call_goes_on(self):
        output = self.folder / "interrupted.dtr"
        command = [sys.executable, "-c", SCRIPT, self.photos / "images", output, self.photos / "cameras.json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
            lines = []
            for line in child.stdout:
                lines.append(line)
                if line.startswith("depth") or len(lines) > 8:
                    child.send_signal(signal.SIGINT)
                    break
            out, err = child.communicate(timeout=120)
        self.assertEqual(child.returncode, 130, err)
        self.assertTrue(out.endswith("interrupted\n"), out)
        self.assertEqual(err, "")
        self.assertFalse(output.exists())
        self.assertTrue(output.with_name("interrupted.dtr.partial").exists())
        s = self.build(output)
        self.assertEqual(len(s.views), 6)
        self.assertFalse(output.with_name("interrupted.dtr.partial").exists())
        # As if nobody had interrupted it.
        undisturbed = self.build(self.folder / "undisturbed.dtr")
        for a, b in zip(s.views, undisturbed.views):
            np.testing.assert_array_equal(a.image, b.image)
            np.testing.assert_array_equal(a.depth, b.depth)

    def test_errors_come_before_any_work(self):
        with self.assertRaisesRegex(dtr.Error, "nothing"):
            dtr.build(self.folder / "nothing", self.folder / "never.dtr")
        with self.assertRaisesRegex(dtr.UsageError, "`preset`.*perfect"):
            dtr.build(self.photos / "images", self.folder / "never.dtr", preset="perfect")
        with self.assertRaisesRegex(dtr.UsageError, "pass `force` to replace it"):
            self.build(self.path)
        self.assertEqual([f for f in os.listdir(self.folder) if f.startswith("never")], [])


if __name__ == "__main__":
    unittest.main()
