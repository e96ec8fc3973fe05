"""`verify` over drawn machines and programs: every output is accepted, every damage noticed.

Damage that no reader could tell from another good output is not counted: a point moved by one step
may only have been rounded the other way.
"""

from __future__ import annotations

import io
import re
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from gcodejerk.errors import GcodejerkError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.pipeline import process
from gcodejerk.testing.machines import machines
from gcodejerk.testing.programs import programs
from gcodejerk.verification import verify, verify_csv

CALM = settings(
    deadline=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
KNOWN = dict.fromkeys("XYZABC", 0.0)


def ready(machine, known=True):
    """The machine without travel, from a known start: so that there is much to rewrite."""
    axes = tuple(replace(axis, travel=None) for axis in machine.axes)
    program = replace(machine.program, start=KNOWN if known else {})
    return replace(machine, axes=axes, program=program)


VMC = ready(Machine.load(find_machine("vmc")))


def outputs(data, machine, controller):
    try:
        return process(data, machine, verify=False, controller=controller)
    except GcodejerkError:
        return None


@CALM
@given(machines(axes="XYZ"), programs(), st.booleans())
def test_every_output_is_accepted(machine, data, known):
    machine = ready(machine, known)
    result = outputs(data, machine, "linuxcnc")
    assume(result is not None)
    found = verify(data, result.output, machine)
    assert found.violations == ()
    assert (found.rapids, found.rewritten) == (len(result.program.rapids), result.planned)
    assert found.kept == result.program.lines - result.planned


@CALM
@given(machines(axes="XYZ"), programs())
def test_every_table_is_accepted(machine, data):
    machine = ready(machine)
    result = outputs(data, machine, "csv")
    assume(result is not None)
    found = verify_csv(io.BytesIO(data), io.BytesIO(result.output), machine)
    assert found.violations == ()
    assert found.rewritten == result.planned


POINT = re.compile(rb"G1 .*F[0-9.]+")


class Text:
    """An output as lines, and which of them are points or tails of streams."""

    def __init__(self, data, result):
        self.lines = result.output.splitlines(keepends=True)
        kept = set(data.splitlines(keepends=True))
        self.points, self.tails, inside = [], [], False
        for n, line in enumerate(self.lines):
            bare = line.rstrip()
            if bare.startswith(b"(gcodejerk: "):
                inside = True
            elif inside and POINT.fullmatch(bare):
                self.points.append(n)
            elif inside and self.points and self.points[-1] == n - 1:
                self.tails.append(n)
                inside = False
        self.kept = [
            n for n, line in enumerate(self.lines) if line in kept and not POINT.match(line)
        ]

    def sub(self, n, pattern, change):
        """The whole output with something replaced in line n; None if it is not there."""
        after = re.sub(pattern, change, self.lines[n], count=1)
        if after == self.lines[n]:
            return None
        return b"".join([*self.lines[:n], after, *self.lines[n + 1 :]])

    def cut(self, n, *instead):
        return b"".join([*self.lines[:n], *instead, *self.lines[n + 1 :]])


def _scaled(factor):
    def change(match):
        return b"F%.4f" % (float(match[1]) * factor)

    return change


def _shift(steps):
    def change(match):
        places = len(match[2].partition(b".")[2])
        return match[1] + b"%.*f" % (places, float(match[2]) + steps * 10.0**-places)

    return change


AXIS = rb"([XYZABC])(-?[0-9.]+)"

# Each takes a Text, the line of a point (neither first nor last of its stream), and of a tail.
DAMAGE = {
    "feed 1 % up": lambda t, p, e: t.sub(p, rb"F([0-9.]+)", _scaled(1.01)),
    "feed 1 % down": lambda t, p, e: t.sub(p, rb"F([0-9.]+)", _scaled(0.99)),
    "feed of another unit": lambda t, p, e: t.sub(p, rb"F([0-9.]+)", _scaled(60.0)),
    "feed lost": lambda t, p, e: t.sub(p, rb" F[0-9.]+", b""),
    "feed negative": lambda t, p, e: t.sub(p, rb"F", b"F-"),
    "point moved far": lambda t, p, e: t.sub(p, AXIS, _shift(20000)),
    "wrong sign": lambda t, p, e: t.sub(p, rb"([XYZABC])-?(?=[0-9.]*[1-9])", _flip),
    "point dropped": lambda t, p, e: t.cut(p),
    "point doubled": lambda t, p, e: t.cut(p, t.lines[p], t.lines[p]),
    "points swapped": lambda t, p, e: _swap(t, p),
    "point as rapid": lambda t, p, e: t.sub(p, rb"G1", b"G0"),
    "point as arc": lambda t, p, e: t.sub(p, rb"G1", b"G2"),
    "point with another axis": lambda t, p, e: t.sub(p, rb" F", b" W1 F"),
    "point with a switch": lambda t, p, e: t.sub(p, rb" F", b" M8 F"),
    "point without code": lambda t, p, e: t.sub(p, rb"G1 ", b""),
    "point in a comment": lambda t, p, e: t.sub(p, rb"(G1[^\r\n]*)", rb"(\1)"),
    "point with block delete": lambda t, p, e: t.sub(p, rb"G1", b"/G1"),
    "line end of a point": lambda t, p, e: t.sub(p, rb"\r?\n", _other_end),
    "blank line": lambda t, p, e: t.cut(p, b"\n", t.lines[p]),
    "end shifted": lambda t, p, e: t.sub(e - 1, AXIS, _shift(1)),
    "end shifted in a new decimal": lambda t, p, e: t.sub(e - 1, rb"( F)", rb"0000001\1"),
    "end point lost": lambda t, p, e: t.cut(e - 1),
    "tail lost": lambda t, p, e: t.cut(e),
    "tail doubled": lambda t, p, e: t.cut(e, t.lines[e], t.lines[e]),
    "G0 lost": lambda t, p, e: t.sub(e, rb"G0", b""),
    "G0 turned G1": lambda t, p, e: t.sub(e, rb"G0", b"G1"),
    "F not restored": lambda t, p, e: t.sub(e, rb" F[0-9.]+", b""),
    "F restored wrongly": lambda t, p, e: t.sub(e, rb"F([0-9.]+)", _scaled(1.01)),
    "G95 left behind": lambda t, p, e: t.sub(e, rb"G0", b"G0 G95"),
    "G91 left behind": lambda t, p, e: t.sub(e, rb"G0", b"G0 G91 G90"),
    "plane changed": lambda t, p, e: t.sub(e, rb"G0", b"G0 G18"),
    "G61 left behind": lambda t, p, e: t.sub(e, rb"G0", b"G0 G61.1"),
    "motion in the tail": lambda t, p, e: t.sub(e, rb"G0", b"G0 X0"),
    "file cut": lambda t, p, e: b"".join(t.lines[:p]),
    "file cut in a line": lambda t, p, e: b"".join(t.lines[:p]) + t.lines[p][:6],
    "file cut by a byte": lambda t, p, e: b"".join(t.lines)[:-1],
    "byte behind the end": lambda t, p, e: b"".join(t.lines) + b"\n",
    "stamp doubled": lambda t, p, e: t.cut(0, b"(gcodejerk stamp 1)\n", t.lines[0]),
    "comment changed": lambda t, p, e: t.sub(_comment(t, e), rb"gcodejerk: ", b"gcodejerk: Q"),
    "comment opened": lambda t, p, e: t.sub(_comment(t, e), rb"\)", b""),
    "stream of another rapid": lambda t, p, e: _exchange(t),
    "kept line lost": lambda t, p, e: t.cut(t.kept[-1]) if t.kept else None,
    "kept line doubled": lambda t, p, e: (
        t.cut(t.kept[0], *[t.lines[t.kept[0]]] * 2) if t.kept else None
    ),
    "kept line changed": lambda t, p, e: (
        t.sub(t.kept[0], rb"(?=\r?\n|$)", b" ") if t.kept else None
    ),
    "upper case": lambda t, p, e: t.sub(p, rb"G1", b"g1"),
}


def _swap(t, p):
    """Two points exchanged; increments of one speed differ by their rounding only, so not those."""
    one, other = t.lines[p], t.lines[p + 1]
    if one.rpartition(b"F")[2] == other.rpartition(b"F")[2]:
        return None
    return b"".join([*t.lines[:p], other, one, *t.lines[p + 2 :]])


def _flip(match):
    return match[1] + (b"" if match[0].endswith(b"-") else b"-")


def _other_end(match):
    return b"\n" if match[0] == b"\r\n" else b"\r\n"


def _comment(t, e):
    return max(n for n in range(e) if t.lines[n].startswith(b"(gcodejerk: "))


def _exchange(t):
    """The points of two streams of one length, exchanged."""
    runs = []
    for n in t.points:
        if runs and runs[-1][-1] == n - 1:
            runs[-1].append(n)
        else:
            runs.append([n])
    for a in runs:
        for b in runs:
            one, other = (b"".join(t.lines[n] for n in run) for run in (a, b))
            if a[0] < b[0] and one != other:
                between = b"".join(t.lines[a[-1] + 1 : b[0]])
                rest = b"".join(t.lines[b[-1] + 1 :])
                return b"".join(t.lines[: a[0]]) + other + between + one + rest
    return None


@st.composite
def calm_programs(draw):
    """Programs with long rapids of every kind that can be rewritten."""
    lines = [draw(st.sampled_from(["G21 G90 G94 G64 P0.02", "G21 G90 G94 G61", "G20 G90 G94"]))]
    scale = 1 / 25.4 if "G20" in lines[0] else 1.0
    lines += ["F60", "G0 X0 Y0 Z0"]
    for _ in range(draw(st.integers(2, 4))):
        axes = draw(st.lists(st.sampled_from("XYZ"), min_size=1, max_size=3, unique=True))
        mode = draw(st.sampled_from(["G90 ", "G91 ", ""]))
        signs = [draw(st.sampled_from([-1, 1])) * scale / 1000 for _ in axes]
        sizes = [draw(st.integers(500, 90000)) for _ in axes]
        words = [f"{a}{s * n:.4f}" for a, s, n in zip(axes, signs, sizes, strict=True)]
        lines.append(f"{mode}G0 {' '.join(words)}{draw(st.sampled_from(['', ' M8', ' (x)']))}")
        lines.append(draw(st.sampled_from(["G1 X1 F30", "M9", "(cut)", "G1 Y2.5"])))
    newline = draw(st.sampled_from(["\n", "\r\n"]))
    return (newline.join([*lines, "M2"]) + newline).encode()


@pytest.mark.parametrize("name", DAMAGE)
@settings(parent=CALM, max_examples=15)
@given(data=calm_programs(), pick=st.randoms(use_true_random=False))
def test_every_damage_is_noticed(name, data, pick):
    result = process(data, VMC, verify=False)
    text = Text(data, result)
    inner = [n for n in text.points if n - 1 in text.points and n + 2 in text.points]
    assume(inner and text.tails)
    damaged = DAMAGE[name](text, pick.choice(inner), pick.choice(text.tails))
    assume(damaged is not None and damaged != result.output)
    assert verify(data, result.output, VMC).ok
    assert not verify(data, damaged, VMC).ok
