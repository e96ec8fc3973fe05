"""Feed moves that the user has said to be rapids: which ones, and what is behind them."""

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as drawn
from hypothesis import strategies as st

from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import find_dialect, read_program
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.rewrite.pipeline import process
from gcodejerk.start import RapidFeed, Start
from gcodejerk.verification import verify
from gcodejerk.verification.second_reading.agreement import observations

TOP = b"G21 G90 G94 G64 G17 G40 G49 G54\nG0 X0 Y0\nG0 Z15\n"
SAID = RapidFeed(5000.0, 5.0)
PROGRAM = TOP + (
    b"G1 X20 Y10 F5000\nZ5\nZ1 F300\nG2 X22 Y8 I2 J0 F400\nG1 X40\nG1 Z15 F5000\nX60\n"
    b"N7 Z5 (down) \nZ-1 F300\nX70\nM2\n"
)
ALL = Machine.load(find_machine("vmc"))
ALL = replace(ALL, spindle="mill")
MACHINE = replace(ALL, rapid_feed=SAID)


def rows(program, said=SAID, dialect="linuxcnc"):
    """Line and reason of each feed move that counts as a rapid."""
    found = read_program(io.BytesIO(program), dialect=dialect, start=Start(rapid_feed=said)).rapids
    return [
        (int(found.line[i]), None if found.reason[i] == CERTAIN else REASONS[found.reason[i]])
        for i in np.flatnonzero(found.fed)
    ]


def test_moves_at_that_feed_and_high_enough_are_rapids():
    assert rows(PROGRAM) == [(4, None), (5, None), (10, None), (11, None)]
    assert rows(PROGRAM, None) == []


@pytest.mark.parametrize(
    ("block", "counts"),
    [
        (b"G1 X9 F5000", True),
        (b"G1 X9 F5000.0", True),
        (b"G1 X9 F4999.9", False),
        (b"G1 X9", False),  # F is not known
        (b"G1 Z5 F5000", True),
        (b"G1 Z4.99 F5000", False),
        (b"G1 X9 Z4 F5000", False),
        (b"G0 X9 F5000", False),  # a rapid by itself
        (b"G2 X9 I4 F5000", False),
        (b"G93 G1 X9 F5000", False),
        (b"G95 G1 X9 F5000", False),
        (b"G1 X9 F#1", False),
        (b"G20 G1 X.2 F5000", False),  # Z15 is 0.59 in
        (b"G91 G1 Z-10 F5000", True),
        (b"G91 G1 Z-11 F5000", False),
        (b"G1 Z#3 F5000", False),
    ],
)
def test_what_counts(block, counts):
    assert bool(rows(TOP + block + b"\nM2\n")) is counts


def test_in_inches_both_numbers_are_inches():
    program = b"G20 G90 G94 G64\nG0 X0 Y0 Z1\nG1 X2 F200\nZ.2\nZ.19\nM2\n"
    assert rows(program, RapidFeed(200.0, 0.2)) == [(3, None), (4, None)]


def test_without_a_known_height_nothing_counts():
    assert rows(b"G21 G90 G94 G64\nG0 X0 Y0\nG1 X5 F5000\nM2\n") == []


@pytest.mark.parametrize(
    ("before", "reason"),
    [
        (b"G41 D1", Reason.CUTTER_COMPENSATION),
        (b"M2", Reason.AFTER_END),
        (b"o1 if [1]", Reason.SUBPROGRAM),
    ],
)
def test_what_speaks_against_a_rapid_speaks_against_these(before, reason):
    found = rows(TOP + before + b"\nG1 X9 F5000\n" + b"M2\n")
    assert reason in [why for _, why in found] or found == []


HEADS = {
    "linuxcnc": b"G21 G90 G94 G64 G17 G40 G49 G54",
    "fanuc": b"G21 G90 G94 G64 G17 G40 G49 G54",
    "haas": b"G21 G90 G94 G64 G17 G40 G49 G54",
    "mach": b"G21 G90 G94 G64 G17 G40 G49 G54",
    "grbl": b"G21 G90 G94 G17 G40 G54",
    "siemens": b"G710 G90 G94 G64 G17 G40 G54",
}


def program_for(controller):
    """The program as a control reads it: a decimal point in every length, its own comments."""
    program = PROGRAM.replace(HEADS["linuxcnc"], HEADS[controller])
    program = program.replace(b"(down)", b"") if controller == "siemens" else program
    return re.sub(rb"([XYZIJ]-?\d+)(?![\d.])", rb"\1.", program)


@pytest.mark.parametrize("controller", HEADS)
def test_output_is_proven_and_g1_and_its_feed_are_in_force_behind_it(controller):
    program = program_for(controller)
    machine = replace(MACHINE, controller=controller, dialect=controller)
    result = process(program, machine)
    fed = [i for i, rapid in enumerate(result.rapids) if result.program.rapids.fed[i]]
    assert [result.rapids[i].rewritten for i in fed].count(True) >= 3
    assert result.verification.confirmed == result.verification.rewritten
    assert verify(program, result.output, machine).ok
    # Who is not told sees feed moves that were changed.
    assert not verify(program, result.output, replace(machine, rapid_feed=None)).ok
    lines = result.output.splitlines()
    behind = lines.index(next(line for line in lines if line.startswith(b"Z1")))
    tail = lines[behind - 1]
    assert tail.split()[-1] in (b"F5000", b"F5000.", b"F5000.0")
    assert tail.startswith(b"G1") == (controller == "linuxcnc")
    # The time is that of the feed, no shorter.
    for i in fed:
        if result.rapids[i].time is not None:
            length = np.linalg.norm(list(result.rapids[i].displacement.values()))
            assert result.rapids[i].time >= length / (5000.0 / 60.0)


@pytest.mark.parametrize("controller", ["linuxcnc", "mach"])
@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"F5000.0\nZ1 F300", b"F300\nZ1 F300"),
        (b"F5000.0\nZ1 F300", b"G0 F5000.0\nZ1 F300"),
        (b"F5000.0\nZ1 F300", b"G2 F5000.0\nZ1 F300"),
        (b"F5000.0\nZ1 F300", b"Z1 F300"),
    ],
)
def test_a_tail_that_leaves_something_else_in_force_is_refused(controller, old, new):
    machine = replace(MACHINE, controller=controller, dialect=controller)
    output = process(PROGRAM, machine).output
    old = b"G1 " + old if controller == "linuxcnc" else old
    assert output.count(old) == 1
    found = verify(PROGRAM, output.replace(old, new), machine)
    assert not found.ok
    assert "stamp" not in {violation.kind.value for violation in found.violations[:1]}


def test_a_program_is_as_before_where_nothing_is_said():
    plain = process(PROGRAM, ALL)
    assert not plain.program.rapids.fed.any()
    assert b"X60\nN7 Z5 (down) \nZ-1" in plain.output
    note = TOP.replace(b"G0", b"G1 F5000") + PROGRAM.removeprefix(TOP)
    assert process(note, ALL).output == note
    assert any("--rapid-feed 5000 --rapid-clearance 15" in n for n in process(note, ALL).notes)


def test_the_stamp_is_another_one():
    def stamped(machine):
        return process(PROGRAM, machine).output.splitlines()[0].split()[3]

    other = replace(ALL, rapid_feed=RapidFeed(5000.0, 6.0))
    assert len({stamped(MACHINE), stamped(ALL), stamped(other)}) == 3


@pytest.mark.parametrize(
    ("change", "options", "says"),
    [
        ({}, {"expand_cycles": True}, "does not go together with --expand-cycles"),
        ({}, {"controller": "linuxcnc-hal"}, "whose G0 the control runs unseen"),
        ({}, {"controller": "klipper", "form": "parameters"}, "no block is rewritten"),
        ({}, {"dialect": "marlin", "controller": "marlin"}, "is for mills"),
    ],
)
def test_what_knows_g0_alone_is_refused(change, options, says):
    with pytest.raises(EmitError, match=says):
        process(PROGRAM, replace(MACHINE, **change), **options)


def test_a_guard_is_refused():
    options = replace(MACHINE.controller_options, override_guard=True)
    with pytest.raises(EmitError, match="other branch is a G0"):
        process(PROGRAM, replace(MACHINE, controller_options=options))


def test_the_command_line_takes_both_numbers_or_none(command, tmp_path):
    (tmp_path / "part.ngc").write_bytes(PROGRAM)
    both = ("--rapid-feed", "5000", "--rapid-clearance", "5")
    assert command("process", "part.ngc", "-m", "vmc", *both[:2])[0] == 2
    assert command("process", "part.ngc", "-m", "vmc", *both[2:])[0] == 2
    assert command("process", "part.ngc", "-m", "vmc", "--rapid-feed", "-1", *both[2:])[0] == 2
    status, said = command("process", "part.ngc", "-m", "vmc", *both)
    assert status == 0
    assert "6 rapids" in said
    status, said = command("verify", "part.ngc", "part.jerk.ngc", "-m", "vmc", *both)
    assert status == 0, said
    assert "note" not in said
    assert command("verify", "part.ngc", "part.jerk.ngc", "-m", "vmc")[0] == 1
    assert "left alone" in command("inspect", "part.ngc", "-m", "vmc", *both)[1]
    assert "(gcodejerk: X60)" in command("filter", "-m", "vmc", *both, "part.ngc")[1]


BLOCKS = st.sampled_from(
    [
        *(b"G0 X%d" % n for n in (1, 30)), b"G0 Z20", b"G1 X9 F5000", b"X2", b"Y7", b"Z5", b"Z15",
        b"Z2", b"F5000", b"F300", b"G1 Z5 F5000", b"G1 Z1 F300", b"G2 X5 Y5 R9", b"G91", b"G90",
        b"G91 G1 Z-4", b"G20", b"G21", b"G93 G1 X3 F5000", b"G94", b"G43 Z12 H1", b"G28", b"G92 Z3",
        b"G81 X5 Z1 R6", b"G80", b"G41 D1", b"G40", b"M6 T1", b"M3 S100", b"#1=5", b"G1 Z#1",
        b"G53 G1 Z0", b"/G1 X8 F5000", b"G1 X1. Y2. Z9.5", b"M0", b"G61", b"G64", b"G1",
    ]
)  # fmt: skip


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "mach"])
@drawn(max_examples=60)
@given(blocks=st.lists(BLOCKS, min_size=4, max_size=24))
def test_both_readers_count_the_same_moves(dialect, blocks):
    program = TOP + b"\n".join(blocks) + b"\nM2\n"
    said = RapidFeed(5000.0, 5.0)
    counted = dict(rows(program, said, dialect))
    start, lines = Start(rapid_feed=said), list(range(1, program.count(b"\n") + 1))
    seen = observations(io.BytesIO(program), find_dialect(dialect), start, lines)
    for line, (_, told) in zip(lines, seen, strict=False):
        if counted.get(line, "no") is None:
            assert not told.against, (line, told.against)
        if told.sure and told.modes.get("motion") == 1:
            unit = told.modes["unit"]
            assert (told.modes["F"], told.modes["feed mode"]) == (5000.0, 94)
            assert min(told.start[2], told.end[2]) / unit >= 5.0 - 1e-6
