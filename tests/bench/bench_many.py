r"""A folder of many programs in one run: time and memory of one of them, whatever their number.

    python tests/bench/bench_many.py [--programs 10000] [--jobs 2] [--raster 25] [--controller grbl]

Programs are generated: each of 4 to 40 rapids between drawn places, no two alike; with --raster
between places some mm apart, so that ways come again from one program to the next. They go through
`gcodejerk process` twice, the second time with --if-changed, which leaves them all alone. Printed
are CPU time and clock for each program, and the memory of the largest process.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

COMMAND = [sys.executable, "-m", "gcodejerk.cli"]


def program(rng, raster=0.0):
    """Drilling at drawn places, or at those of a raster. [mm]"""
    lines = ["G21 G90 G94 G17 G40 G49 G64", "G0 X0 Y0 Z5", "F600"]
    for x, y in rng.uniform(-300.0, 0.0, (int(rng.integers(2, 20)), 2)):
        x, y = (raster * round(z / raster) if raster else z for z in (x, y))
        lines += [f"G0 X{x:.3f} Y{y:.3f}", "G1 Z-3", "G0 Z5"]
    return "\n".join([*lines, "M2", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=int, default=10_000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--raster", type=float, default=0.0)
    parser.add_argument("--controller", default="linuxcnc")
    given = parser.parse_args()
    rng = np.random.default_rng(8)
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "in"
        source.mkdir()
        for k in range(given.programs):
            (source / f"part{k:05}.ngc").write_text(program(rng, given.raster))
        for more in ([], ["--if-changed"]):
            begin = time.monotonic()
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            done = subprocess.run(
                [*COMMAND, "process", "in", "-m", "vmc", "--output-dir", "out", "--jobs",
                 str(given.jobs), "--controller", given.controller, "-q", *more],
                cwd=folder, capture_output=True, text=True, check=False,
            )  # fmt: skip
            clock = time.monotonic() - begin
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            written = len(list((Path(folder) / "out").rglob("*.ngc")))
            each = 1e3 / given.programs
            print(
                f"{' '.join(more) or 'first run':12} exit {done.returncode}, {written} outputs; "
                f"each {each * cpu:.1f} ms CPU, {each * clock:.1f} ms clock; "
                f"largest process {after.ru_maxrss / 1024:.0f} MB"
            )
            if done.returncode:
                print(done.stderr[-2000:])


if __name__ == "__main__":
    main()
