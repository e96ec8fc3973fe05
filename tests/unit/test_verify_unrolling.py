"""Damage to programs whose loops and calls were written out: every kind is noticed."""

import io
import re
from dataclasses import replace

import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.expanded import Front, verify_written
from gcodejerk.rewrite.pipeline import process
from gcodejerk.start import NOTHING_KNOWN, Start
from gcodejerk.unrolling.unrolling import unroll
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.unrolling.checking import NotFollowedError, check_unrolling

VMC = Machine.load(find_machine("vmc"))
LINUXCNC = b"""G21 G90 G94 G64 P0.01 G17
#1=0 #<_shared>=2 #<unset>=[#5420]
o100 sub
G0 X[#1*30] Y#<_shared> (DEBUG,at #1)
G1 Z-1 F300
#<_shared>=[#<_shared>+#2]
#2=9
o100 endsub
G0 X0 Y0 Z20
o101 while [#1 LT 3]
o100 call [#1] [1.5]
/G0 Z20
o102 if [#1 EQ 1]
G0 A10
o102 else
G91 G0 Z1
G90
o102 endif
(MSG,next)
#1=[#1+1]
o101 endwhile
o103 repeat [2]
G0 X#1 Z7
o103 endrepeat
M2
"""
FANUC = b"""%
O1000 (TEST)
G21 G90 G94 G17 G40 G49 G80 F500.
G0 X0. Y0. Z50.
#1=0
WHILE [#1 LT 3] DO1
N10 G0 X[#1*20.] (HOLE)
M98 P2000
#1=#1+1
END1
G65 P3000 A5. B10. Z-3.
IF [#1 EQ 3] GOTO 30
G0 X999.
N30 G0 Z50.
M30
O2000
G0 Z2.
G1 Z-1. F100.
M99
O3000
#10=0
G0 X[#1+#10] Y#2
#100=#1
G1 Z#26 F200.
M99
%
"""
SIEMENS = b"""%_N_TEST_MPF
DEF REAL DEPTH=5
N10 G90 G71 G17 G40 G64 F100
N20 G0 X0 Y0 Z50
R1=0
WHILE R1<3
N40 G0 X=R1*20 ; hole
DRILL(R1, DEPTH+1)
R1=R1+1
ENDWHILE
FOR R2=1 TO 3
G0 Y=R2*10
ENDFOR
N60 M30
%_N_DRILL_SPF
PROC DRILL(REAL PLACE, REAL DEEP)
G0 Z=DEEP
N20 G1 Z=-DEEP X=IC(PLACE)
R5=DEEP
RET
"""
PROGRAMS = {"linuxcnc": LINUXCNC, "fanuc": FANUC, "haas": FANUC, "siemens": SIEMENS}


def written(data, dialect, start=NOTHING_KNOWN, comments=False):
    target = io.BytesIO()
    found = unroll(io.BytesIO(data), target, dialect=dialect, start=start, comments=comments)
    assert found.written, found.findings
    return target.getvalue()


def check(data, result, dialect, start=NOTHING_KNOWN):
    return check_unrolling(io.BytesIO(data), io.BytesIO(result), dialect=dialect, start=start)


def damages(lines):
    """Each line left out, doubled, swapped with the next, with another number, or another one."""
    for k, line in enumerate(lines):
        yield "lost", lines[:k] + lines[k + 1 :]
        yield "doubled", [*lines[: k + 1], *lines[k:]]
        yield "moved", [*lines[:k], b"G0 X1.", *lines[k:]]
        if k + 1 < len(lines) and lines[k + 1] != line:
            yield "swapped", [*lines[:k], lines[k + 1], line, *lines[k + 2 :]]
        for match in re.finditer(rb"[0-9]", line):
            other = b"%d" % ((int(match[0]) + 1) % 10)
            changed = line[: match.start()] + other + line[match.end() :]
            yield "number", [*lines[:k], changed, *lines[k + 1 :]]
        if b"(" not in line:
            yield "skipped", [*lines[:k], b"/" + line, *lines[k + 1 :]]


@pytest.mark.parametrize("dialect", PROGRAMS)
def test_every_damage_is_noticed(dialect):
    data = PROGRAMS[dialect]
    result = written(data, dialect)
    assert check(data, result, dialect).ok
    *lines, last = result.split(b"\n")
    assert not last
    kinds = set()
    for what, damaged in damages(lines):
        text = b"\n".join([*damaged, b""])
        if re.sub(rb"N\d+ ?", b"", text) == re.sub(rb"N\d+ ?", b"", result):
            continue  # an N that nothing leads to
        found = check(data, text, dialect)
        assert not found.ok, (what, text.decode())
        kinds |= {violation.kind for violation in found.violations}
    assert Kind.FLOW in kinds


@pytest.mark.parametrize("dialect", PROGRAMS)
def test_line_ends_and_comments_are_held_to_the_original(dialect):
    data = PROGRAMS[dialect].replace(b"\n", b"\r\n")
    result = written(data, dialect, comments=True)
    assert result.count(b"gcodejerk: ") >= 1
    assert result.count(b"\n") == result.count(b"\r\n")
    assert check(data, result, dialect).ok
    at = result.rindex(b"\r\n", 0, len(result) - 20)
    assert not check(data, result[:at] + result[at + 1 :], dialect).ok
    mixed = result.replace(b"\r\n", b"\n")
    assert not check(data, mixed, dialect).ok


NOT_CERTAIN = {
    "a condition on what nobody has set": b"o1 if [#33 GT 1]\nG0 X1\no1 endif\nM2\n",
    "a condition on a probe": b"G38.2 Z-5 F10\no1 if [#5063 GT 1]\nG0 X1\no1 endif\nM2\n",
    "a count that is none": b"o1 repeat [1.5]\nG0 X1\no1 endrepeat\nM2\n",
    "a call of what is not here": b"o<x> call\nG0 X1\nM2\n",
    "a variable behind a tool change": b"#<_a>=1\nM6 T1\no1 if [#<_a> GT 0]\nG0 X1\no1 endif\nM2\n",
    "modes saved in a subprogram": b"o1 sub\nM70\nG0 X1\nM72\no1 endsub\no1 call\nM2\n",
    "where it is": b"o1 repeat [1]\nG0 X#<_call_level>\no1 endrepeat\nM2\n",
    "Fanuc's way to return": b"o1 repeat [1]\nG0 X1\nM99\no1 endrepeat\nM2\n",
    "a do behind a break": b"#1=1\no1 while [#1 GT 0]\no1 break\no1 endwhile\n"
    b"o2 do\nG0 X1\n#1=[#1+1]\no2 while [#1 LT 3]\nM2\n",
    "an end that the operator may skip": b"o1 repeat [1]\n/M2\nG0 X1\no1 endrepeat\nM2\n",
    "a return from the main program": b"o1 repeat [1]\no2 return\nG0 X1\no1 endrepeat\nM2\n",
}


@pytest.mark.parametrize("name", NOT_CERTAIN)
def test_what_is_not_certain_may_not_be_written_out(name):
    data = NOT_CERTAIN[name]
    lines = [line for line in data.split(b"\n") if not re.match(rb"o[0-9<]", line)]
    found = check(data, b"\n".join(lines), "linuxcnc")
    assert not found.ok
    assert found.violations[0].kind in (Kind.FLOW, Kind.CHANGED, Kind.ADDED)


def test_a_subprogram_that_may_still_be_called_stays():
    data = b"o1 sub\nG0 X1\no1 endsub\no1 call\no2 if [#33 GT 1]\no1 call\no2 endif\nM2\n"
    result = written(data, "linuxcnc")
    assert b"o1 sub" in result
    assert check(data, result, "linuxcnc").ok
    without = result.replace(b"o1 sub\nG0 X1\no1 endsub\n", b"")
    found = check(data, without, "linuxcnc")
    assert [v.problem for v in found.violations] == [
        "a subprogram is left out that may still be called"
    ]
    lathe = b"o1 sub\nG0 X1\no1 endsub\no1 call\nG71 Q1 D1\nM2\n"
    assert b"o1 sub" in written(lathe, "linuxcnc")


def test_a_jump_may_not_be_written_out_in_front_of_what_stays():
    jump = b"#1=1\no1 while [#1 GT 0]\nG0 X1\no1 break\no1 endwhile\n"
    stays = b"o2 do\nG0 X2\no2 while [#33 LT 3]\nM2\n"
    target = io.BytesIO()
    assert unroll(io.BytesIO(jump + stays), target, comments=False).written == 0
    found = check(jump + stays, b"#1=1\nG0 X1\n" + stays, "linuxcnc")
    assert not found.ok


def test_other_files_have_to_be_the_same():
    data = b"G21\no<spot> call [3]\nM2\n"
    start = Start(subprograms={"spot.ngc": b"o<spot> sub\nG0 X#1\no<spot> endsub\nM2\n"})
    result = written(data, "linuxcnc", start)
    assert check(data, result, "linuxcnc", start).ok
    assert not check(data, result, "linuxcnc").ok
    other = Start(subprograms={"spot.ngc": b"o<spot> sub\nG0 Y#1\no<spot> endsub\nM2\n"})
    assert not check(data, result, "linuxcnc", other).ok


def test_what_the_second_reading_does_not_follow_is_told_so():
    with pytest.raises(NotFollowedError):
        check(b"O1\nGOTO 10\nM30\n", b"O1\nM30\n", "fanuc")


@pytest.mark.parametrize(("dialect", "controller"), [("linuxcnc", "linuxcnc"), ("fanuc", "fanuc")])
def test_a_processed_program_is_held_to_its_original(dialect, controller):
    data = PROGRAMS[dialect]
    result = process(data, VMC, dialect=dialect, controller=controller, unroll=True)
    assert result.planned > 2
    front, machine = Front(unroll=True), replace(VMC, controller=controller)

    def judge(output):
        files = io.BytesIO(data), io.BytesIO(output)
        return verify_written(*files, machine, front, dialect=dialect)[0]

    assert judge(result.output).ok
    line = b"G91 G0 Z1\n" if dialect == "linuxcnc" else b"G1 Z-1. F100.\n"
    assert line in result.output
    assert not judge(result.output.replace(line, b"", 1)).ok
    assert not judge(result.output.replace(line, line + line, 1)).ok
    changed = judge(
        result.output.replace(line, line.replace(b"1\n", b"2\n").replace(b"-1", b"-2"), 1)
    )
    assert not changed.ok
    first = changed.violations[0]
    assert data.split(b"\n")[first.original_line - 1].strip() == line.strip()
