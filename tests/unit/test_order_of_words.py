"""Words beside a rapid that the control runs before its motion, after it, or when the builder says.

And the exact stop, which is about the end of the motion: it stands on the last point.
"""

import re
from dataclasses import replace

import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import DIALECTS
from gcodejerk.reasons import REASONS
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import verify

VMC = Machine.load(find_machine("vmc"))
HEADS = {
    "linuxcnc": "G21 G17 G90 G94 G64 F100",
    "mach": "G21 G17 G90 G94 G64 F100",
    "grbl": "G21 G17 G90 G94 F100",
    "fanuc": "G21 G17 G40 G90 G94 G64 F100.",
    "haas": "G21 G17 G40 G90 G94 G64 F100.",
    "fanuc-lathe-a": "G21 G18 G40 G98 G64 F100.",
    "fanuc-lathe-b": "G21 G18 G40 G90 G94 G64 F100.",
    "siemens": "G710 G17 G40 G90 G94 G64 F100",
}
# What each table says, by hand: before the motion, after it, unknown.
ORDER = {
    "linuxcnc": ([3, 4, 5, 7, 8, 9, 48, 49], [0, 1, 2, 30, 60], [6, 19, 62, 100]),
    "mach": ([3, 4, 5, 7, 8, 9, 48, 49], [0, 1, 2, 30], [6, 10, 100]),
    # M4 is a laser's, and some builds refuse M7
    "grbl": ([3, 5, 8, 9], [0, 1, 2, 30], [7, 56]),
    "fanuc": ([], [0, 1, 2, 30], [3, 4, 5, 7, 8, 9, 6, 19, 29, 60]),
    "haas": ([], [0, 1, 2, 30], [3, 4, 5, 7, 8, 9, 6, 19, 60]),
    "fanuc-lathe-a": ([], [0, 1, 2, 30], [3, 5, 8, 9]),
    "fanuc-lathe-b": ([], [0, 1, 2, 30], [3, 5, 8, 9]),
    "siemens": ([], [0, 1, 2, 30], [3, 4, 5, 7, 8, 9, 17, 40]),
}
CASES = [
    (dialect, m, when)
    for dialect, columns in ORDER.items()
    for when, codes in zip(("before", "after", "unknown"), columns, strict=True)
    for m in codes
]


def machine_for(dialect):
    turned = "X" if "lathe" in dialect else ""
    axes = tuple(replace(a, travel=None, diameter=a.name == turned) for a in VMC.axes)
    start = dict.fromkeys("XYZ", 0.0)
    program = replace(VMC.program, start=start, decimal_point="calculator", startup="")
    return replace(VMC, axes=axes, program=program, dialect=dialect, spindle="mill")


def made(dialect, block, head=None):
    data = f"{head or HEADS[dialect]}\nG0 X0. Z0.\n{block}\nG1 X2. F50.\nM30\n".encode()
    machine = machine_for(dialect)
    result = process(data, machine, dialect=dialect, controller="mach")
    row = [k for k, line in enumerate(result.program.rapids.line.tolist()) if line == 3]
    left = result.plans.reason[row[0]] if row else None
    lines = [x for x in result.output.decode().splitlines() if "gcodejerk" not in x]
    return data, machine, result, lines, left


@pytest.mark.parametrize(("dialect", "m", "when"), CASES)
def test_an_m_code_keeps_its_place_in_time_or_the_rapid_is_left_alone(dialect, m, when):
    data, machine, result, lines, _ = made(dialect, f"G0 X9. M{m}")
    points = [k for k, line in enumerate(lines[:-2]) if line.startswith("G1 ")]
    mine = [k for k, line in enumerate(lines) if re.search(rf"\bM{m}\b", line)]
    if when == "unknown":
        assert f"G0 X9. M{m}" in lines
        return
    assert f"G0 X9. M{m}" not in lines
    place = mine[0]
    assert lines[place] == (f"G0  M{m}" if when == "before" else f"M{m}")
    assert (place < points[0]) == (when == "before")
    if when == "after":
        last = max(k for k in points if lines[k].split()[-2] == "X9.")
        assert place == last + 2
    wrong = list(result.output.decode().splitlines())
    at = next(k for k, line in enumerate(wrong) if line == lines[place])
    moved = wrong[:at] + wrong[at + 1 :]
    other = next(
        k for k, x in enumerate(moved) if x.startswith("G1 X") and not x.startswith("G1 X2.")
    )
    moved.insert(other if when == "after" else len(moved) - 2, lines[place])
    text = re.sub(r" sum:\w{16}", "", "\n".join(moved) + "\n").encode()
    assert not verify(data, text, machine, dialect=dialect).ok


@pytest.mark.parametrize(("dialect", "m", "when"), [case for case in CASES if case[2] == "unknown"])
def test_what_the_table_does_not_know_is_given_as_the_reason(dialect, m, when):
    left = made(dialect, f"G0 X9. M{m}")[4]
    if dialect == "grbl":  # which refuses the whole block, or runs it
        assert str(REASONS[left]) == "block not understood"
    elif m in (3, 4, 5, 7, 8, 9):
        assert str(REASONS[left]) == "other words of the block cannot keep their order"
    else:
        assert left is None or str(REASONS[left]) != ""


def test_tables_name_no_code_twice():
    for dialect in DIALECTS.values():
        assert not dialect.before_m & dialect.after_m


def test_the_spindle_does_not_stop_in_the_cut():
    """`G0 Z50. M5` on a control that stops it behind the motion, or nobody knows when."""
    for dialect in ("fanuc", "haas", "siemens"):
        assert "G0 Z50. M5" in made(dialect, "G0 Z50. M5")[3]
    lines = made("linuxcnc", "G0 Z9. M5")[3]
    assert lines.index("G0  M5") < next(k for k, x in enumerate(lines) if x.startswith("G1 Z"))


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "siemens"])
@pytest.mark.parametrize("block", ["G0 X9. G9", "G9 G0 X9.", "G0 G9 X9. (stop)"])
def test_g9_stands_on_the_last_point(dialect, block):
    if dialect == "siemens":
        block = block.replace("(stop)", "; stop")
    data, machine, result, lines, _ = made(dialect, block)
    points = [x for x in lines if x.startswith("G1 ")][:-1]
    assert points[-1].startswith("G1 G9 X9. F")
    assert sum("G9 " in x for x in lines) == 1
    lost = re.sub(rb" sum:\w{16}", b"", result.output).replace(b"G1 G9 X9.", b"G1 X9.")
    assert not verify(data, lost, machine, dialect=dialect).ok


@pytest.mark.parametrize(
    ("dialect", "head", "code"),
    [
        ("linuxcnc", "G21 G17 G90 G94 G61 F100", "G61"),
        ("linuxcnc", "G21 G17 G90 G94 G61.1 F100", "G61.1"),
        ("mach", "G21 G17 G90 G94 G61 F100", "G61"),
        ("fanuc", "G21 G17 G40 G90 G94 G61 F100.", "G61"),
        ("siemens", "G710 G17 G40 G90 G94 G60 F100", "G60"),
        ("siemens", "G710 G17 G40 G90 G94 G60 G601 F100", "G60"),
    ],
)
def test_an_exact_stop_in_force_is_back_for_the_last_point(dialect, head, code):
    _, _, _, lines, _ = made(dialect, "G0 X9.", head)
    assert "G64" in lines
    last = next(k for k, x in enumerate(lines) if x.startswith(f"G1 {code} X9. F"))
    assert lines[last + 1].startswith("G0 F")
    assert not any("G6" in x for x in lines[last + 1 :])


def test_fanuc_and_haas_check_the_position_after_every_rapid():
    for dialect in ("fanuc", "haas"):
        assert any(x.startswith("G1 G9 X9. F") for x in made(dialect, "G0 X9.")[3])
    assert not any("G9 " in x for x in made("siemens", "G0 X9.")[3])


def test_a_word_with_an_equals_sign_is_the_word_without_it():
    program = "G710 G17 G40 G90 G94 G64 F100\nG0 X0 Y0 Z5\nG0 X=3 Y = +5\nG91 X=-2. Y = 7\nM30\n"
    machine = machine_for("siemens")
    made = process(program.encode(), machine, controller="siemens", dialect="siemens")
    assert (made.planned, made.verification.ok) == (3, True)
    written = made.output.decode().splitlines()
    assert any(line.startswith("G1 X3 Y+5 F") for line in written)
    assert not any("=" in line for line in written if line.startswith("G1"))


@pytest.mark.parametrize(
    ("word", "restored"), [("F0", "F0"), ("F0.", "F0.0"), ("F700", "F700"), ("F700.", "F700.0")]
)
def test_f_is_restored_as_it_was_written_with_a_point_or_without(word, restored):
    program = f"{HEADS['fanuc']} {word}\nG0 X0. Y0. Z0.\nG0 X-9.\nG1 X-12.\nM30\n"
    program = program.replace(" F100.", "").encode()
    result = process(program, VMC, dialect="fanuc", controller="fanuc")
    assert result.planned == 1
    lines = result.output.decode().split("\n")
    assert lines[lines.index("G1 X-12.") - 1].split()[-1] == restored
    assert verify(program, result.output, VMC).ok
