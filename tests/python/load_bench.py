"""Does reading a set into numpy cost more than reading it in C++?

    PYTHONPATH=build/release/python /usr/bin/python3 tests/python/load_bench.py SET.dtr build/release/tests/io/load_bench

Processor seconds of one thread for all pixels, by `dtr.load` with `load_pixels(threads=1)` and every array taken, and by
io::LoadSet, in turns, each in a process of its own: the median of RUNS after one that warms up, the least and the largest.
"""

import statistics
import subprocess
import sys
import time

RUNS = 15


def in_numpy(path):
    import dtr

    start = time.process_time()
    s = dtr.load(path)
    s.load_pixels(threads=1)
    for view in s.views:
        for plane in ("image", "mask", "depth", "completed_depth", "sigma"):
            getattr(view, plane)
    print(f"{time.process_time() - start:.6f}")


def seconds_of(words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    return float(done.stdout)


def compare(path, program):
    commands = {"load_pixels(threads=1)": [sys.executable, __file__, path], "io::LoadSet": [program, path]}
    seconds = {name: [] for name in commands}
    for run in range(-1, RUNS):
        for name, words in commands.items():
            measured = seconds_of(words)
            if run >= 0:
                seconds[name].append(measured)
    medians = [statistics.median(values) for values in seconds.values()]
    for (name, values), median in zip(seconds.items(), medians):
        print(f"{name:<24} {median:.3f} s ({min(values):.3f} to {max(values):.3f})")
    print(f"{'ratio of the medians':<24} {medians[0] / medians[1]:.2f}")


if __name__ == "__main__":
    if len(sys.argv) == 2:
        in_numpy(sys.argv[1])
    elif len(sys.argv) == 3:
        compare(*sys.argv[1:])
    else:
        sys.exit(__doc__.strip())
