"""How fast programs are read, beside a plain tracker that takes one line at a time.

    python tests/bench/bench_reading.py [--megabytes 10] [--memory]

The finishing program is three-axis, modal words omitted, with a retract and an approach every 200
lines; in Klartext each line has its number; the printed part is Marlin's, with extrusion. The
others are the finishing program as posts and shops write it: without its feed mode, with an F in
each line, in whole numbers, behind a work system, with blanks in its words, and with A for Y.
The plain tracker does the least that finds the rapids: a regular expression over each line, G0 to
G3 or FMAX, G90, G91 and the last X, Y, Z. `--memory` reads 100 MB in a fresh process and prints
its largest resident size.
"""

import argparse
import io
import re
import subprocess
import sys
import tempfile

import numpy as np
from timing import best_of

from gcodejerk.nc import CERTAIN, Start, read_program


def finishing_program(lines):
    """Parallel paths over a wavy surface."""
    random = np.random.default_rng(4)
    x = np.cumsum(random.uniform(0.05, 0.9, lines)) % 250.0
    y = np.repeat(np.arange(lines // 200 + 1), 200)[:lines] * 0.35 % 400.0
    z = -6.0 + 5.0 * np.sin(x / 17.0) * np.cos(y / 23.0)
    rows = [b"G21 G90 G94 G17 G40", b"G0 Z50.", b"M3 S12000", b"G1 X0. Y0. Z0. F2400"]
    columns = zip(x.tolist(), y.tolist(), z.tolist(), strict=True)
    for k, (a, b, c) in enumerate(columns):
        if k % 200 == 199:
            rows += [b"G0Z5.", b"X%.3fY%.3f" % (a, b), b"G1Z%.3f" % c]
        else:
            rows.append(b"X%.3fY%.3fZ%.3f" % (a, b, c))
    return b"\n".join([*rows, b"M5", b"M30", b""])


def klartext_program(lines):
    """The same in Klartext, as posts write it."""
    rows = [b"0 BEGIN PGM PART MM", b"1 L X+0 Y+0 Z+50 R0 FMAX M3", b"2 L F2400"]
    for line in finishing_program(lines).split(b"\n")[4:-3]:
        fast = line.startswith(b"G0")
        words = re.findall(rb"[XYZ][-0-9.]+", line)
        said = b"".join(b"  " + re.sub(rb"([XYZ])([0-9])", rb"\1+\2", word) for word in words)
        rows.append(b"%d L" % len(rows) + said + (b" FMAX" if fast else b""))
    return b"\n".join([*rows, b"%d M30" % len(rows), b"%d END PGM PART MM" % (len(rows) + 1), b""])


def drilling_program(lines):
    """Positions with comments, line numbers and inches."""
    rows = [b"%", b"G20 G90 G94 G17 G40", b"F10"]
    for k in range(lines // 4):
        rows += [
            b"N%d G0 X%.4f Y%.4f (hole %d)" % (4 * k + 10, k % 37 / 7, k % 53 / 11, k),
            b"N%d G0 Z0.1" % (4 * k + 11),
            b"N%d G1 Z-0.5" % (4 * k + 12),
            b"N%d G0 Z1." % (4 * k + 13),
        ]
    return b"\n".join([*rows, b"M2", b"%", b""])


def printed_part(lines):
    """Perimeters of islands, layer by layer, with comments, extrusion and travels by G0."""
    random = np.random.default_rng(3)
    rows = [b"G21", b"G90", b"M83", b"M104 S215", b"G28 ; home all axes", b"G1 Z5 F5000"]
    layer, x, y = 0, 100.0, 100.0
    while len(rows) < lines:
        layer += 1
        rows += [b";LAYER_CHANGE", b";Z:%.1f" % (0.2 * layer), b"G1 Z%.2f F9000" % (0.2 * layer)]
        for _ in range(4):
            x, y = random.uniform(60.0, 140.0, 2)
            rows += [b"G0 X%.3f Y%.3f F9000" % (x, y), b"G1 E.8 F2400", b";TYPE:Perimeter"]
            rows.append(b"G1 F1500")
            for step_x, step_y, e in random.uniform((-2, -2, 0), (2, 2, 0.1), (80, 3)).tolist():
                x, y = x + step_x, y + step_y
                rows.append(b"G1 X%.3f Y%.3f E%.5f" % (x, y, e))
            rows.append(b"G1 E-.8 F2400")
    return b"\n".join([*rows, b"M107", b"M84", b""])


def without_feed_mode(lines):
    """The finishing program as it is posted for Fanuc: G94 is what the control starts in."""
    return finishing_program(lines).replace(b" G94", b"")


def with_feeds(lines):
    """The same with an F in each path, whole as most posts write it."""
    return re.sub(rb"(Z[-0-9.]+)\nX", rb"\1 F1200\nX", finishing_program(lines))


def whole_numbers(lines):
    """The same in whole millimetres, where the machine file says that 5 is 5 mm."""
    return re.sub(rb"([XYZ]-?[0-9]+)\.[0-9]*", rb"\1", finishing_program(lines))


def behind_a_work_system(lines):
    """The same for Siemens, behind a work system of which nobody says where it is."""
    data = finishing_program(lines).replace(b"G21", b"G710 G64", 1)
    return data.replace(b"\nG0 Z50.", b"\nG54\nG0 Z50.", 1)


def with_blanks(lines):
    """The same with blanks in front of numbers, as dxf2gcode writes them."""
    return re.sub(rb"([XYZ])(?=[-0-9])", rb" \1  ", finishing_program(lines))


def with_a(lines):
    """The same with A in every line of three axes, on a machine that says nothing of its turns."""
    data = finishing_program(lines)
    return re.sub(rb"Y([0-9]+)\.([0-9]+)(?=Z)", rb"A\1.\2", data)


WORD = re.compile(rb"([A-Z]) *([-+]?[0-9.]+)")


def plain_tracker(data):
    """Rapids by a loop over the lines: the alternative that anyone would write first."""
    motion, incremental, position, rapids = 1, False, {}, []
    for number, line in enumerate(io.BytesIO(data), 1):
        start = None
        if b" L " in line:
            motion = 0 if b"FMAX" in line else 1
        for letter, text in WORD.findall(line):
            value = float(text)
            if letter == b"G":
                if value in (0.0, 1.0, 2.0, 3.0):
                    motion = int(value)
                elif value in (90.0, 91.0):
                    incremental = value == 91.0
            elif letter in b"XYZ":
                if start is None:
                    start = dict(position)
                if incremental:
                    value += position.get(letter, 0.0)
                position[letter] = value
        if motion == 0 and start is not None:
            rapids.append((number, start, dict(position)))
    return rapids


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--megabytes", type=float, default=10.0)
    parser.add_argument("--memory", action="store_true")
    given = parser.parse_args()
    lines = int(given.megabytes * 46600)
    print(f"{'program':22}{'MB':>6}{'lines':>9}{'rapids':>9}{'certain':>9}", end="")
    print(f"{'MB/s':>8}{'plain':>8}{'ratio':>7}{'careful':>9}")
    makers = {
        "3-axis finishing": (finishing_program, "linuxcnc"),
        "commented drilling": (drilling_program, "linuxcnc"),
        "Klartext finishing": (klartext_program, "klartext"),
        "printed part": (printed_part, "marlin"),
        "no G94, for Fanuc": (without_feed_mode, "fanuc"),
        "F in each line, Haas": (with_feeds, "haas"),
        "whole numbers, Haas": (whole_numbers, "haas"),
        "behind G54, Siemens": (behind_a_work_system, "siemens"),
        "blanks in front": (with_blanks, "linuxcnc"),
        "blanks, for Fanuc": (with_blanks, "fanuc"),
        "a rotary axis": (with_a, "linuxcnc"),
    }
    start = Start(decimal_point="calculator")
    for name, (make, dialect) in makers.items():
        data = make(lines)
        megabytes = len(data) / 1e6

        def read(data=data, dialect=dialect, fast=True):
            return read_program(io.BytesIO(data), dialect=dialect, start=start, fast=fast)

        quick, program = best_of(read)
        plain, found = best_of(lambda data=data: plain_tracker(data))
        few = data[: len(data) // 10]
        careful, _ = best_of(lambda few=few, read=read: read(few, fast=False), 1)
        rapids = program.rapids
        assert set(rapids.line.tolist()) == {number for number, _, _ in found}
        print(f"{name:22}{megabytes:6.1f}{program.lines:9}{len(rapids):9}", end="")
        print(f"{np.count_nonzero(rapids.reason == CERTAIN):9}{megabytes / quick:8.1f}", end="")
        print(f"{megabytes / plain:8.1f}{plain / quick:7.1f}{len(few) / 1e6 / careful:9.2f}")
    if given.memory:
        print_memory()


READER = """
import re, sys
from gcodejerk.nc import read_program
def resident():  # of this process alone; getrusage keeps what the parent had at the fork
    return int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1])
before = resident()
with open(sys.argv[1], "rb") as file:
    program = read_program(file)
after = resident()
print(f"{program.size / 1e6:.0f} MB, {program.lines} lines, {len(program.rapids)} rapids: ", end="")
print(f"{after / 1024:.0f} MB resident at most, {before / 1024:.0f} MB before reading")
"""


def print_memory():
    """Read 100 MB in a process of its own."""
    piece = finishing_program(466_000)
    with tempfile.NamedTemporaryFile(suffix=".ngc") as file:
        for _ in range(10):
            file.write(piece.replace(b"M30", b"M9"))
        file.flush()
        subprocess.run([sys.executable, "-c", READER, file.name], check=True)


if __name__ == "__main__":
    main()
