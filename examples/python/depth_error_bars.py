"""depth_error_bars.py SET.dtr VIEW: a depth map as a point cloud, each point with its error bar.

Writes NAME.ply, the points with colours and standard deviations, and NAME.png: a side view of some
points with error bars of one standard deviation along their rays, and how large these are.
"""

import argparse
import sys

import dtr
import matplotlib.pyplot as plt
import numpy as np


def write_ply(file, cloud, origin):
    """Binary PLY in the user's world."""
    columns = [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("red", "u1"), ("green", "u1"), ("blue", "u1"),
               ("sigma", "<f4")]
    vertices = np.empty(len(cloud), columns)
    for i, name in enumerate("xyz"):
        vertices[name] = cloud.points[:, i] + origin[i]
    for i, name in enumerate(("red", "green", "blue")):
        vertices[name] = cloud.colours[:, i]
    vertices["sigma"] = cloud.sigma
    types = {"<f8": "double", "<f4": "float", "u1": "uchar"}
    with open(file, "wb") as ply:
        properties = "".join(f"property {types[kind]} {name}\n" for name, kind in columns)
        ply.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(cloud)}\n"
                  f"{properties}end_header\n".encode())
        vertices.tofile(ply)


def plot(file, s, view, cloud):
    """Seen from above: the camera's x to the right, its z upwards, both in scene units."""
    rotation, translation = view.cam_from_world[:3, :3], view.cam_from_world[:3, 3]
    chosen = np.random.default_rng(0).choice(len(cloud), min(len(cloud), 400), replace=False)
    points = cloud.points[chosen] @ rotation.T + translation
    bars = (cloud.sigma[:, None] * cloud.directions)[chosen] @ rotation.T
    figure, (above, sizes) = plt.subplots(1, 2, figsize=(13, 5), layout="constrained")
    ends = np.stack([points - bars, points + bars])
    above.plot(ends[..., 0], ends[..., 2], color="0.6", linewidth=0.8)
    above.scatter(points[:, 0], points[:, 2], c=cloud.colours[chosen] / 255, s=6, zorder=2)
    unit = {"metre": "m"}.get(s.unit, "scene units")
    above.set(xlabel=f"x, {unit}", ylabel=f"z, {unit}", title=f"{view.name}: one sigma along the ray")
    distance = np.linalg.norm(cloud.points + rotation.T @ translation, axis=1)
    sizes.hexbin(distance, 100 * cloud.sigma / distance, gridsize=50, yscale="log", mincnt=1)
    sizes.set(xlabel=f"distance, {unit}", ylabel="sigma, % of the distance", title="all points")
    figure.savefig(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set")
    parser.add_argument("view")
    parser.add_argument("--output", default="cloud", help="NAME of what is written")
    arguments = parser.parse_args()

    s = dtr.load(arguments.set)
    view = s.view(arguments.view)
    cloud = s.unproject(view)
    if view.sigma is None:
        sys.exit(f"{arguments.set}: has no standard deviations; sets that dtr build makes have them")
    write_ply(f"{arguments.output}.ply", cloud, s.world_origin)
    plot(f"{arguments.output}.png", s, view, cloud)
    print(f"{arguments.output}.ply: {len(cloud)} points, median sigma {np.median(cloud.sigma):.3g} "
          f"({s.unit})")


if __name__ == "__main__":
    try:
        main()
    except (dtr.Error, OSError) as error:
        sys.exit(f"{error}")
