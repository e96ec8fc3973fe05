"""Override guard: the text around streams, the programs that have no room for it, and damage."""

import re

import pytest

from gcodejerk import EmitError, Machine, process
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.verification import verify

TEXT = """
interval: 0.001
positioning: linear
axes:
  X:
    resolution: 0.001
    rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 22, damping: 0.02}]
  Z:
    resolution: 0.001
    rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 30, damping: 0.02}]
program: {start: {X: 0, Z: 0}}
"""
PLAIN = Machine.loads(TEXT)
MACHINE = Machine.loads(TEXT + "controller_options: {override_guard: true}\n")
HEAD = b"G21 G90 G94 G64 F250\n"
ONE = HEAD + b"G1 X1\nN7 G0 x 9. Z-5 M8 (go)\nG1 X10\nM2\n"


def stream_of(program, machine=MACHINE):
    """Lines that took the place of the one rapid of a program."""
    result = process(program, machine)
    assert result.planned == 1
    begin, end, _ = result.edits[-1]
    return result.output[begin:end].splitlines()


def test_a_guarded_stream_is_the_stream_of_a_drained_queue_and_the_block_itself():
    lines = stream_of(ONE)
    drained = HEAD + b"G1 X1\nG4 P0\nN7 G0 x 9. Z-5 M8 (go)\nG1 X10\nM2\n"
    unguarded = stream_of(drained, PLAIN)
    assert lines == [
        b"(gcodejerk: N7 G0 x9. Z-5 M8)",
        b"N7 G0   M8 (go)",
        b"M66 E3 L0",
        b"o<gcodejerk-3> if [#5399 GT 0.5]",
        *unguarded[2:],
        b"o<gcodejerk-3> else",
        b"G0 X9. Z-5",
        b"o<gcodejerk-3> endif",
    ]
    assert unguarded[-2:] == [b"G0 X9. Z-5", b"F250.0"]


@pytest.mark.parametrize(
    ("block", "own", "behind"),
    [
        (b"G91 G0 X.5 Z-2", b"G0 X.5 Z-2", []),
        (b"G0 X4 M0", b"G0 X4", [b"M0"]),
        (b"X4 Z3", b"G0 X4 Z3", []),
        (b"G93 G0 X4", b"G0 X4", []),
    ],
)
def test_the_other_branch_is_the_block_as_it_is_written(block, own, behind):
    lines = stream_of(HEAD + b"G1 X1\nG0\n" + block + b"\nG94 G90 G1 X3 F9\nM2\n")
    assert lines[-3 - len(behind) :] == [
        b"o<gcodejerk-4> else",
        own,
        b"o<gcodejerk-4> endif",
        *behind,
    ]


def test_every_rapid_has_a_name_of_its_own_and_line_ends_are_kept():
    program = (HEAD + b"G0 X5\nG0 X9 Z5\nG1 X10\nG0 X0").replace(b"\n", b"\r\n")
    output = process(program, MACHINE).output
    assert re.findall(rb"o<gcodejerk-(\d+)> if", output) == [b"2", b"3", b"5"]
    assert output.endswith(b"o<gcodejerk-5> endif")
    assert output.count(b"\n") == output.count(b"\r\n")
    assert b"streams behind an override guard" in output


@pytest.mark.parametrize(
    "line",
    [
        b"#1 = #5399",
        b"G1 X[# 5399 + 1]",
        b"(debug, input #5399)",
        b"#1 = ##2",
        b"#[5000+399] = 1",
        b"M66 P0 L3 Q1",
        b"m 066 P0 L0",
        b"M66.0 P0 L0",
        b"M+65.99999 P0 L0",
        b"#1 = #5398.99999",
        b"M[60+6] P0 L0",
        b"M98 P100",
        b"o<probe> call",
        b"o[#1] call",
        b"o<gcodejerk-2> call",
    ],
)
def test_programs_that_may_use_what_the_guard_does_are_refused(line):
    program = HEAD + b"G0 X5\n" + line + b"\nG1 X6\nG0 X0\nM2\n"
    with pytest.raises(EmitError, match="no override guard can stand") as caught:
        process(program, MACHINE)
    assert caught.value.place.line == 3
    guarded = process(HEAD + b"G0 X5\nG1 X6\nG0 X0\nM2\n", MACHINE).output
    damaged = guarded.replace(b"G1 X6\n", line + b"\nG1 X6\n")
    if b"call" not in line and b"M98" not in line and not line.startswith(b"M["):
        assert not verify(program, damaged, MACHINE).ok


@pytest.mark.parametrize(
    ("code", "says"), [("M97", "calls"), ("M98", "calls"), ("M99", "leads back")]
)
def test_the_refusal_names_the_code_that_stands_there(code, says):
    with pytest.raises(EmitError, match=f"{code} {says}") as caught:
        process(HEAD + b"G0 X5\n%b P100\nG0 X0\nM2\n" % code.encode(), MACHINE)
    assert ("end the program with M2 or M30" in str(caught.value)) == (code == "M99")


@pytest.mark.parametrize(
    "line",
    [b"(#### [roughing] ####)", b"; see ##2, M66", b"#1 = 5399", b"#<_m66> = 2", b"#53991=1"],
)
def test_what_only_looks_like_it_is_not_refused(line):
    assert process(HEAD + b"G0 X5\n" + line + b"\nG1 X6\nG0 X0\nM2\n", MACHINE).planned == 2


def test_rapids_within_structures_are_left_alone():
    program = HEAD + b"G0 X5\nO100 if [1 GT 0]\nG0 X9\no 100 endif\nG0 X2\nM2\n"
    assert process(program, PLAIN).planned == 3
    result = process(program, MACHINE)
    assert result.plans.planned.tolist() == [True, False, True]
    assert REASONS[result.plans.reason[1]] is Reason.SUBPROGRAM
    unguarded = process(program, PLAIN).output
    assert not verify(program, unguarded, MACHINE).ok


def test_other_dialects_and_controllers_are_refused():
    with pytest.raises(EmitError, match="read as fanuc"):
        process(HEAD + b"G0 X5.\nM2\n", MACHINE, dialect="fanuc")
    for controller in ("grbl", "linuxcnc-hal"):
        with pytest.raises(EmitError, match="cannot write"):
            process(HEAD + b"G0 X5\nM2\n", MACHINE, controller=controller)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"M66 E3 L0\n", b""),
        (b"M66 E3 L0\n", b"M66 E2 L0\n"),
        (b"M66 E3 L0\n", b"M66 P3 L0\n"),
        (b"if [#5399 GT 0.5]", b"if [#5399 LT 0.5]"),
        (b"o<gcodejerk-3> if", b"o<gcodejerk-4> if"),
        (b"o<gcodejerk-3> else\n", b""),
        (b"else\nG0 X9. Z-5\n", b"else\n"),
        (b"else\nG0 X9. Z-5\n", b"else\nG0 X9. Z-6\n"),
        (b"else\nG0 X9. Z-5\n", b"else\nG1 X9. Z-5\n"),
        (b"else\nG0 X9. Z-5\n", b"else\nG0 X9. Z-5\nG0 X9. Z-5\n"),
        (b"o<gcodejerk-3> endif\n", b""),
        (b"o<gcodejerk-3> endif\n", b"o<gcodejerk-3> endif\no<gcodejerk-3> endif\n"),
        (b"F250.0\n", b""),
    ],
)
def test_damage_to_a_guard_is_found(old, new):
    output = process(ONE, MACHINE).output
    assert verify(ONE, output, MACHINE).ok
    damaged = output.replace(old, new, 1)
    assert damaged != output
    # The sum in the stamp would tell as well: it is not what is tried here.
    stamp = re.compile(rb"\(gcodejerk stamp[^\n]*\n\([^\n]*\n")
    found = verify(stamp.sub(b"", ONE), stamp.sub(b"", damaged), MACHINE)
    assert verify(ONE, stamp.sub(b"", output), MACHINE).ok
    assert not found.ok


def test_a_name_that_stands_twice_is_found():
    program = HEAD + b"G0 X5\nG1 X6\nG0 X0\nM2\n"
    output = process(program, MACHINE).output
    assert not verify(program, output.replace(b"o<gcodejerk-4>", b"o<gcodejerk-2>"), MACHINE).ok


def test_streams_without_a_guard_are_none_of_a_machine_that_wants_one():
    output = process(ONE, PLAIN, controller="linuxcnc").output
    assert not verify(ONE, output, MACHINE).ok


def test_a_guarded_program_is_read_again_and_leads_to_the_same_place():
    output = process(ONE, MACHINE).output
    again = process(output, PLAIN, force=True)
    rapids = again.program.rapids
    assert again.program.findings == ()
    assert rapids.target[-1, 0] == pytest.approx(9.0)
    with pytest.raises(EmitError, match="no override guard"):
        process(output, MACHINE, force=True)
