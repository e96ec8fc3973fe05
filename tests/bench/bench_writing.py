r"""How fast points become text, beside Python's own formatting of one point after the other.

    python tests/bench/bench_writing.py [--points 1000000]

The lines are those of a LinuxCNC stream, `G1 X12.3456 Y-0.1234 Z5.0000 F1234.5678`. "Per point" is
`b"G1 X%.4f ..." % (...)` over the rows of the same numbers, "f-string" the same by an f-string;
"whole program" is everything from the program's bytes to the written and verified output, counted
in points too.
"""

import argparse

import numpy as np
from timing import best_of

from gcodejerk import Machine, find_machine, process
from gcodejerk.emit.number_format import Column, format_lines


def numbers(axes, count):
    """Whole steps of each axis and feeds, as an emitter has them."""
    random = np.random.default_rng(5)
    columns = {axis: random.integers(-3_000_000, 3_000_000, count) for axis in axes}
    return columns, random.integers(1, 360_000_000, count)


def per_point(columns, feed):
    """The plain way: one format a line."""
    form = b"G1 " + b" ".join(axis.encode() + b"%.4f" for axis in columns) + b" F%.4f\n"
    rows = [(values / 1e4).tolist() for values in (*columns.values(), feed)]
    return b"".join([form % row for row in zip(*rows, strict=True)])


def per_f_string(columns, feed):
    """The other plain way, for three axes."""
    rows = [(values / 1e4).tolist() for values in (*columns.values(), feed)]
    lines = [f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} F{f:.4f}\n" for x, y, z, f in zip(*rows, strict=True)]
    return "".join(lines).encode()


def together(columns, feed):
    """Ours: all lines at once."""
    words = [
        Column((b" " if k else b"G1 ") + axis.encode(), values, 4)
        for k, (axis, values) in enumerate(columns.items())
    ]
    return format_lines([*words, Column(b" F", feed, 4)], b"\n")[0]


def drilling(rapids):
    """A program that is mostly rapids."""
    random = np.random.default_rng(6)
    lines = [b"G21 G90 G94 G64", b"G1 X0 Y0 Z5 F600"]
    for x, y in random.uniform(-200, 0, (rapids // 2, 2)):
        lines += [b"G0 X%.3f Y%.3f" % (x, y), b"G1 Z-3", b"G0 Z5"]
    return b"\n".join([*lines, b"M2", b""])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=1_000_000)
    given = parser.parse_args()
    print(
        f"{'lines':18}{'points':>9}{'MB':>7}{'points/s':>13}{'per point':>13}{'times':>7}", end=""
    )
    print(f"{'f-string':>13}{'times':>7}")
    for axes in ("X", "XYZ"):
        columns, feed = numbers(axes, given.points)
        ours, text = best_of(lambda c=columns, f=feed: together(c, f))
        plain, same = best_of(lambda c=columns, f=feed: per_point(c, f), 1)
        assert text == same
        rates = [given.points / ours, given.points / plain]
        print(f"{'G1 ' + axes + ' F':18}{given.points:9}{len(text) / 1e6:7.1f}", end="")
        print(f"{rates[0]:13.0f}{rates[1]:13.0f}{plain / ours:7.1f}", end="")
        if len(axes) == 3:
            third, same = best_of(lambda c=columns, f=feed: per_f_string(c, f), 1)
            assert text == same
            print(f"{given.points / third:13.0f}{third / ours:7.1f}", end="")
        print()
    machine = Machine.load(find_machine("vmc"))
    program = drilling(2000)
    for verify in (True, False):
        took, result = best_of(lambda v=verify: process(program, machine, verify=v), 1)
        points = result.output.count(b"\nG1 ")
        name = "whole program" if verify else "  not verified"
        print(f"{name:18}{points:9}{len(result.output) / 1e6:7.1f}{points / took:13.0f}")


if __name__ == "__main__":
    main()
