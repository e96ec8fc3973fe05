"""Programs in odd spellings, against LinuxCNC's own interpreter: both readings read what it does.

Blanks and carriage returns within words and numbers, signs, zeros, expressions and variables in the
place of numbers, words behind assignments: all this is legal, and nobody writes it.
"""

import io
import math
import shutil

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from test_interpreter_reading import (
    AT_ZERO,
    STARTUP,
    TOLERANCE,
    disagreements,
    interpret,
    tool_table,
)

from gcodejerk.axes import AXES
from gcodejerk.nc import Start
from gcodejerk.nc.dialects.linuxcnc import LINUXCNC
from gcodejerk.verification.second_reading.agreement import observations

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]
HEAD = ["G21 G90", "#1=1 #5=5 #8=1 #<x>=1", "G0 X0 Y0 Z0"]
VALUES = st.sampled_from([0, 1, 1, 2, 3, 5, 7, 10, 12.5, -3, -1, 0.25, 100])
NUMBERS = (
    *("{0}", "{0}", "{0}", "+{0}", "-[-{0}]", "[{0}]", "[[{0}]]", "[{0}-1+1]", "--{0}", "00{0}"),
    *("ABS[-{0}]", "#[2-1]0", "[ {0} ]", "[{0}*#1]", "\t{0}\t", "{0}\r", "[{0}+#<X>-1]"),
)
"""Of what is not negative."""
LINES = (
    *(["G0", "X", "Y"], ["G0", "Z"], ["X", "Z"], ["G0", "X", "Y", "Z"], ["G1", "X", "F100"]),
    *(["G90"], ["G91"], ["G91", "G0", "X"], ["G20"], ["G21"], ["G54"], ["G55"], ["G92", "X"]),
    *(["G92.1"], ["G92.2", "Z"], ["G10", "L20", "P1", "X"], ["G53", "G0", "Z"], ["G28"]),
    *(["#5=", "X"], ["#<x y>=", "G0", "Y"], ["# 8 =", "G91"], ["#8=", "#5="], ["G0", "X#5"]),
    *(["G0", "X#<xy>"], ["G0", "Y# 8"], ["G0", "Z##1"]),
)
GLUE = ("", " ", " ", "  ", "\t", "\r", "(c)", " ( ; ) ", "(%)")
BEGINNINGS = (*[""] * 8, "N10 ", "n 1 0", "N1.5 ", "\t", "\r", "/", "/ N1 ")
ENDS = (*[""] * 8, " ", "\r", "\x0b", "\x0c", " (c)", ";c", " ; (c")


@st.composite
def number(draw):
    """A number in one of its spellings."""
    value = draw(VALUES)
    text = f"{value:g}"
    if draw(st.integers(0, 2)) or value < 0:
        return text
    odd = draw(st.sampled_from(NUMBERS))
    if odd.startswith("#"):
        return "#5"
    odd = odd.format(text)
    return draw(st.sampled_from(GLUE[:6])).join(odd) if not draw(st.integers(0, 3)) else odd


@st.composite
def word(draw, said):
    """A word, or an assignment, whose number may be missing so far."""
    if said[-1] in "XYZ=":
        said += draw(number())
    return said if draw(st.integers(0, 3)) else said.lower()


@st.composite
def programs(draw):
    """Lines behind a head that says where everything stands."""
    lines = [*HEAD, "#<xy>=2"]
    for _ in range(draw(st.integers(3, 9))):
        words = [draw(word(said)) for said in draw(st.sampled_from(LINES))]
        text = words[0]
        for other in words[1:]:
            text += draw(st.sampled_from(GLUE)) + other
        begin, end = draw(st.sampled_from(BEGINNINGS)), draw(st.sampled_from(ENDS))
        lines.append(begin + text + end)
        if draw(st.booleans()):
            lines.append(f"G0 X{draw(st.integers(0, 9))} Y{draw(st.integers(0, 9))}")
    return "\n".join([*lines, "G0 X3 Y1", "X4 Y4 Z4", "M2", ""]).encode("latin-1")


def seen_otherwise(data, moves, start):
    """What the second reading is sure of, and the interpreter contradicts; how many it is of."""
    lines = sorted({line for line, _, _ in moves})
    wrong, sure = [], 0
    for k, seen in observations(io.BytesIO(data), LINUXCNC, start, lines):
        if not seen.sure:
            continue
        sure += 1
        for line, what, stated in moves:
            if line != lines[k]:
                continue
            if what != "TRAVERSE":
                wrong.append(f"line {line} is {what}, seen as a rapid")
            for axis, value in stated.items():
                read = seen.end[AXES.index(axis)]
                if not math.isnan(read) and abs(read - value) > TOLERANCE:
                    wrong.append(f"line {line} goes to {axis}{value}, seen as {read}")
    return wrong, sure


def compared(data, folder):
    """What either reading says otherwise than the interpreter; how many rapids they know."""
    path = folder / "part.ngc"
    path.write_bytes(data)
    moves, refusal = interpret(path, folder)
    known = 0
    for start in (Start(startup=STARTUP), AT_ZERO):
        wrong, certain, _ = disagreements(data, moves, start, bool(refusal))
        otherwise, sure = seen_otherwise(data, moves, start)
        assert not wrong + otherwise, (data, wrong, otherwise, refusal)
        known += certain + sure
    return known, refusal


KNOWN = []


@settings(
    max_examples=120,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(programs())
def check(folder, data):
    known, refusal = compared(data, folder)
    KNOWN.append(0 if refusal else known)


def test_odd_spellings_read_as_the_interpreter_reads_them(tmp_path):
    tool_table(tmp_path)
    check(tmp_path)
    assert sum(map(bool, KNOWN)) > len(KNOWN) / 5
