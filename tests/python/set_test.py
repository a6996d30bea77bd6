"""Sets in memory: what views hold, without copies, read-only, and for how long."""

import gc
import json
import threading
import unittest
import weakref

import dtr
import numpy as np

from small_sets import WithSet, import_courtyard, run_program

PLANES = ("image", "depth")


class Description(WithSet):
    def test_says_what_set_json_says(self):
        s = dtr.load(self.path)
        said = json.loads((self.path / "set.json").read_text())
        self.assertEqual(s.unit, said["unit"])
        self.assertEqual(s.world_origin.tolist(), said["world_origin"])
        self.assertEqual([v.name for v in s.views], [v["name"] for v in said["frames"][0]["views"]])
        self.assertEqual({v.role for v in s.views}, {"source", "held_out"})
        self.assertEqual(s.validation, said["verdict"])
        self.assertEqual(len(s.time_steps), 1)
        self.assertEqual(s.info["views"], json.loads(run_program("info", self.path, "--json", "-"))["views"])

    def test_cameras_are_those_of_the_data_set(self):
        s = dtr.load(self.path)
        given = {c["name"]: c for c in json.loads((self.courtyard / "cameras.json").read_text())["views"]}
        for view in s.views:
            camera = given[view.name]
            self.assertEqual(view.K.tolist(), [[camera["fx"], 0, camera["cx"]],
                                               [0, camera["fy"], camera["cy"]], [0, 0, 1]])
            pose = np.reshape(camera["cam_from_world"], (4, 4))
            pose[:3, 3] += pose[:3, :3] @ s.world_origin
            np.testing.assert_allclose(view.cam_from_world, pose, atol=1e-12)
            self.assertEqual(view.size, (camera["width"], camera["height"]))

    def test_views_by_name(self):
        s = dtr.load(self.path)
        name = s.views[2].name
        self.assertEqual(s.view(name), s.views[2])
        self.assertNotEqual(s.view(name), dtr.load(self.path).view(name))  # of another set
        self.assertNotEqual(s.views[1], s.views[2])
        self.assertEqual(len(set(s.views) | {s.view(name)}), 6)
        self.assertEqual(s.view(name.rsplit(".", 1)[0]).name, name)


class Arrays(WithSet):
    def test_have_the_memory_of_the_set(self):
        s = dtr.load(self.path)
        view = s.view("0001")
        for plane in PLANES + ("completed_depth",):
            array = getattr(view, plane)
            self.assertEqual(array.ctypes.data, view._address(plane), plane)
            # Another object for the same view gives the same memory.
            again = getattr(s.views[1], plane)
            self.assertEqual(array.ctypes.data, again.ctypes.data, plane)
            self.assertTrue(array.flags.c_contiguous)

    def test_shapes_and_types(self):
        view = dtr.load(self.path).view("0001")
        width, height = view.size
        self.assertEqual((view.image.shape, view.image.dtype), ((height, width, 3), np.uint8))
        self.assertEqual((view.depth.shape, view.depth.dtype), ((height, width), np.float32))
        self.assertEqual(view.completed_depth.dtype, np.float32)
        self.assertIsNone(view.mask)
        self.assertIsNone(view.sigma)

    def test_measured_depth_is_the_same_in_any_order(self):
        a, b = dtr.load(self.path), dtr.load(self.path)
        first = a.views[1].depth, a.views[1].completed_depth
        second = b.views[1].completed_depth, b.views[1].depth
        np.testing.assert_array_equal(first[0], second[1])
        np.testing.assert_array_equal(first[1], second[0])
        self.assertEqual(b.views[1].depth.ctypes.data, b.views[1]._address("depth"))

    def test_cannot_be_written(self):
        view = dtr.load(self.path).view("0001")
        for array in (view.image, view.depth, view.K, view.cam_from_world):
            with self.assertRaises(ValueError):
                array[0] = 1
        for array in (view.image, view.depth):
            with self.assertRaises(ValueError):
                array.flags.writeable = True

    def test_depth_is_the_true_one_and_image_the_files(self):
        s = dtr.load(self.path)
        measured, completed = s.view("0001").depth, s.view("0001").completed_depth
        self.assertGreater((measured > 0).mean(), 0.5)
        self.assertFalse(((measured > 0) & (completed > 0)).any())
        # Written by another path: the export of depth as .npy.
        run_program("export", self.path, "--format", "depth", "--depth-format", "npy",
                    "-o", self.folder / "exported")
        found = list((self.folder / "exported").rglob("0001*.npy"))
        exported = np.load([f for f in found if "sigma" not in str(f)][0])
        # The export takes each depth through 1/z in float, which costs an ulp.
        np.testing.assert_allclose(measured, exported, rtol=2e-7)

    def test_held_out_views_have_nothing_but_holes(self):
        held_out = [v for v in dtr.load(self.path).views if v.role == "held_out"]
        self.assertEqual(len(held_out), 2)
        depth = held_out[0].depth
        self.assertEqual(depth.shape, held_out[0].image.shape[:2])
        self.assertEqual(depth.dtype, np.float32)
        self.assertFalse(depth.any())
        self.assertFalse(depth.flags.writeable)
        self.assertIsNone(held_out[0].completed_depth)

    def test_outlive_the_set(self):
        s = dtr.load(self.path)
        image, depth = s.views[1].image, s.views[1].depth
        copies = image.copy(), depth.copy()
        gone = weakref.ref(s)
        del s
        gc.collect()
        self.assertIsNone(gone())
        others = [dtr.load(self.path).views[2].image for _ in range(20)]  # would take freed memory
        np.testing.assert_array_equal(image, copies[0])
        np.testing.assert_array_equal(depth, copies[1])
        self.assertEqual(len(others), 20)

    def test_views_keep_the_set(self):
        view = dtr.load(self.path).views[1]
        gc.collect()
        self.assertEqual(view.image.shape[2], 3)

    def test_dropped_pixels_are_read_again(self):
        s = dtr.load(self.path)
        before = s.views[1].image
        s.drop_pixels()
        after = s.views[1].image
        self.assertNotEqual(before.ctypes.data, after.ctypes.data)
        np.testing.assert_array_equal(before, after)

    def test_all_at_once_is_the_same(self):
        lazy, loaded = dtr.load(self.path), dtr.load(self.path)
        told = []
        loaded.load_pixels(progress=lambda *what: told.append(what))
        self.assertEqual(told[-1][1:], (6, 6))
        for a, b in zip(lazy.views, loaded.views):
            np.testing.assert_array_equal(a.image, b.image)
            if a.depth is not None:
                np.testing.assert_array_equal(a.depth, b.depth)

    def test_many_threads_read_once(self):
        s = dtr.load(self.path)
        addresses, ready = [], threading.Barrier(8)

        def read():
            ready.wait()
            addresses.append(s.views[1].image.ctypes.data)

        threads = [threading.Thread(target=read) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(addresses), 8)
        self.assertEqual(len(set(addresses)), 1)


class Unprojection(WithSet):
    def test_points_project_to_their_pixels(self):
        s = dtr.load(self.path)
        view = s.view("0001")
        cloud = s.unproject(view)
        self.assertEqual(len(cloud), (view.depth > 0).sum())
        in_cam = cloud.points @ view.cam_from_world[:3, :3].T + view.cam_from_world[:3, 3]
        projected = in_cam @ view.depth_K.T
        np.testing.assert_allclose(projected[:, :2] / projected[:, 2:], cloud.pixels + 0.5, atol=1e-6)
        x, y = cloud.pixels.T
        np.testing.assert_allclose(in_cam[:, 2], view.depth[y, x], rtol=1e-12)
        np.testing.assert_array_equal(cloud.colours, view.image[y, x])
        centre = -view.cam_from_world[:3, :3].T @ view.cam_from_world[:3, 3]
        rays = cloud.points - centre
        rays /= np.linalg.norm(rays, axis=1)[:, None]
        np.testing.assert_allclose(cloud.directions, rays, atol=1e-9)
        self.assertTrue(np.isnan(cloud.sigma).all())  # of exact depth nothing is stated
        self.assertFalse(cloud.completed.any())

    def test_completed_points_are_marked(self):
        s = dtr.load(self.path)
        depths = [None if v.depth is None else v.depth.copy() for v in s.views]
        depths[1][20:40, 30:60] = 0
        s = dtr.from_arrays([v.image for v in s.views], depths, [v.K for v in s.views],
                            [v.cam_from_world for v in s.views]).save(self.folder / "holes.dtr")
        view = s.view("0001")
        cloud = s.unproject("0001", completed=True)
        self.assertEqual(cloud.completed.sum(), (view.completed_depth > 0).sum())
        self.assertGreater(cloud.completed.sum(), 0)

    def test_a_view_without_depth_is_an_error(self):
        s = dtr.load(self.path)
        with self.assertRaisesRegex(dtr.Error, "held-out views have no depth"):
            s.unproject("0000")

    def test_smaller_depth_maps(self):
        images = [np.full((32, 48, 3), 50 * i, np.uint8) for i in range(3)]
        depths = [np.full((16, 24), 5, np.float32) for _ in range(3)]
        K = np.array([[40, 0, 24], [0, 40, 16], [0, 0, 1.0]])
        poses = np.stack([np.eye(4)] * 3)
        poses[:, 0, 3] = [0, -0.5, -1]
        s = dtr.from_arrays(images, depths, K, poses).save(self.folder / "half.dtr", completion=False)
        view = s.views[1]
        self.assertEqual(view.depth.shape, (16, 24))
        np.testing.assert_allclose(view.depth_K, [[20, 0, 12], [0, 20, 8], [0, 0, 1]])
        cloud = s.unproject(view)
        self.assertEqual(len(cloud), 16 * 24)
        np.testing.assert_allclose(cloud.points[0], [0.5 + 5 * (0.5 - 12) / 20, 5 * (0.5 - 8) / 20, 5], rtol=1e-4)


class Notebook(WithSet):
    def test_contact_sheet_names_every_view(self):
        text = dtr.load(self.path)._repr_html_()
        for view in dtr.load(self.path).views:
            self.assertIn(view.name, text)
        self.assertEqual(text.count("data:image/jpeg;base64,"), 6)
        self.assertIn("4 views, 2 held out", text)

    def test_hostile_names_end_no_element(self):
        import_courtyard(self.courtyard, self.folder / "hostile&<b>.dtr")
        text = dtr.load(self.folder / "hostile&<b>.dtr")._repr_html_()
        self.assertIn("hostile&amp;&lt;b&gt;", text)
        self.assertNotIn("hostile&<b>", text)

    def test_page_is_the_export_in_a_frame(self):
        page = dtr.load(self.path).page(height=321, evaluate=False)
        frame = page._repr_html_()
        self.assertTrue(frame.startswith('<iframe srcdoc="'))
        self.assertIn('height="321"', frame)
        self.assertIn("&lt;canvas", frame)
        with open(page.path) as file:
            written = file.read()
        run_program("export", self.path, "--format", "web", "--no-evaluate", "-o", self.folder / "page.html")
        self.assertEqual(written, (self.folder / "page.html").read_text())


if __name__ == "__main__":
    unittest.main()
