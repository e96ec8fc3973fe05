"""CYCLE81 and CYCLE82 written out, at once and behind MCALL; what is left alone; damage."""

import io

import pytest

from gcodejerk.cycles.expansion import expand
from gcodejerk.nc import Start
from gcodejerk.verification.cycles.expansion import check_expansion

START = Start(startup="G17 G90 G94 G71 G40 G64", spindle="mill")
HEAD = b"G17 G90 G94 G71 G64 F200\nG0 X1 Y2 Z50\n"
END = b"G0 X99 Z60\nM30\n"


def written(program, comments=False):
    target = io.BytesIO()
    found = expand(io.BytesIO(program), target, dialect="siemens", start=START, comments=comments)
    return target.getvalue() if found.written else program, found


def lines_of(body):
    text, found = written(HEAD + body + END)
    assert text.startswith(HEAD)
    assert text.endswith(END)
    return text.removeprefix(HEAD).removesuffix(END).decode().splitlines(), found


def check(program, text):
    return check_expansion(io.BytesIO(program), io.BytesIO(text), dialect="siemens", start=START)


HOLE = ["G4 F0.001", "G9 G0 Z2", "G9 G1 Z-5", "G9 G0 Z40"]
WAYS = {
    b"CYCLE81(40,0,2,-5)\n": HOLE,
    b"N5 CYCLE81(40.0, 0, 2, , 5.0) ; one\n": ["N5 ; one", *HOLE],
    b"CYCLE82(40,0,2,-5,,0.5)\n": [*HOLE[:3], "G4 F0.5", HOLE[3]],
    b"CYCLE82(40,0,2,-5,,0,0,0)\n": HOLE,
    b"CYCLE81(40,10,2,-5,3)\n": ["G4 F0.001", "G9 G0 Z12", "G9 G1 Z7", "G9 G0 Z40"],
    b"CYCLE81(40,0,,-5)\n": ["G4 F0.001", "G9 G0 Z0", "G9 G1 Z-5", "G9 G0 Z40"],
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nM8 F90\nG1 Y6\nMCALL\n": [
        *("X5", *HOLE, "M8 F90"), *("G1 Y6", *HOLE, "G1"),
    ],
    b"N1 MCALL CYCLE81(40,0,2,-5)\nN2 X5 Y7\nN3 MCALL\n": ["N1", "N2 X5 Y7", *HOLE, "N3"],
}  # fmt: skip


@pytest.mark.parametrize("body", WAYS)
def test_a_call_goes_as_its_parameters_say(body):
    lines, found = lines_of(body)
    assert lines == WAYS[body]
    assert not found.findings
    assert found.written == found.holes
    text = written(HEAD + body + END)[0]
    judged = check(HEAD + body + END, text)
    assert judged.ok, judged.violations
    assert judged.rewritten == found.written == judged.confirmed


LEFT = {
    b"CYCLE83(40,0,2,-20,,-5,,1,0,0,1,0)\n": "not every motion of CYCLE83",
    b"MCALL CYCLE85(40,0,2,-5,,0,100,200)\nX5\nMCALL\n": "not every motion of CYCLE85",
    b"CYCLE82(40,0,2,-5,,-3)\n": "revolutions",
    b"CYCLE81(R1,0,2,-5)\n": "arguments",
    b"CYCLE81(40,0,2,5)\n": "arguments",
    b"CYCLE82(40,0,2,-5,,0,0,1,11)\n": "arguments",
    b"G18\nCYCLE81(40,0,2,-5)\nG17\n": "arguments",
    b"G91\nCYCLE81(40,0,2,-5)\nG90\n": "G91",
    b"CYCLE81(40,0,2,-5) M8\n": "order",
    b"/CYCLE81(40,0,2,-5)\n": "block delete",
    b"MCALL CYCLE81(40,0,2,-5)\nX1\nMCALL\n": "may not move",
    b"MCALL CYCLE81(40,0,2,-5)\nX5 Z9\nMCALL\n": "order",
    b"MCALL CYCLE81(40,0,2,-5)\nX5 M8\nMCALL\n": "order",
    b"MCALL CYCLE81(40,0,2,-5)\nX=IC(5)\nMCALL\n": "order",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nHOLES1(0,0,0,10,10,3)\nMCALL\n": "between the holes",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nTRANS X5\nX7\nMCALL\n": "order",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nMCALL CYCLE82(40,0,2,-5)\nX7\nMCALL\n": "another cycle",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\n": "order",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\n/MCALL\n": None,
    b"MCALL L20\nX5\nMCALL\n": None,
    b"AGAIN:\nCYCLE81(40,0,2,-5)\nGOTOB AGAIN\n": "jumps",
    b"FOR R1=1 TO 3\nCYCLE81(40,0,2,-5)\nENDFOR\n": "jumps",
}


@pytest.mark.parametrize("body", LEFT)
def test_what_is_not_certain_is_left_whole(body):
    program = HEAD + body + END
    text, found = written(program)
    assert (found.written, text) == (0, program)
    if LEFT[body] is not None:
        assert any(LEFT[body] in f.message for f in found.findings), found.findings
    assert check(program, text).ok


DOUBTLESS = [
    b"MCALL CYCLE81(40,0,2,-5)\nX1\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5)\nX5 Z9\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5)\nX5 M6\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5)\nX=IC(5)\nMCALL\n",
    b"G91\nCYCLE81(40,0,2,-5)\nG90\n",
    b"CYCLE81(40,0,2,-5)\nGOTOF DONE\nDONE:\n",
]


@pytest.mark.parametrize("body", DOUBTLESS)
def test_a_writer_that_does_not_doubt_is_found_out(body, monkeypatch):
    monkeypatch.setattr("gcodejerk.cycles.called._no_hole", lambda *_: None)
    monkeypatch.setattr("gcodejerk.cycles.called._modes", lambda *_: None)
    monkeypatch.setattr("gcodejerk.cycles.expansion._finds_jumps", lambda *_: False)
    program = HEAD + body + END
    text, found = written(program)
    assert found.written
    assert not check(program, text).ok


PROGRAM = (
    HEAD
    + b"""\
N30 CYCLE81(40,0,2,-5) ; first
N40 G1 X3
N50 MCALL CYCLE82(40.5,0,2,,6,0.5)
N60 X12 Y5
N65 F150 M8
N70 G0 X15
N80 MCALL
N90 X4
"""
    + END
)
WRITTEN = written(PROGRAM, comments=True)[0]


def once(old, new):
    def damage(text):
        assert old in text
        return text.replace(old, new, 1)

    return damage


DAMAGE = {
    "a hole is moved": once(b"N60 X12 Y5\n", b"N60 X12 Y5.1\n"),
    "a depth is changed": once(b"G9 G1 Z-5\n", b"G9 G1 Z-5.1\n"),
    "a depth loses its sign": once(b"G9 G1 Z-5\n", b"G9 G1 Z5\n"),
    "a retract is missing": once(b"G9 G0 Z40\n", b""),
    "a retract is too low": once(b"G9 G0 Z40\n", b"G9 G0 Z4\n"),
    "an approach is too low": once(b"G9 G0 Z2\n", b"G9 G0 Z0.2\n"),
    "a dwell is lost": once(b"G4 F0.5\n", b""),
    "a dwell is shorter": once(b"G4 F0.5\n", b"G4 F0.05\n"),
    "a rest is lost": once(b"G4 F0.001\n", b""),
    "a standstill is lost": once(b"G9 G1 Z-6\n", b"G1 Z-6\n"),
    "a feed move becomes a rapid": once(b"G9 G1 Z-6\n", b"G9 G0 Z-6\n"),
    "a rapid becomes a feed move": once(b"G9 G0 Z40\n", b"G9 G1 Z40\n"),
    "G1 does not return": once(b"Z40.5\nG1\n", b"Z40.5\n"),
    "a hole is not written out": once(
        b"N70 G0 X15\nG4 F0.001\nG9 G0 Z2\nG9 G1 Z-6\nG4 F0.5\nG9 G0 Z40.5\n", b"N70 G0 X15\n"
    ),
    "MCALL stays": once(b"N80\n", b"N80 MCALL\n"),
    "a number is lost": once(b"N80\n", b""),
    "a comment is lost": once(b"N30 ; first\n", b"N30\n"),
    "a kept line is changed": once(b"N65 F150 M8\n", b"N65 F160 M8\n"),
    "a line is added": once(b"N90 X4\n", b"M9\nN90 X4\n"),
    "something follows": lambda text: text + b"G0 Z0\n",
    "a line end is changed": once(b"G9 G1 Z-5\n", b"G9 G1 Z-5\r\n"),
}


def test_what_was_written_out_is_accepted():
    for program in (PROGRAM, PROGRAM.replace(b"\n", b"\r\n"), PROGRAM.rstrip()):
        for comments in (True, False):
            found = check(program, written(program, comments)[0])
            assert found.ok, found.violations
            assert (found.rapids, found.rewritten) == (3, 3)


@pytest.mark.parametrize("case", DAMAGE)
def test_every_damage_is_noticed(case):
    damaged = DAMAGE[case](WRITTEN)
    assert damaged != WRITTEN
    assert not check(PROGRAM, damaged).ok
