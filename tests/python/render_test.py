"""Rendered images: the bytes of `dtr render`, from several threads, without Python's lock."""

import json
import os
import shutil
import threading
import time
import unittest

import dtr
import numpy as np

from small_sets import WithSet, run_program


class Rendering(WithSet):
    def compare(self, frame, *words):
        run_program("render", self.path, *words, "--force", "-o", self.folder / "frame.png", "--depth-out",
                    self.folder / "depth.exr", "--coverage-out", self.folder / "coverage.png")
        # Written from the arrays by the same writers: equal pixels are equal files.
        dtr._core.write_image(self.folder / "ours.png", frame.image, rendered=True)
        dtr._core.write_depth(self.folder / "ours.exr", frame.depth, rendered=True)
        self.assertEqual((self.folder / "ours.png").read_bytes(), (self.folder / "frame.png").read_bytes())
        self.assertEqual((self.folder / "ours.exr").read_bytes(), (self.folder / "depth.exr").read_bytes())
        self.assertAlmostEqual(frame.coverage_share, (frame.coverage > 0).mean(), places=12)

    def test_is_dtr_render(self):
        s = dtr.load(self.path)
        self.compare(s.render("0000"), "--like", "0000")
        self.compare(s.render(s.views[2]), "--like", s.views[2].name)

    def test_every_renderer(self):
        s = dtr.load(self.path)
        for renderer in ("simd", "cpu"):
            self.compare(s.render("0000", renderer=renderer), "--like", "0000", "--renderer", renderer)

    def test_opengl_from_any_thread(self):
        s = dtr.load(self.path)
        try:
            here = s.render("0000", renderer="gl")
        except dtr.Error as error:
            self.skipTest(str(error))
        self.compare(here, "--like", "0000", "--renderer", "gl")
        there = []
        thread = threading.Thread(target=lambda: there.append(s.render("0000", renderer="gl")))
        thread.start()
        thread.join()
        np.testing.assert_array_equal(there[0].image, here.image)

    def test_options(self):
        s = dtr.load(self.path)
        self.compare(s.render("0003", 3, size=(64, 0), exclude=["0001", s.views[2]], measured_only=True,
                              smooth_edges=False, max_angle_deg=90, blend="cosine", exponent=4),
                     "--like", "0003", "--views", 3, "--size", "64x0", "--exclude", "0001,0002",
                     "--measured-only", "--smooth-edges=false", "--max-angle", 90, "--blend", "cosine",
                     "--exponent", 4)
        self.compare(s.render("0003", renderer="cpu", primitive="splat"),
                     "--like", "0003", "--renderer", "cpu", "--primitive", "splat")

    def test_paths(self):
        s = dtr.load(self.path)
        run_program("render", self.path, "--fly-through", 3, "--size", "48x0", "-o", self.folder / "path")
        for i, camera in enumerate(s.fly_through(3, size="48x0")):
            dtr._core.write_image(self.folder / "ours.png", s.render(camera).image, rendered=True)
            self.assertEqual((self.folder / "ours.png").read_bytes(),
                             (self.folder / "path" / f"{i:06}.png").read_bytes())
        cameras = s.cameras(self.courtyard / "cameras.json")
        self.assertEqual(len(cameras), 6)
        self.compare(s.render(cameras[3]), "--like", "0003")

    def test_a_camera_of_matrices(self):
        s = dtr.load(self.path)
        view = s.views[0]
        camera = dtr.Camera(view.K, view.cam_from_world, *view.size)
        np.testing.assert_allclose(camera.cam_from_world, view.cam_from_world, atol=1e-15)
        # Its quaternion may be another by an ulp.
        same = (s.render(camera).image == s.render(view).image).mean()
        self.assertGreater(same, 0.99)
        self.assertEqual(camera.resized(24, 0).size, (24, 16))

    def test_what_else_is_told(self):
        frame = dtr.load(self.path).render("0000")
        self.assertEqual(frame.view_count.dtype, np.uint8)
        self.assertEqual(set(frame.views_used), {v for v in frame.views_used if v.startswith("000")})
        self.assertNotIn("0000.jpg", frame.views_used)  # held out
        self.assertEqual(frame.skipped, [])
        frame.image[0] = 7  # its owner may change it

    def test_a_view_that_cannot_be_read_is_listed(self):
        broken = self.folder / "broken.dtr"
        shutil.copytree(self.path, broken)
        depth = next((broken / "depth").glob("0001*"))
        data = depth.read_bytes()
        depth.write_bytes(b"\0" * len(data))
        frame = dtr.load(broken).render("0000")
        self.assertEqual([name for name, _ in frame.skipped], ["0001.jpg"])

    def test_two_threads_draw_at_once(self):
        s = dtr.load(self.path)
        wanted = {name: s.render(name, renderer="simd").image for name in ("0000", "0003", "0004")}
        wrong = []

        def draw(name):
            for _ in range(5):
                if not np.array_equal(s.render(name, renderer="simd").image, wanted[name]):
                    wrong.append(name)

        threads = [threading.Thread(target=draw, args=(name,)) for name in wanted]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])

    def test_other_threads_go_on(self):
        s = dtr.load(self.path)
        s.render("0000", renderer="cpu")
        ticks, done = [], threading.Event()

        def tick():
            while not done.is_set():
                ticks.append(time.monotonic())
                time.sleep(0.001)

        thread = threading.Thread(target=tick)
        thread.start()
        start = time.monotonic()
        s.render("0000", renderer="cpu", size=(480, 0), threads=1)
        end = time.monotonic()
        done.set()
        thread.join()
        self.assertGreater(end - start, 0.05, "the image is drawn too fast for this test")
        # With the lock held there would be one at either end.
        self.assertGreater(sum(start < t < end for t in ticks), 5)

    def test_after_fork(self):
        s = dtr.load(self.path)
        wanted = s.render("0000", renderer="simd").image
        child = os.fork()
        if child == 0:
            try:
                same = np.array_equal(s.render("0000", renderer="simd").image, wanted)
                os._exit(0 if same else 1)
            finally:
                os._exit(2)
        for _ in range(600):
            pid, status = os.waitpid(child, os.WNOHANG)
            if pid:
                break
            time.sleep(0.05)
        else:
            os.kill(child, 9)
            os.waitpid(child, 0)
            self.fail("the child hangs")
        self.assertEqual(os.waitstatus_to_exitcode(status), 0)


class Jobs(WithSet):
    def test_evaluate_is_the_commands_json(self):
        ours = dtr.load(self.path).evaluate()
        theirs = json.loads(run_program("evaluate", self.path, "--json", "-"))
        for side in (ours, theirs):
            for view in [*side["views"], side["mean"]]:
                del view["render_ms"]
        self.assertEqual(ours, theirs)
        self.assertGreater(ours["mean"]["psnr_db"], 15)

    def test_export(self):
        told = []
        s = dtr.load(self.path)
        report = s.export("ply", self.folder / "ours.ply", min_views=3, progress=lambda *what: told.append(what))
        run_program("export", self.path, "--format", "ply", "--min-views", 3, "-o", self.folder / "theirs.ply")
        self.assertEqual((self.folder / "ours.ply").read_bytes(), (self.folder / "theirs.ply").read_bytes())
        self.assertGreater(report["points"], 100)
        self.assertTrue(told)
        self.assertTrue(all(isinstance(stage, str) and 0 <= done for stage, done, total in told))

    def test_any_command(self):
        target = self.folder / "pruned"
        dtr.run("dataset", "make", "sphere", output=target, views=3, width=32, height=24)
        self.assertEqual(len(list((target / "images").iterdir())), 3)
        self.assertEqual(dtr.run("info", self.path)["unit"], dtr.load(self.path).unit)

    def test_notes_go_to_the_logger(self):
        with self.assertLogs("dtr", level="INFO") as logged:
            dtr.load(self.path).render("0000")
        self.assertTrue(any("renderer:" in line for line in logged.output), logged.output)


if __name__ == "__main__":
    unittest.main()
