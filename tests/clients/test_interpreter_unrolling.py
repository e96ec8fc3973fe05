"""Loops and calls written out, against LinuxCNC's interpreter: what it makes of both files is one.

What is compared is everything that the interpreter tells the machine, in its order: moves, modes,
tools, messages. The proof has to agree, and whatever a structure's text says has to come out.
"""

import io
import re
import shutil
import subprocess

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_interpreter_flow import FLOW, flows

from gcodejerk.start import NOTHING_KNOWN, Start
from gcodejerk.unrolling.unrolling import unroll
from gcodejerk.verification.unrolling.checking import check_unrolling

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]
NUMBER = re.compile(r"-?\d+\.\d+")


def canon(folder, name):
    """What the interpreter tells the machine: words and numbers, and its refusal."""
    try:
        done = subprocess.run(
            ["rs274", "-g", name], cwd=folder, capture_output=True, text=True, check=False,
            errors="replace", stdin=subprocess.DEVNULL, timeout=5,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return [], "endless"
    told = [re.sub(r"^\s*\d+ N\S* ", "", line) for line in done.stdout.splitlines()]
    told = [line for line in told if not line.startswith('COMMENT("gcodejerk: ')]
    refused = done.stderr.removeprefix("executing").strip()
    return [(NUMBER.sub("", line), [*map(float, NUMBER.findall(line))]) for line in told], refused


def unrolled(data, start=NOTHING_KNOWN, comments=True):
    """The program written out, the proof of which is good; None where nothing was."""
    target = io.BytesIO()
    found = unroll(io.BytesIO(data), target, start=start, comments=comments)
    if not found.written:
        return None, found
    result = target.getvalue()
    checked = check_unrolling(io.BytesIO(data), io.BytesIO(result), start=start)
    assert checked.ok, (checked.violations, data.decode(), result.decode())
    assert checked.rewritten == found.written
    return result, found


def same(folder, data, result):
    """Whether the interpreter makes the same of two programs; whether it runs them to their end."""
    (folder / "one.ngc").write_bytes(data)
    (folder / "other.ngc").write_bytes(result)
    (one, refused), (other, again) = (canon(folder, name) for name in ("one.ngc", "other.ngc"))
    assert [words for words, _ in one] == [words for words, _ in other], result.decode()
    for (_, a), (_, b) in zip(one, other, strict=True):
        # its four decimals may round the other way
        assert b == pytest.approx(a, abs=1.01e-4), result.decode()
    assert bool(refused) == bool(again), (refused, again)
    assert (refused == "endless") == (again == "endless")
    return not refused


PROGRAMS = {
    "while, with messages": """
#1=0
o100 while [#1 LT 3] (MSG,not shown)
(DEBUG,pass #1)
G0 X[#1*2] (PRINT,value #1)
G1 Z-#1 F100 ; and back
#1=[#1+1]
o100 endwhile
G0 X#1
""",
    "do, repeat, if with all its branches": """
#<n>=0
o1 do
#<n>=[#<n>+1]
o2 if [#<n> EQ 1]
G0 X1
o2 elseif [#<n> EQ 2]
G0 X2
o2 else
o3 repeat [#<n>]
G91 G0 Y1
o3 endrepeat
G90
o2 endif
o1 while [#<n> LT 4]
""",
    "a subprogram's own variables": """
#1=7 #<depth>=3
o10 sub
#<depth>=#2
G0 X#1 Y[#1*#<depth>] (DEBUG,own #1 #<depth> of #<_shared>)
(PRINT,own #<depth>)
#<_shared>=[#1/3]
#31=#2 #1=99
G1 Z-#<depth> F[100*#2]
G0 Z##3
o10 endsub
#5=8
o10 call [1.5] [2] [31]
o10 call [#1] [#<depth>+0.1] [31]
G0 X#1 Y#<depth> Z#<_shared>
""",
    "calls within calls, return from a loop": """
o20 sub
o21 while [1]
#1=[#1+1]
G0 X#1
o22 if [#1 GT #2]
o20 return
o22 endif
o21 endwhile
o20 endsub
o30 sub
o20 call [#1] [#1+2]
G0 Y#1
o30 endsub
o30 call [1]
o30 call [5]
""",
    "break and continue": """
#1=0
o40 while [#1 LT 9]
#1=[#1+1]
o41 if [#1 EQ 2]
o40 continue
o41 endif
o42 if [#1 EQ 5]
o40 break
o42 endif
G0 X#1
o40 endwhile
""",
    "the program ends in a loop": """
#1=0
o50 while [1]
#1=[#1+1]
G0 X#1
o51 if [#1 EQ 3]
M2
o51 endif
o50 endwhile
G0 X99
""",
    "functions": """
#1=0
o60 while [#1 LT 360]
G0 X[10*cos[#1]] Y[10*sin[#1]]
o61 if [fix[#1/100] eq 1 and #1 mod 20 ne 0]
G1 Z[-sqrt[#1]] F[fup[#1/7]]
o61 endif
#1=[#1+30]
o60 endwhile
o62 sub
G0 X[10*cos[#1]] Y[round[#1/7]] Z[atan[#1]/[3]+abs[-#1]**2]
o62 endsub
o62 call [33]
""",
    "modes, block delete, N, percent, tool": """
o70 repeat [2]
N10 G91 G0 X1
/ N20 G90 G0 X5
n10 g20 g0 x1 m3 s100
G21 G90 M5
o70 endrepeat
""",
    "arrays and indirect numbers": """
#100=1.5 #101=2.5 #102=-3
o81 sub
G0 X##1 Y#[#1+1]
o81 endsub
o81 call [100]
o81 call [101]
""",
}


@pytest.mark.parametrize("comments", [True, False])
@pytest.mark.parametrize("name", PROGRAMS)
def test_the_interpreter_runs_both_alike(tmp_path, name, comments):
    data = f"G21 G90 G94 F100\nG0 X0 Y0 Z5{PROGRAMS[name]}M2\n".encode()
    result, found = unrolled(data, comments=comments)
    assert found.whole
    assert result is not None
    assert not re.search(rb"^o", result, re.IGNORECASE | re.MULTILINE)
    assert same(tmp_path, data, result)


def test_subprograms_of_other_files_stand_in_the_program(tmp_path):
    files = {
        "spot.ngc": b"o<spot> sub\nG0 X#1 Y#2\no<deep> call [#1]\no<spot> endsub\nG0 X888\nM2\n",
        "deep.ngc": b"(text)\no<deep> sub\n(in it)\no1 if [#1 gt 3]\nG1 Z-#1 F100\no1 endif\n"
        b"o<deep> endsub\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_bytes(text)
    data = b"G21 G90\no<spot> call [3] [4]\no<spot> call [2*3] [7]\nG0 Z5\nM2\n"
    result, found = unrolled(data, Start(subprograms=files))
    assert found.used == ("spot.ngc", "deep.ngc")
    assert result.count(b"\n") == 10
    assert same(tmp_path, data, result)


@pytest.fixture
def tally():
    """How many programs were written out and run to their end."""
    counts = []
    yield counts
    assert sum(counts) > len(counts) // 4


@settings(FLOW, max_examples=40)
@given(lines=flows(), ending=st.sampled_from([b"\n", b"\r\n"]))
def test_drawn_programs_run_alike(tmp_path, tally, lines, ending):
    data = ending.join(line.encode() for line in ["#33=1 #34=2 #35=3", "G21 G90", *lines, ""])
    result, _ = unrolled(data)
    tally.append(result is not None and same(tmp_path, data, result))
