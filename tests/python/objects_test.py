"""What objects of the package are besides their data: made by their classes alone, pickled, short to print, shown."""

import copy
import pickle
import struct
import subprocess
import sys
import unittest
import zlib

import dtr
import numpy as np
from dtr import _core

from small_sets import WithSet

CLASSES = [getattr(_core, name) for name in sorted(dir(_core))
           if isinstance(getattr(_core, name), type) and not issubclass(getattr(_core, name), Exception)]


class WithoutInit(unittest.TestCase):
    """Objects of __new__ alone have no value: every use of one is an exception."""

    def raises(self, use, what):
        with self.assertRaises((TypeError, AttributeError), msg=what) as caught:
            use()
        self.assertNotIn("\n", str(caught.exception))

    def test_classes_of_the_module(self):
        self.assertEqual([kind.__name__ for kind in CLASSES], ["Camera", "OpenSet", "RenderSettings", "View"])
        arguments = {"thumbnail": (8,), "resized": (8, 8), "index_of": ("0000", 0), "_unproject": (False,),
                     "_address": ("image",), "load_pixels": (["image"], 1, None, None), "camera_like": ("0000", 0),
                     "cameras_of_file": ("x.json", print), "fly_through": (3, "")}
        for kind in CLASSES:
            for name, member in sorted(vars(kind).items()):
                made = kind.__new__(kind)
                if isinstance(member, property):
                    self.raises(lambda: getattr(made, name), f"{kind.__name__}.{name}")
                    if member.fset is not None:
                        self.raises(lambda: setattr(made, name, 1), f"{kind.__name__}.{name} = 1")
                elif callable(member) and not name.startswith("__"):
                    if name == "render":
                        arguments[name] = (dtr.Camera(np.eye(3), np.eye(4), 8, 8), "{}", _core.RenderSettings(), None)
                    self.raises(lambda: getattr(made, name)(*arguments.get(name, ())), f"{kind.__name__}.{name}()")

    def test_special_methods(self):
        for kind in CLASSES:
            made = kind.__new__(kind)
            self.raises(lambda: pickle.dumps(made), kind)
            self.raises(lambda: copy.copy(made), kind)
        for kind in (dtr.View, dtr.Camera):
            self.raises(lambda: repr(kind.__new__(kind)), kind)
        self.raises(lambda: hash(dtr.View.__new__(dtr.View)), "hash")
        self.raises(lambda: dtr.View.__new__(dtr.View) == dtr.View.__new__(dtr.View), "==")
        with self.assertRaisesRegex(TypeError, "View: this object was never initialised; make it by its class"):
            dtr.View.__new__(dtr.View).image

    def test_other_ways_to_make_none(self):
        class Derived(dtr.View):
            pass

        self.raises(lambda: Derived.__new__(Derived).image, "a derived class")
        base = dtr.View.__mro__[1]
        self.raises(lambda: base.__new__(dtr.View).image, "the base's __new__")
        self.raises(lambda: object.__new__(dtr.View).image, "object's __new__")
        self.raises(dtr.View, "no constructor")

    def test_as_an_argument(self):
        camera, settings = dtr.Camera.__new__(dtr.Camera), _core.RenderSettings.__new__(_core.RenderSettings)
        self.raises(lambda: _core.OpenSet.render(_core.OpenSet.__new__(_core.OpenSet), camera, "{}", settings, None), "")
        self.raises(lambda: dtr.Set.unproject(None, dtr.View.__new__(dtr.View)), "unproject")

    def test_classes_of_python(self):
        for name in dtr.__all__:
            kind = getattr(dtr, name)
            if not isinstance(kind, type) or issubclass(kind, Exception) or kind in CLASSES or name == "Views":
                continue
            made = kind.__new__(kind)
            for member in dir(kind):
                if not member.startswith("__") and isinstance(getattr(kind, member), property):
                    self.raises(lambda: getattr(made, member), f"{name}.{member}")
            self.raises(lambda: repr(made) if kind.__repr__ is not object.__repr__ else len(made), name)


class Arguments(WithSet):
    def test_none_is_drawn_by_or_with_nothing(self):
        s = dtr.load(self.path)
        with self.assertRaisesRegex(TypeError, "Camera: this object was never initialised"):
            s.render(dtr.Camera.__new__(dtr.Camera))
        with self.assertRaisesRegex(TypeError, "View: this object was never initialised"):
            s.render("0000", exclude=[dtr.View.__new__(dtr.View)])


class Views(WithSet):
    def test_by_index_and_by_name(self):
        s = dtr.load(self.path)
        self.assertEqual((len(s), len(s.views)), (6, 6))
        for views in (s, s.views, s.time_steps[0].views):
            self.assertEqual(views["0003"].name, "0003.jpg")
            self.assertEqual(views["0003.jpg"], views[3])
            self.assertEqual(views[-1].name, "0005.jpg")
            self.assertEqual(views[np.int64(2)], views["0002"])
            self.assertEqual([v.name for v in views[1:3]], ["0001.jpg", "0002.jpg"])
            self.assertEqual([v.name for v in views], [f"000{i}.jpg" for i in range(6)])
            self.assertIn("0003", views)
            self.assertIn(views[3], views)
            self.assertNotIn("0006", views)
            self.assertNotIn(dtr.load(self.path)[3], views)
            with self.assertRaises(IndexError):
                views[6]
            with self.assertRaisesRegex(dtr.UsageError, "no view is named 'nobody'"):
                views["nobody"]
            with self.assertRaises(TypeError):
                views[1.0]
        self.assertIsInstance(s.views, tuple)

    def test_of_other_time_steps(self):
        moving = self.folder / "moving.dtr"
        dtr.run("join", self.path, self.path, output=moving)
        s = dtr.load(moving)
        self.assertEqual(len(s.time_steps), 2)
        second = s.time_steps[1].views["0003"]
        self.assertEqual(second, s.view("0003", time_step=1))
        self.assertNotEqual(second, s["0003"])

    def test_print_short(self):
        self.assertEqual(repr(dtr.load(self.path).views), "<dtr.Views 6: 0000.jpg, 0001.jpg, ..., 0005.jpg>")


class Pickling(WithSet):
    def again(self, value):
        copies = [pickle.loads(pickle.dumps(value, protocol)) for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1)]
        return copies[-1]

    def test_of_cameras_is_exact(self):
        s = dtr.load(self.path)
        for camera in [s["0003"].camera, *s.fly_through(3, size="48x0")]:
            again = self.again(camera)
            self.assertEqual((again.name, again.size), (camera.name, camera.size))
            np.testing.assert_array_equal(again.K, camera.K)
            np.testing.assert_array_equal(again.cam_from_world, camera.cam_from_world)
            np.testing.assert_array_equal(s.render(again).image, s.render(camera).image)
        self.assertEqual(copy.deepcopy(camera).K.tolist(), camera.K.tolist())

    def test_of_states_that_are_none(self):
        state = dtr.load(self.path)["0003"].camera.__getstate__()
        for i, wrong in ((1, 0), (3, -1.0), (3, float("nan")), (7, 9.0), (11, float("inf")), (4, "x")):
            spoiled = (*state[:i], wrong, *state[i + 1:])
            with self.assertRaises((ValueError, RuntimeError, TypeError)):
                dtr.Camera.__new__(dtr.Camera).__setstate__(spoiled)
        with self.assertRaisesRegex(ValueError, "not the state of a camera"):
            dtr.Camera.__new__(dtr.Camera).__setstate__(state[:5])

    def test_of_frames_and_points(self):
        s = dtr.load(self.path)
        for value in (s.render("0000"), s.unproject("0001")):
            again = self.again(value)
            self.assertIs(type(again), type(value))
            for name, part in vars(value).items():
                if isinstance(part, np.ndarray):
                    np.testing.assert_array_equal(getattr(again, name), part)
                    self.assertEqual(getattr(again, name).dtype, part.dtype)
            self.assertEqual(repr(again), repr(value))

    def test_of_arrays(self):
        s = dtr.load(self.path)
        sources = [v for v in s if v.role == "source"]
        made = dtr.from_arrays([v.image for v in sources], [v.depth for v in sources], sources[0].K,
                               [v.cam_from_world for v in sources])
        saved = [m.save(self.folder / f"{i}.dtr", completion=False) for i, m in enumerate((made, self.again(made)))]
        for a, b in zip(*saved):
            np.testing.assert_array_equal(a.depth, b.depth)

    def test_of_a_page_that_keeps_its_file(self):
        page = dtr.load(self.path).page(self.folder / "kept.html", height=321, evaluate=False)
        self.assertEqual(self.again(page)._repr_html_(), page._repr_html_())

    def test_in_other_processes(self):
        script = ("import pickle, sys\n"
                  "frame = pickle.load(sys.stdin.buffer)\n"
                  "print(frame)")
        frame = dtr.load(self.path).render("0000")
        done = subprocess.run([sys.executable, "-c", script], input=pickle.dumps(frame), capture_output=True)
        self.assertEqual(done.stdout.decode().strip(), repr(frame), done.stderr)

    def test_of_what_is_part_of_an_open_set_says_what_to_do(self):
        s = dtr.load(self.path)
        for value, text in ((s, "Set: .*pass its `path`, and dtr.load it there"),
                            (s[0], r"View: .*cannot be pickled; pass the set's `path` and the view's `name`"),
                            (s.views, "View: "), (s.time_steps[0], "View: "),
                            (s.page(evaluate=False), r"Page: .*make it by page\(path\)")):
            with self.assertRaisesRegex(TypeError, text) as caught:
                pickle.dumps(value)
            self.assertNotIn("\n", str(caught.exception))


def pixels_of(png):
    """Size and pixels of a PNG of 8-bit RGB, by its specification."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    at, data = 8, b""
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at : at + 8])
        body = png[at + 8 : at + 8 + size]
        assert zlib.crc32(kind + body) == struct.unpack(">I", png[at + 8 + size : at + 12 + size])[0]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", body[:10])
            assert (bits, colour) == (8, 2)
        data += body if kind == b"IDAT" else b""
        at += 12 + size
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + 3 * width).astype(int)
    image = np.zeros((height + 1, 3 * (width + 1)), int)  # with a border, for the filters
    for y, (kind, *row) in enumerate(rows, 1):
        above = image[y - 1]
        for x, value in enumerate(row, 3):
            a, b, c = image[y][x - 3], above[x], above[x - 3]
            paeth = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            image[y][x] = (value + (0, a, b, (a + b) // 2, paeth)[kind]) % 256
    return image[1:, 3:].reshape(height, width, 3)


class Shown(WithSet):
    def test_print_short(self):
        s = dtr.load(self.path)
        frame = s.render("0000")
        self.assertRegex(repr(frame), r"^<dtr\.Frame 0000, 96x64 of \d views, \d+\.\d % seen>$")
        self.assertRegex(repr(s.unproject("0001")), r"^<dtr\.Points \d+>$")
        cloud = s.unproject("0001", completed=True)
        count = f", {cloud.completed.sum()} of them completed" if cloud.completed.any() else ""
        self.assertEqual(repr(cloud), f"<dtr.Points {len(cloud)}{count}>")

    def test_sigma_of_points_is_named(self):
        cloud = dtr.load(self.path).unproject("0001")
        cloud.sigma[:] = 0.25
        cloud.completed[:7] = True
        self.assertEqual(repr(cloud), f"<dtr.Points {len(cloud)}, 7 of them completed, median sigma 0.25>")

    def test_notebooks_show_frames_and_views(self):
        s = dtr.load(self.path)
        frame = s.render("0000")
        np.testing.assert_array_equal(pixels_of(frame._repr_png_()), frame.image)
        np.testing.assert_array_equal(pixels_of(s["0003"]._repr_png_()), s["0003"].image)

    def test_large_images_are_shown_smaller(self):
        large = dtr.load(self.path).render("0000", renderer="simd", size=(1500, 0))
        png = large._repr_png_()
        self.assertEqual(struct.unpack(">II", png[16:24]), (1024, 683))

    def test_frames_are_compared_as_objects(self):
        s = dtr.load(self.path)
        frame, points = s.render("0000"), s.unproject("0001")
        self.assertTrue(frame == frame and points == points)
        self.assertFalse(frame == s.render("0000") or points == s.unproject("0001"))
        self.assertEqual(len({frame, points}), 2)


if __name__ == "__main__":
    unittest.main()
