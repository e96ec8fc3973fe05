"""LinuxCNC's own interpreter on real programs before and after: the same end points and feeds."""

import shutil
from bisect import bisect_right
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from interpreter import run_oracle

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SHARED = ROOT.parent / "shared"
INSTALLED = (Path("/usr/share/linuxcnc"), Path("/usr/share/doc/linuxcnc"))
STARTUP = "G17 G21 G40 G49 G54 G64 G80 G90 G94 G97"
STEP = 3e-6
"""Of the tiny rapids around a stream. [mm]"""
TOLERANCE = 1e-6
MOTION = {"FEED", "TRAVERSE", "ARC", "RIGID_TAP", "PROBE"}

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]


@pytest.fixture(scope="module")
def machine():
    """The shipped machining centre with three rotary axes, so that five-axis programs count."""
    limits = "{velocity: 120, acceleration: 900, jerk: 9.0e+4}"
    rotary = "".join(f"  {axis}:\n    rapid: {limits}\n" for axis in "ABC")
    text = find_machine("vmc").read_text().replace("axes:\n", f"axes:\n{rotary}", 1)
    return Machine.loads(text, "five-axis")


def events(path):
    """The interpreter's calls as (line, what, values), or None where it refuses the program."""
    table = HERE / "linuxcnc" / "sim.tbl"
    run = run_oracle(path, "--tool-table", table, "--startup", STARTUP, timeout=120)
    if run.returncode != 0:
        return None
    split = (line.split() for line in run.stdout.splitlines())
    return [(int(w[0]), w[1], [number(x) for x in w[2:]]) for w in split if len(w) > 1]


def number(text):
    """A value of the interpreter's calls; a plane and the like stays text."""
    try:
        return float(text)
    except ValueError:
        return text


def with_feeds(calls):
    """The calls without FEEDRATE; feed moves carry the rate that is in force instead."""
    rate = None
    out = []
    for line, what, values in calls:
        if what == "FEEDRATE":
            rate = values[0]
        else:
            out.append((line, what, values, rate if what in {"FEED", "ARC"} else None))
    return out


def programs():
    """Distinct programs: what FreeCAD posted for LinuxCNC, LinuxCNC's own, and our samples."""
    files = sorted(ROOT.glob("samples/*.ngc")) + sorted(SHARED.glob("hosts/nc/*__linuxcnc*.ngc"))
    for folder in INSTALLED:
        files += sorted(folder.rglob("*.ngc"))
    return list({path.read_bytes(): path for path in reversed(files)}.values())[::-1]


def assert_same_motion(path, machine, folder):
    """Process one program and compare: rapids rewritten, or None where LinuxCNC refuses it."""
    original = events(path)
    if original is None:
        return None
    data = path.read_bytes()
    result = process(data, machine, controller="linuxcnc", name=path.name)
    target = folder / f"{abs(hash(path))}.ngc"
    target.write_bytes(result.output)
    after = events(target)
    assert after is not None, f"the interpreter refuses what became of {path}"
    # Lines of the output that are streams, and the line of the block that each replaces.
    starts = [0]
    for text in result.output.splitlines(keepends=True):
        starts.append(starts[-1] + len(text))
    spans = [
        (bisect_right(starts, begin), bisect_right(starts, end - 1), row)
        for begin, end, row in result.edits.tolist()
    ]
    first = [span[0] for span in spans]
    streams = {}
    kept = []
    for line, what, values, rate in with_feeds(after):
        k = bisect_right(first, line) - 1
        if k >= 0 and spans[k][2] >= 0 and line <= spans[k][1]:
            streams.setdefault(spans[k][2], []).append((what, values))
        else:
            kept.append((what, values, rate))
    rows = {int(result.program.rapids.line[row]): row for _, _, row in spans if row >= 0}
    expected = []
    # A rapid in a loop or a subprogram runs as often as that does.
    passes = Counter(line for line, what, _ in original if what == "TRAVERSE")
    passed = Counter()
    for line, what, values, rate in with_feeds(original):
        if line not in rows:
            expected.append((what, values, rate))
            continue
        stream = streams[rows[line]]
        if what == "TRAVERSE":
            moves = [(w, v) for w, v in stream if w in MOTION]
            size, rest = divmod(len(moves), passes[line])
            assert rest == 0, (path, line)
            moves = moves[passed[line] * size :][:size]
            passed[line] += 1
            assert moves[-1][0] == "TRAVERSE", (path, line)
            assert moves[-1][1] == pytest.approx(values, abs=TOLERANCE), (path, line)
            # In front of the points and behind them G0 moves by a step; a bare one not at all.
            feeds = [v for w, v in moves if w == "FEED"]
            ends = (feeds[0], moves[0][1], moves[-1][1])
            near = [min(np.abs(np.subtract(v, end)).max() for end in ends) for _, v in moves]
            others = [d for (w, _), d in zip(moves, near, strict=True) if w == "TRAVERSE"]
            assert max(others) <= STEP, (path, line)
            assert feeds[-1] == pytest.approx(values, abs=STEP), (path, line)
        else:
            assert (what, values) in stream, (path, line, what)
    assert [w for w, _, _ in kept] == [w for w, _, _ in expected], path
    for (what, got, rate), (_, wanted, usual) in zip(kept, expected, strict=True):
        if what in MOTION:
            assert got == pytest.approx(wanted, abs=TOLERANCE), (path, what)
        else:
            assert got == wanted, (path, what)
        assert rate == pytest.approx(usual), (path, what, got)
    return result.planned


PARTS = 4
"""Of the programs, for as many cores."""
LEAST = {
    **{"plate.ngc": 19, "tort.ngc": 60, "lathe_pawn.ngc": 50, "all__linuxcnc.ngc": 150},
    # Of its short rapids many are left alone on this machine, for no other would be better.
    **{"adaptive__linuxcnc.ngc": 150, "two_fixtures__linuxcnc__inch_lineno.ngc": 300},
}
"""Rapids that are rewritten at least, of programs with many."""


@pytest.mark.parametrize("part", range(PARTS))
def test_interpreter_finds_the_same_end_points_before_and_after(machine, tmp_path, part):
    paths = programs()[part::PARTS]
    done = {path.name: assert_same_motion(path, machine, tmp_path) for path in paths}
    accepted = {name: rewritten for name, rewritten in done.items() if rewritten is not None}
    assert sum(accepted.values()) > 0
    assert accepted.get("plate.ngc", 19) == 19
    assert {name for name in accepted if accepted[name] < LEAST.get(name, 0)} == set()
    assert not {name for name in LEAST if name in done} - set(accepted)


def test_programs_with_many_rapids_are_among_them():
    names = {path.name for path in programs()}
    assert {name for name in LEAST if "__" not in name or SHARED.exists()} <= names


@pytest.mark.skipif(
    not SHARED.exists(), reason="the shared material with FreeCAD's programs is absent"
)
def test_freecads_programs_are_there():
    assert len(list(SHARED.glob("hosts/nc/*__linuxcnc*.ngc"))) >= 7
