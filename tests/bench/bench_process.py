r"""Where the time of `process` goes, phase by phase, beside plain alternatives in the same run.

    python tests/bench/bench_process.py [--rapids 4000] [--distinct 500] [--report]

Programs: a drilling raster of 40 by 40 (few distinct ways, the same places again), a plate of holes
(few distinct ways, no place twice), drilling at drawn places (`--distinct` of them), a lathe's
roughing passes, positions by macro variables, and three-axis rapids none of which is like another;
those once more on a machine that finds them too short, so that all are left alone. "plain" reads
the program and its output as anyone would first write it: a loop over the lines with a regular
expression for the words, and one over the points with Python's own formatting. The ratio of each
phase is its CPU time over that of the plain loops together; so it does not depend on the machine.
Peak memory is that of the process so far [MB].
"""

import argparse
import io
import re
import resource
import tempfile
import time
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from gcodejerk import Machine, find_machine
from gcodejerk.batch.reports import write_report
from gcodejerk.report.columns import packed
from gcodejerk.rewrite import pipeline
from gcodejerk.rewrite.pipeline import Settings, process_file
from gcodejerk.verification import proof

PHASES = {
    "read": (pipeline, "_read"),
    "plan": (pipeline, "_plan"),
    "write": (pipeline, "write_streams"),
    "verify": (pipeline, "_verified"),
    "(read twice)": (proof, "confirm"),
}
POINT = re.compile(rb"G1((?: [XYZ]-?[0-9.]+)+) F([0-9.]+)\n")
WORD = re.compile(rb"([A-Z])([-+]?[0-9.]+)")


def drilling(rapids):
    """Holes in a raster of 40 by 40."""
    lines = ["%", "G21 G90 G94 G17 G40 G49 G64", "G0 Z5", "G0 X-100 Y-100", "F600"]
    for k in range(rapids // 2):
        lines += [f"G0 X{-100 - 5 * (k % 40):.3f} Y{-100 - 5 * (k // 40 % 40):.3f}", "G1 Z-3"]
        lines.append("G0 Z5")
    return "\n".join([*lines, "M2", "%", ""]).encode()


def plate(rapids):
    """Holes in a raster of 420 columns, no two of them in one place."""
    lines = ["%", "G21 G90 G94 G17 G40 G49 G64", "G0 Z5", "G0 X0 Y0", "F600"]
    for k in range(rapids // 2):
        row, column = divmod(k, 420)
        column = 419 - column if row % 2 else column
        lines += [f"G0 X{-1.5 * column:.3f} Y{-1.5 * row:.3f}", "G1 Z-3", "G0 Z5"]
    return "\n".join([*lines, "M2", "%", ""]).encode()


def drawn(rapids, distinct):
    """Holes at drawn places, which come again and again."""
    places = np.random.default_rng(6).uniform(-300, 0, (distinct, 2)).tolist()
    lines = ["G21 G90 G94 G17 G40 G49 G64", "G0 Z5", "G0 X-100 Y-100", "F600"]
    for k in range(rapids // 2):
        x, y = places[k % distinct]
        lines += [f"G0 X{x:.3f} Y{y:.3f}", "G1 Z-3", "G0 Z5"]
    return "\n".join([*lines, "M2", ""]).encode()


def lathe(rapids):
    """Roughing passes."""
    lines = ["%", "O1200(SHAFT)", "G21 G97 S1000 M3", "T0101", "G0 X200. Z50."]
    for k in range(rapids // 3):
        d = 100 - k % 160 * 0.5
        lines += [f"G0 X{d:.3f} Z2.", f"G1 Z-{50 + k % 7}.5 F0.2", f"G0 X{d + 2:.3f}", "G0 Z2."]
    return "\n".join([*lines, "M30", "%", ""]).encode()


def macro(rapids):
    """Positions by variables."""
    lines = ["%", "O1000", "G21 G90 G94", "#1=5.", "#11=2."]
    for k in range(rapids // 3):
        lines += [f"#2=[{k % 50}*2.5]", f"G0 X[#2+#1] Y[{k % 31}*#11]", "G0 Z[5.0-#11]"]
        lines += ["G1 Z[0-#1/2] F200", "G0 Z5."]
    return "\n".join([*lines, "M30", "%", ""]).encode()


def unlike(rapids):
    """Three-axis rapids, none like another."""
    places = np.random.default_rng(9).uniform((-300, -300, -200), 0, (rapids, 3)).tolist()
    lines = ["G21 G90 G94 G17 G40 G49 G64", "G0 X0 Y0 Z0", "F600"]
    for x, y, z in places:
        lines += [f"G0 X{x:.3f} Y{y:.3f} Z{z:.3f}", f"G1 X{x + (0.5 if x < -250 else -0.5):.3f}"]
    return "\n".join([*lines, "M2", ""]).encode()


def plain_reading(data):
    """Words of every line."""
    position = {}
    for line in io.BytesIO(data):
        for letter, number in WORD.findall(line):
            if letter in b"XYZ" and number.strip(b"-+."):
                position[letter] = float(number)
    return position


def plain_writing(output):
    """The points once more, formatted one by one."""
    out = []
    for words, feed in POINT.findall(output):
        numbers = [(w[:1], float(w[1:])) for w in words.split()]
        out.append("G1 " + " ".join(f"{a.decode()}{x:.4f}" for a, x in numbers))
        out.append(f" F{float(feed):.4f}\n")
    return "".join(out).encode()


@contextmanager
def clocks(times):
    """Adds up the CPU time of every phase."""
    kept = {name: getattr(*place) for name, place in PHASES.items()}

    def timed(name, function):
        def run(*args, **kwargs):
            begin = time.process_time()
            try:
                return function(*args, **kwargs)
            finally:
                times[name] += time.process_time() - begin

        return run

    for name, (module, attribute) in PHASES.items():
        setattr(module, attribute, timed(name, kept[name]))
    yield
    for name, (module, attribute) in PHASES.items():
        setattr(module, attribute, kept[name])


def cpu(function, *args):
    """CPU time of a call."""
    begin = time.process_time()
    function(*args)
    return time.process_time() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rapids", type=int, default=4000)
    parser.add_argument("--distinct", type=int, default=500)
    parser.add_argument("--report", action="store_true", help="write the JSON report, too")
    given = parser.parse_args()
    machine = Machine.load(find_machine("vmc"))
    few = given.rapids
    programs = {
        ("raster", "linuxcnc"): drilling(few),
        ("raster", "grbl"): drilling(few),
        ("plate", "linuxcnc"): plate(few),
        ("plate", "grbl"): plate(few),
        ("drawn places", "linuxcnc"): drawn(few, given.distinct),
        ("drawn places", "grbl"): drawn(few, given.distinct),
        ("lathe", "haas"): lathe(few),
        ("variables", "haas"): macro(few),
        ("all unlike", "linuxcnc"): unlike(few // 8),
        ("all left", "grbl"): unlike(few),
    }
    shy = replace(machine, design=replace(machine.design, minimum_length=1000.0))
    print(f"{'program':14}{'controller':>11}{'rapids':>8}{'MB':>7}{'plain s':>9}", end="")
    print("".join(f"{name:>{max(8, len(name) + 2)}}" for name in PHASES), end="")
    print(f"{'report':>8}{'ms/rapid':>10}{'MB/s':>7}{'peak':>6}")
    for (name, controller), program in programs.items():
        times = dict.fromkeys(PHASES, 0.0)
        with tempfile.TemporaryFile() as target, clocks(times):
            settings = Settings(controller=controller)
            source = io.BytesIO(program)
            begin = time.process_time()
            concerned = shy if name == "all left" else machine
            result = process_file(source, target, concerned, settings, f"{name}.nc")
            whole = time.process_time() - begin
            target.seek(0)
            output = target.read()
        plain = cpu(plain_reading, program) + cpu(plain_writing, output)
        reported = 0.0
        if given.report:
            with tempfile.TemporaryFile() as file, packed(file) as into:
                reported = cpu(write_report, into, result, concerned, None, source)
        rapids = result.planned or result.left
        print(f"{name:14}{controller:>11}{rapids:8}{len(output) / 1e6:7.1f}", end="")
        print(f"{plain:9.2f}", end="")
        print("".join(f"{t / plain:{max(8, len(k) + 2)}.2f}" for k, t in times.items()), end="")
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{reported / plain:8.2f}{1e3 * whole / rapids:10.3f}", end="")
        print(f"{len(output) / 1e6 / whole:7.1f}{peak:6.0f}")


if __name__ == "__main__":
    main()
