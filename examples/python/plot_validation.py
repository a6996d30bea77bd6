"""plot_validation.py SET.dtr: validates a calibration and plots what was found.

Left: every test's figure over its limit; right: residuals of each camera on observations that were
held out. Prints the tests. Exit code 1 where one fails.
"""

import argparse
import sys

import dtr
import matplotlib.pyplot as plt


def ratio(test):
    """A figure over its limit, so that 1 is where it fails; None where nothing could be measured."""
    if test["value"] is None or not test["limit"]:
        return None
    share = test["value"] / test["limit"]
    if not test["name"].startswith("min_"):
        return share
    return 1 / share if share else None


def plot_tests(axis, tests):
    known = [(test, ratio(test)) for test in tests]
    known = [(test, share) for test, share in known if share is not None]
    names = [test["name"] for test, _ in known]
    axis.barh(names, [share for _, share in known],
              color=["tab:green" if test["passed"] else "tab:red" for test, _ in known])
    axis.axvline(1, color="black", linewidth=1)
    axis.invert_yaxis()
    axis.set(xlabel="figure / limit", title="tests: the line is the limit")


def plot_cameras(axis, cameras):
    tested = [camera for camera in cameras if camera["held_out"]["count"] > 0]
    places = range(len(tested))
    for key, label in (("rms_px", "RMS"), ("median_px", "median"), ("p95_px", "95 %")):
        axis.plot(places, [camera["held_out"][key] for camera in tested], "o", label=label)
    step = max(1, len(tested) // 20)
    axis.set_xticks(places[::step], [camera["name"] for camera in tested][::step], rotation=60,
                    ha="right", fontsize="small")
    axis.set(ylabel="residual, px", title="held-out observations by camera")
    axis.set_ylim(bottom=0)
    axis.legend()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set")
    parser.add_argument("--output", default="validation.png")
    arguments = parser.parse_args()

    report = dtr.load(arguments.set).validate()
    for test in report["tests"]:
        print("passed" if test["passed"] else "FAILED", test["name"], test["value"], test["reason"])
    figure, axes = plt.subplots(1, 2, figsize=(14, 6), layout="constrained")
    plot_tests(axes[0], report["tests"])
    plot_cameras(axes[1], report["cameras"])
    figure.suptitle(f"{arguments.set}: {'passed' if report['passed'] else 'FAILED'}")
    figure.savefig(arguments.output)
    return 0 if report["passed"] else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (dtr.Error, OSError) as error:
        sys.exit(f"{error}")
