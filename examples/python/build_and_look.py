"""build_and_look.py PHOTOS SET.dtr: builds a set of photos and shows how good it is.

Every 8th photo is held out. Writes FOLDER/comparison.png (the worst held-out view as rendered, its
photo, the difference) and FOLDER/page.html, the scene in a browser.
"""

import argparse
import os
import sys

import dtr
import matplotlib.pyplot as plt
import numpy as np


def show_progress(stage, done, total):
    print(f"\r\033[K{stage} {done}/{total}" if total else f"\r\033[K{stage}", end="", file=sys.stderr)


def build(arguments):
    if os.path.exists(arguments.set):
        return dtr.load(arguments.set)
    s = dtr.build(
        arguments.photos,
        arguments.set,
        preset="fast",
        holdout="every:8",
        poses=arguments.poses,  # None: structure from motion finds the cameras
        progress=show_progress,
    )
    print(file=sys.stderr)
    for name in s.build_report["not_registered"]:
        print(f"no camera was found for {name}")
    return s


def compare(s, name, file):
    """The held-out photo beside what is rendered without it."""
    photo = s.view(name).image
    frame = s.render(name)
    difference = np.abs(frame.image.astype(int) - photo).mean(axis=2)
    figure, axes = plt.subplots(1, 3, figsize=(15, 4), layout="constrained")
    for axis, image, title in zip(
        axes, (frame.image, photo, difference), ("rendered", name, "difference, levels")
    ):
        shown = axis.imshow(image)
        axis.set_title(title)
        axis.axis("off")
    figure.colorbar(shown, ax=axes[2])
    figure.savefig(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("photos")
    parser.add_argument("set")
    parser.add_argument("--poses", help="known cameras, of any program that dtr import reads")
    parser.add_argument("--output", default="look", help="folder for the image and the page")
    arguments = parser.parse_args()

    s = build(arguments)
    print(s, f"calibration {'passed' if s.validation.get('passed') else 'FAILED'}")
    scores = s.evaluate()
    print(f"PSNR {scores['mean']['psnr_db']:6.1f} dB, {100 * scores['mean']['coverage']:.1f} % seen")
    worst = min(scores["views"], key=lambda view: view["psnr_db"])
    os.makedirs(arguments.output, exist_ok=True)
    compare(s, worst["name"], os.path.join(arguments.output, "comparison.png"))
    page = os.path.join(arguments.output, "page.html")
    if not os.path.exists(page):
        s.page(page)
    print(f"{page}: open it in a browser")


if __name__ == "__main__":
    try:
        main()
    except (dtr.Error, OSError) as error:
        sys.exit(f"{error}")
