"""Nothing is written beyond the longest line of the control; what would not fit is left alone."""

import re
from dataclasses import replace

import pytest

from gcodejerk.emit.fits import line_limit
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import DIALECTS
from gcodejerk.reasons import REASONS
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import Kind, verify

VMC = Machine.load(find_machine("vmc"))
MACHINE = replace(VMC, axes=tuple(replace(a, travel=None) for a in VMC.axes))
HEADS = {
    "linuxcnc": ("G21 G17 G90 G94 G64 F100", ""),
    "mach": ("G21 G17 G90 G94 G64 F100", ""),
    "grbl": ("G21 G17 G90 G94 F100", ""),
    "fanuc": ("G21 G17 G40 G90 G94 G64 F100.", ""),
    "siemens": ("G710 G17 G40 G90 G94 G64 F100", ""),
    "marlin": ("G21\nG90\nG0 X0 Y0 Z0 F30000", "marlin"),
}


def process_in(dialect, block):
    head, _ = HEADS[dialect]
    program = replace(
        MACHINE.program, start=dict.fromkeys("XYZ", 0.0), decimal_point="calculator", startup=""
    )
    machine = replace(MACHINE, program=program, dialect=dialect)
    data = f"{head}\nG0 X0. Y0. Z0.\n{block}\nM30\n".encode()
    return data, machine, process(data, machine, dialect=dialect, controller="mach")


def padded(dialect, size):
    """A rapid's block of this length, most of it one number."""
    front, back = "G0 X9.", " Y5."
    return front + "0" * (size - len(front) - len(back)) + back


@pytest.mark.parametrize("dialect", HEADS)
def test_no_line_that_is_written_is_longer_than_the_limit(dialect):
    limit = line_limit(DIALECTS[dialect])
    planned = []
    for size in {12, 60, 79, *range(max(20, limit - 30), limit + 1, 3), limit}:
        if size > limit:
            continue
        data, _, result = process_in(dialect, padded(dialect, size))
        originals = set(data.splitlines())
        for line in result.output.splitlines():
            assert line in originals or len(line) <= limit, line
        rewritten = padded(dialect, size).encode() not in result.output.splitlines()
        planned.append((size, rewritten))
    assert any(rewritten for _, rewritten in planned)
    assert not max(planned)[1], "a block as long as the limit has no room for F"


def test_the_reason_is_the_line():
    _, _, result = process_in("linuxcnc", padded("linuxcnc", 247))
    assert str(REASONS[result.plans.reason[-1]]) == "line or number too long for the control"
    _, _, result = process_in("linuxcnc", padded("linuxcnc", 200))
    assert result.plans.planned[-1]


def test_other_words_that_leave_no_room_are_left_alone():
    """grbl reads 80 characters; the line with the block's other words would have more."""
    block = "G0 X9. M8 (" + "c" * 75 + ")"
    _, _, result = process_in("grbl", block)
    assert block.encode() in result.output.splitlines()


def test_verify_refuses_lines_that_are_too_long_and_not_the_originals():
    data, machine, result = process_in("linuxcnc", "G0 X9. Y5.")
    good = re.sub(rb" sum:\w{16}", b"", result.output)
    assert verify(data, good, machine, dialect="linuxcnc").ok
    stamp = re.sub(rb"(gcodejerk stamp [^)]*)", rb"\1" + b"x" * 240, good)
    assert {v.kind for v in verify(data, stamp, machine, dialect="linuxcnc").violations} == {
        Kind.STAMP
    }
    for before, after in (
        (b"G4 P0\n", b"G4 P0" + b" " * 260 + b"\n"),
        (b"G0 F100.0\n", b"G0 F100.0" + b" " * 260 + b"\n"),
        (b"G1 X9. Y5. F", b"G1 X9. Y5. " + b" " * 260 + b"F"),
    ):
        assert before in good
        found = verify(data, good.replace(before, after, 1), machine, dialect="linuxcnc")
        assert not found.ok
    long = data.replace(b"M30", b"(" + b"x" * 230 + b")\nM30")
    made = process(long, machine, dialect="linuxcnc")
    assert verify(long, made.output, machine, dialect="linuxcnc").ok


def test_expanded_cycles_stay_within_the_limit():
    hole = "G81 X9." + "0" * 100 + " Y5." + "0" * 100 + " Z-3. R2."
    data = f"G21 G17 G90 G94 G98 G64 F100\nG0 X0 Y0 Z5\n{hole}\nX12.\nG80\nM2\n".encode()
    program = replace(MACHINE.program, start=dict.fromkeys("XYZ", 0.0))
    machine = replace(MACHINE, program=program)
    result = process(data, machine, expand_cycles=True)
    assert max(map(len, result.output.splitlines())) <= 254
