"""read_nerfstudio.py FOLDER: transforms.json by what nerfstudio's documents say of it alone, as JSON.

Of every 9th pixel with depth of every frame: u, v (the centre of the first pixel is 0.5) and the point in the world. Images and depth by
OpenImageIO's Python module, the cloud by meshio (Debian: python3-openimageio, python3-meshio).
"""
import json
import os
import sys

import meshio
import numpy
import OpenImageIO

folder = sys.argv[1]
with open(os.path.join(folder, "transforms.json"), encoding="utf-8") as file:
    transforms = json.load(file)


def pixels(name, kind):
    image = OpenImageIO.ImageBuf(os.path.join(folder, name))
    assert not image.has_error, image.geterror()
    return image.get_pixels(kind)


frames = []
for frame in transforms["frames"]:
    # Intrinsics stand in the frame, or once for all.
    of = {key: frame.get(key, transforms.get(key)) for key in ("w", "h", "fl_x", "fl_y", "cx", "cy")}
    height, width = pixels(frame["file_path"], OpenImageIO.UINT8).shape[:2]
    assert (width, height) == (of["w"], of["h"])
    codes = pixels(frame["depth_file_path"], OpenImageIO.UINT16)[:, :, 0]
    assert codes.shape == (height, width)
    z = codes * transforms["depth_unit_scale_factor"]
    rows, columns = numpy.nonzero(codes)
    rows, columns = rows[::9], columns[::9]
    u, v, z = columns + 0.5, rows + 0.5, z[rows, columns]
    # OpenGL: x right, y up, looking along -z.
    in_cam = numpy.stack([(u - of["cx"]) / of["fl_x"] * z, -(v - of["cy"]) / of["fl_y"] * z, -z, numpy.ones_like(z)])
    points = (numpy.array(frame["transform_matrix"]) @ in_cam)[:3].T
    frames.append({"file": frame["file_path"], "pixels": numpy.stack([u, v], 1).tolist(), "points": points.tolist()})

cloud = meshio.read(os.path.join(folder, transforms["ply_file_path"]))
print(json.dumps({"frames": frames, "cloud": cloud.points.tolist()}))
