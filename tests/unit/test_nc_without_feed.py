"""grbl refuses a feed move of which no F was ever said (error 22), and senders have gone on."""

import io
from dataclasses import fields
from random import Random

import numpy as np
import pytest

from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm, observations

HEAD = b"G21 G90 G94 G17 G54\nG0 X0\nG0 Y0\nG0 Z5\n"
START = Start(spindle="mill")
LOST = {
    "G1": b"G1 X5\n",
    "G1 in a run": b"G1 X5\n" + b"X4\nX5\n" * 30,
    "modal": b"G1 F0\nX5\n",
    "F0": b"G1 X1 F100\nG1 X5 F0\n",
    "F0 in a run": b"G1 X1 F100\n" + b"X2\nX3\n" * 9 + b"X4 F0.\n" + b"X2\nX3\n" * 9,
    "an arc": b"G2 X5 I2.5\n",
    "G93 before": b"F100\nG93\nG94\nG1 X5\n",
}
SURE = {
    "F beside": b"G1 X5 F100\n",
    "F in front": b"F100\nG1 X5\n",
    "F beside G0": b"G0 X1 F100\nG1 X5\n",
    "inches": b"G1 X1 F100\nG20\nG21\nG1 X5 F100\n",
    "the axis is stated by a rapid": b"G1 X5\nG0 X7\nG0 Y3\nG0 Z4\n",
}


def last(text, dialect):
    """Why the last rapid is left alone; and where the second reading believes it to start."""
    rapids = read_program(io.BytesIO(text), dialect=dialect, start=START).rapids
    lines = [int(rapids.line[-1])]
    ((_, seen),) = observations(io.BytesIO(text), find_dialect(dialect), START, lines)
    found = Findings(100)
    confirm(io.BytesIO(text), dialect, START, rapids, [len(rapids) - 1], found)
    reason = rapids.reason[-1]
    return None if reason == CERTAIN else REASONS[reason], seen.start[0], found.violations


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize("name", LOST)
def test_behind_a_feed_move_without_f_nobody_knows_where_the_axis_stands(name, dialect):
    reason, start, wrong = last(HEAD + LOST[name] + b"F100\nG0 X9\n", dialect)
    assert reason == Reason.START_UNKNOWN
    assert start != start
    assert not wrong


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize("name", SURE)
def test_with_an_f_it_is_certain(name, dialect):
    reason, start, wrong = last(HEAD + SURE[name] + b"F100\nG0 X9\n", dialect)
    assert reason is None
    assert not wrong
    assert start == start


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize("front", [b"", b"G0 X1\nG0 X2\nG0 X3\nG0 X4\nG0 X5\n"])
def test_a_g1_that_is_stated_without_f_is_refused_though_nothing_moves(dialect, front):
    reason, _, wrong = last(HEAD + front + b"G91 G1\nG0 X9\n", dialect)
    assert reason == Reason.DISTANCE_MODE_UNKNOWN
    assert not wrong
    text = HEAD + front + b"G1\nX7 Y0 Z5 F100\nG0 X9\n"
    assert last(text, dialect)[0] == Reason.START_UNKNOWN  # refused, X7 may have been a rapid
    assert last(text.replace(b"X7", b"G1 X7"), dialect)[0] is None


@pytest.mark.parametrize("dialect", ["linuxcnc", "mach", "marlin", "klipper"])
def test_other_controls_stop_or_go_on_with_a_feed_of_their_own(dialect):
    text = b"G21\nG90\nG0 X0 Y0 Z5\nG1 X5\nG0 X9\n"
    rapids = read_program(io.BytesIO(text), dialect=dialect, start=START).rapids
    assert rapids.start[-1][0] == 5.0


def test_the_first_of_them_is_named():
    text = HEAD + b"G1 X5\nG1 X6\nG0 X9\n"
    found = read_program(io.BytesIO(text), dialect="grbl", start=START).findings
    assert [one.line for one in found if "without F" in one.message] == [5]


def drawn(random, count):
    """Lines without F, of few places, so that moves to where the axis stands are among them."""
    out = []
    for _ in range(count):
        code = random.choice(["", "", "", "G0 ", "G1 ", "G0", "G2 ", "G3"])
        words = "".join(
            f"{axis}{random.choice(['0', '5', '5.0', '-1', '1'])} "
            for axis in random.sample("XYZ", random.choice([0, 1, 1, 2, 3]))
        )
        arc = code[:2] in ("G2", "G3") or (not code and random.random() < 0.05)
        words += random.choice(["I1 J0", "I0", "R5", ""]) if arc else ""
        out.append(code + words or "G1")
    return out


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize("seed", range(25))
def test_the_quick_way_and_the_careful_one_leave_the_same(dialect, seed):
    random = Random(seed)
    lines = ["G21 G90 G94 G17 G54", "G0 X0", "G0 Y0", "G0 Z5", "G1 Z5", "X0"]
    for _ in range(4):
        lines += drawn(random, random.choice([5, 40, 120]))
        lines += [random.choice(["G0 X1", "M5", "G1 X3 F100", "F0", "G91", "G90", "(c)", "M3 S9"])]
    text = "\n".join([*lines, "G0 X2", "F100", "G0 X9", ""]).encode()
    resume = random.choice(["same", "unknown"])
    start = Start(spindle=random.choice(["mill", None]), resume=resume)
    quick, careful = (
        read_program(io.BytesIO(text), dialect=dialect, start=start, fast=fast)
        for fast in (True, False)
    )
    for column in fields(quick.rapids):
        mine, other = (getattr(one.rapids, column.name) for one in (quick, careful))
        assert np.array_equal(mine, other, equal_nan=mine.dtype.kind == "f"), column.name
    assert quick.findings == careful.findings
    found = Findings(100)
    certain = np.flatnonzero(quick.rapids.reason == CERTAIN)
    confirm(io.BytesIO(text), dialect, start, quick.rapids, certain, found)
    assert not found.violations


@pytest.mark.parametrize("seed", range(25))
def test_a_run_without_f_leaves_no_more_than_its_lines(seed):
    """Of the second reading: what it believes behind a run, it believes behind single lines."""
    random = Random(seed)
    body = "\n".join(drawn(random, 60))
    head = "G21 G90 G94 G17 G54 G0 X0 Y0 Z5\nG0 X1\n" + random.choice(["G1 Z5\n", ""])
    seen = []
    for end in ("\n", " ;c\n"):  # a comment keeps lines from being taken at once
        text = (head + body).replace("\n", end) + "\nG0 X9\n"
        at = text.count("\n")
        ((_, one),) = observations(io.BytesIO(text.encode()), find_dialect("grbl"), START, [at])
        seen.append((one.start, one.modes))
    (run, modes), (lines, own) = seen
    assert all(a == b or a != a for a, b in zip(run, lines, strict=True))
    assert all(modes[name] in (None, own[name]) or modes[name] != modes[name] for name in own)
