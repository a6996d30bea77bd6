"""Sets out of arrays: what comes back, and what is rejected."""

import unittest

import dtr
import numpy as np

from small_sets import WithSet


def wall(views=3, width=48, height=32, z=4.0):
    """Photos of a textured wall by cameras side by side."""
    K = np.array([[40.0, 0, width / 2], [0, 40, height / 2], [0, 0, 1]])
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    images, depths, poses = [], [], []
    for i in range(views):
        centre = 0.4 * i
        u = (x - K[0, 2]) / K[0, 0] * z + centre
        v = (y - K[1, 2]) / K[1, 1] * z
        grey = 120 + 60 * np.sin(5 * u) + 50 * np.cos(7 * v)
        images.append(np.stack([grey, 255 - grey, 0.5 * grey], -1).astype(np.uint8))
        depths.append(np.full((height, width), z, np.float32))
        pose = np.eye(4)
        pose[0, 3] = -centre
        poses.append(pose)
    return images, depths, K, np.stack(poses)


class RoundTrip(WithSet):
    def test_comes_back(self):
        images, depths, K, poses = wall()
        depths[1][3:9, 5:20] = 0
        made = dtr.from_arrays(images, depths, K, poses, unit="metre", names=["a", "b", "c"])
        self.assertEqual(len(made), 3)
        s = made.save(self.folder / "wall.dtr", completion=False)
        self.assertEqual((s.unit, [v.name for v in s.views]), ("metre", ["a.png", "b.png", "c.png"]))
        for i, view in enumerate(s.views):
            np.testing.assert_array_equal(view.image, images[i])
            np.testing.assert_allclose(view.depth, depths[i], rtol=1e-4)
            np.testing.assert_array_equal(view.depth == 0, depths[i] == 0)
            np.testing.assert_array_equal(view.K, K)
            np.testing.assert_allclose(view.cam_from_world, poses[i], atol=1e-12)

    def test_a_set_that_was_loaded_can_be_saved_again(self):
        s = dtr.load(self.path)
        views = s.views
        again = dtr.from_arrays([v.image for v in views], [v.depth for v in views],
                                [v.K for v in views], [v.cam_from_world for v in views],
                                world_origin=s.world_origin, unit=s.unit).save(self.folder / "again.dtr")
        for a, b in zip(views, again.views):
            self.assertEqual(a.role, b.role)
            np.testing.assert_array_equal(a.image, b.image)
            np.testing.assert_allclose(a.depth, b.depth, rtol=1e-4)

    def test_options_of_import(self):
        told = []
        s = dtr.from_arrays(*wall(4)).save(self.folder / "held.dtr", holdout="every:2",
                                           progress=lambda *what: told.append(what))
        self.assertEqual([v.role for v in s.views], ["held_out", "source"] * 2)
        self.assertTrue(told)

    def test_views_without_depth_are_held_out(self):
        images, depths, K, poses = wall(4)
        depths[2] = None
        made = dtr.from_arrays(images, depths, K, poses)
        s = made.save(self.folder / "without.dtr")
        self.assertEqual([v.role for v in s.views], ["source", "source", "held_out", "source"])
        depths[2] = np.zeros_like(depths[1])  # as a held-out view of a set is read
        holes = dtr.from_arrays(images, depths, K, poses).save(self.folder / "holes.dtr")
        self.assertEqual([v.role for v in holes.views], [v.role for v in s.views])
        with self.assertRaisesRegex(dtr.UsageError, "`holdout`: views without depth, as 0002"):
            made.save(self.folder / "never.dtr", holdout="every:2")

    def test_an_existing_set_stays(self):
        target = self.folder / "there.dtr"
        made = dtr.from_arrays(*wall())
        made.save(target)
        with self.assertRaisesRegex(dtr.UsageError, "pass `force` to replace it"):
            made.save(target)
        made.save(target, force=True)

    def test_names_with_commas(self):
        images, depths, K, poses = wall(4)
        names = ["a,b", "c d", "é", "e"]
        made = dtr.from_arrays(images, depths, K, poses, names=names)
        s = made.save(self.folder / "commas.dtr", completion=False)
        self.assertEqual([v.name for v in s.views], [f"{name}.png" for name in names])
        depths[0] = None
        with self.assertRaisesRegex(dtr.UsageError, "`names`: expected no comma .*, found 'a,b'"):
            dtr.from_arrays(images, depths, K, poses, names=names).save(self.folder / "never.dtr")

    def test_what_the_import_rejects_names_no_temporary_file(self):
        images, depths, K, poses = wall()
        for wrong_K, wrong_poses, text in ((np.diag([1e9, 1e9, 1.0]), poses, r"from_arrays: views\[0\] \(0000\.png\)"),
                                           (K, poses * 1e-30 + np.eye(4), "from_arrays: its cameras")):
            wrong_poses[:, 3], wrong_poses[:, :3, :3] = np.eye(4)[3], np.eye(3)
            made = dtr.from_arrays(images, depths, wrong_K, wrong_poses)
            with self.assertRaisesRegex(dtr.Error, "^" + text) as caught:
                made.save(self.folder / "never.dtr")
            self.assertNotIn("/dtr-", str(caught.exception))

    def test_depth_of_any_scene(self):
        for scale in (1e-17, 1e-6, 1e6, 1e17):
            images, depths, K, poses = wall(z=scale)
            poses[:, 0, 3] *= scale
            s = dtr.from_arrays(images, depths, K, poses).save(self.folder / f"{scale}.dtr")
            np.testing.assert_allclose(s["0001"].depth, depths[1], rtol=1e-3)

    def test_poses_of_three_rows_and_integers(self):
        images, depths, K, poses = wall()
        made = dtr.from_arrays(np.stack(images), np.stack(depths).astype(np.float64), K.astype(int),
                               poses[:, :3])
        self.assertEqual(len(made), 3)


class Hostile(unittest.TestCase):
    def rejected(self, text, change, **options):
        """`change` spoils one of the arguments; nothing else is wrong with them."""
        arguments = dict(zip(("images", "depths", "K", "poses"), wall()))
        arguments.update(options)
        change(arguments)
        with self.assertRaises(dtr.UsageError) as caught:
            dtr.from_arrays(**arguments)
        self.assertIsInstance(caught.exception, ValueError)
        self.assertRegex(str(caught.exception), text)
        self.assertNotIn("\n", str(caught.exception))

    def test_images(self):
        def spoil(image):
            return lambda a: a["images"].__setitem__(1, image)

        self.rejected(r"`images` 1: expected shape \(height, width, 3\) of uint8", spoil(np.zeros((32, 48), np.uint8)))
        self.rejected("`images` 1: .*found .* of float64", spoil(np.zeros((32, 48, 3))))
        self.rejected("`images` 1", spoil(np.zeros((32, 48, 4), np.uint8)))
        self.rejected("`images` 1", spoil(np.zeros((0, 48, 3), np.uint8)))
        self.rejected("`images` 1", spoil(None))
        self.rejected("`images` 1", spoil("photo.jpg"))

    def test_depths(self):
        def spoil(depth):
            return lambda a: a["depths"].__setitem__(2, depth)

        bad = np.full((32, 48), 4, np.float32)
        for value in (np.nan, np.inf, -np.inf, -1, 1e-30, 1e300, 3e38):
            wrong = bad.astype(np.float64)
            wrong[7, 11] = value
            self.rejected(r"`depths` 2: expected depths from 1e-18 to 1e\+18, or 0 for a hole, .* at x 11, y 7", spoil(wrong))
        self.rejected("`depths` 2: .*a whole fraction", spoil(np.ones((31, 48), np.float32)))
        self.rejected("`depths` 2: .*a whole fraction", spoil(np.ones((64, 96), np.float32)))
        self.rejected("`depths` 2: .*found .* of int64", spoil(np.ones((32, 48), np.int64)))
        self.rejected("`depths` 2", spoil(np.ones((32, 48, 1), np.float32)))
        self.rejected("`depths`: expected one for each image", lambda a: a["depths"].pop())
        self.rejected("`depths`: expected one for each image", lambda a: a.update(images=[], depths=[]))

    def test_cameras(self):
        def k(row, column, value):
            return lambda a: a["K"].__setitem__((row, column), value)

        for row, column, value in ((0, 0, 0), (1, 1, -40), (0, 2, np.nan), (0, 1, 0.5), (2, 2, 2), (2, 0, 1)):
            self.rejected("view 0: Camera: `K`: expected", k(row, column, value))
        self.rejected("`K`: expected numbers of shape", lambda a: a.update(K=np.zeros((3, 4))))
        self.rejected("`K`: expected numbers of shape", lambda a: a.update(K="K"))
        self.rejected("`K`: expected one for each of 3", lambda a: a.update(K=np.stack([a["K"]] * 2)))

    def test_poses(self):
        def pose(i, row, column, value):
            return lambda a: a["poses"].__setitem__((i, row, column), value)

        self.rejected("view 1: Camera: `cam_from_world`", pose(1, 0, 0, 1.01))
        self.rejected("view 1: Camera: `cam_from_world`", pose(1, 0, 3, np.nan))
        self.rejected("view 1: Camera: `cam_from_world`", pose(1, 0, 0, -1))  # a mirror
        self.rejected("view 2: Camera: `cam_from_world`", pose(2, 3, 0, 1))
        self.rejected(r"view 1: Camera: `cam_from_world`: expected a camera within 1e\+18 units", pose(1, 0, 3, 1e300))
        self.rejected("`poses`: expected numbers", lambda a: a.update(poses=np.zeros((3, 3, 3))))

    def test_the_rest(self):
        self.rejected("`unit`: expected metre", lambda a: None, unit="feet")
        self.rejected("`names`: expected 3 different", lambda a: None, names=["a", "a", "b"])
        self.rejected("`names`: expected names of files", lambda a: None, names=["a", "../b", "c"])
        self.rejected("`names`: expected names of files", lambda a: None, names=["a", "", "c"])
        self.rejected("`world_origin`", lambda a: None, world_origin=[0, 0, np.inf])
        self.rejected("`world_origin`", lambda a: None, world_origin=[0, 0])
        for wrong in ("here", "123", ["1", "2", "3"], None, [0, 0, 1j], np.zeros((3, 3))):
            self.rejected("`world_origin`: expected 3 finite numbers, found", lambda a: None, world_origin=wrong)

    def test_names_that_no_line_may_hold(self):
        for wrong in ("a\nb", "a\x00b", "\x1b[31m", "a\u2028b", "\ud800", 7, None, b"a", "a" * 250):
            self.rejected("`names`: expected names of files, found", lambda a: None, names=["a", wrong, "c"])
        self.rejected("`names`: expected a list", lambda a: None, names="abc")

    def test_ragged_lists(self):
        self.rejected("`K`: expected an array, found lists of unequal lengths",
                      lambda a: a.update(K=[[40, 0, 24], [0, 40], [0, 0, 1]]))
        self.rejected("`poses`: expected an array, found lists", lambda a: a.update(poses=[np.eye(4), [[1]]]))
        self.rejected("`world_origin`: expected an array, found lists", lambda a: None, world_origin=[[1], 2, 3])
        self.rejected("`images` 1: expected an array, found lists",
                      lambda a: a["images"].__setitem__(1, [[[1, 2, 3]], [[1, 2]]]))
        self.rejected("`depths` 1: expected an array, found lists", lambda a: a["depths"].__setitem__(1, [[1.0], []]))

    def test_what_is_no_list(self):
        for name in ("images", "depths"):
            for wrong in (5, None, "text", np.float64(3), np.array(3)):
                self.rejected(f"`{name}`: expected a list with one for each view, found",
                              lambda a: a.update({name: wrong}))

    def test_cameras_alone(self):
        for size in ((0, 10), (10, -1), (1 << 20, 10)):
            with self.assertRaisesRegex(dtr.UsageError, "Camera: expected a size of 1 to"):
                dtr.Camera(np.eye(3), np.eye(4), *size)
        with self.assertRaises(TypeError):
            dtr.Camera(np.eye(4), np.eye(4), 10, 10)

    def test_files_need_arrays_of_their_type(self):
        with self.assertRaises(TypeError):
            dtr._core.write_image("/tmp/never.png", np.zeros((4, 4, 3)))
        with self.assertRaises(ValueError):
            dtr._core.write_image("/tmp/never.png", np.zeros((4, 4), np.uint8))
        with self.assertRaises(ValueError):
            dtr._core.write_depth("/tmp/never.exr", np.zeros((4,), np.float32))


if __name__ == "__main__":
    unittest.main()
