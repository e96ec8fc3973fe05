"""Flow and variables of Siemens and macro B, as both readers see them."""

import io
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import CERTAIN, REASONS, Start, read_program, trace
from gcodejerk.nc.flow import following
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import verify
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

HOME = dict.fromkeys("XYZ", 0.0)
START = {
    "siemens": Start(positions=HOME, offsets={"G54": HOME}, startup="G710 G64"),
    "fanuc": Start(positions=HOME, offsets={"G54": HOME}, decimal_point="calculator"),
}
HEAD = {
    "siemens": b"G17 G710 G90 G94 G64 G40 G54 F500\nG0 X0 Y0 Z0\n",
    "fanuc": b"O1\nG21 G17 G40 G90 G94 G49 G80 G54 F500.\n",
}
LOST = "behind a call, jump or loop that is not followed"
ONCE = "inside a subprogram, loop or conditional block"


def read(text, dialect="siemens", start=None, second=True):
    """Text of every rapid -> reason, or where it goes; both readers agree on what is certain."""
    data = HEAD[dialect] + text
    start = start or START[dialect]
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    rows = np.flatnonzero(rapids.reason == CERTAIN)
    found = Findings(20)
    confirmed = confirm(io.BytesIO(data), dialect, start, rapids, rows, found)
    assert not found.violations
    assert confirmed == len(rows) or not second
    lines = data.decode().splitlines()
    told = {}
    for i in range(len(rapids)):
        ends = [(a, b) for a, b in zip(rapids.start[i, :3], rapids.target[i, :3], strict=True)]
        moved = {x: (a, b) for x, (a, b) in zip("XYZ", ends, strict=True) if a == a != b}
        why = REASONS[rapids.reason[i]] if rapids.reason[i] != CERTAIN else moved
        told[lines[rapids.line[i] - 1]] = why
    return told


# --- Siemens ---


@pytest.mark.parametrize(
    ("text", "last"),
    [
        (b"R1=5 R2=R1*2\nG0 X=R1", 5.0),
        (b"R1=4\nR2 = R1 + 6 * (R1 - 3)\nG0 X = R2 - 1", 9.0),
        (b"R1=2\nR[3]=7\nG0 X=R[R1+1]", 7.0),
        (b"DEF REAL A1B, DEPTH=3.5\nG0 X=-DEPTH+AB", None),
        (b"DEF REAL DEPTH=3.5, WIDE\nWIDE=DEPTH*2\nG0 X=WIDE", 7.0),
        (b"DEF INT NN=2.6\nG0 X=NN", 3.0),
        (b"DEF INT NN=2.6\nNN=NN/2\nG0 X=NN+10", 12.0),
        (b"DEF REAL PLACE[3]\nPLACE[1]=4\nG0 X=PLACE[1]", 4.0),
        (b"DEF REAL PLACE[3]\nPLACE[1]=4 PLACE[R1]=3\nG0 X=PLACE[1]", None),
        (b"R1=17\nG0 X=R1 DIV 5 + R1 MOD 5", 5.0),
        (b"G0 X=SIN(30)*10", 5.0),
        (b"G0 X=SQRT(POT(3)+16)", 5.0),
        (b"G0 X=TRUNC(7.9)+ROUND(2.5)", 10.0),
        (b"R1=10EX-1\nG0 X=R1", 1.0),
        (b"R1=8 R1=9\nG0 X=R1", None),
        (b"R1=1/3\nG0 X=R1", None),
        (b"R1=1\nM6\nG0 X0 Y0 Z0\nG0 X=R1", None),
        (b"G0 X=R900", None),
        (b"G0 X=$AA_IW[Y]", None),
        (b"G0 X1\nG0 X=IC(4)", 5.0),
        (b"G91 G0 X1\nG0 X=AC(4)", 4.0),
    ],
)
def test_siemens_computes_where_a_rapid_ends(text, last):
    told = list(read(text + b"\n").values())[-1]
    assert (told["X"][1] if isinstance(told, dict) else None) == last


@pytest.mark.parametrize(
    ("flow", "last"),
    [
        ("IF R1==3\nR2=7\nELSE\nR2=8\nENDIF", 7.0),
        ("IF (R1<>3) OR (R1>90)\nR2=7\nELSE\nR2=8\nENDIF", 8.0),
        ("R2=1\nWHILE R2<6\nR2=R2+2\nENDWHILE", 7.0),
        ("R2=0\nFOR R5=1 TO R1\nR2=R2+R5\nENDFOR", 6.0),
        ("R2=1\nFOR R5=5 TO R1\nR2=9\nENDFOR", 1.0),
        ("R2=0\nREPEAT\nR2=R2+4\nUNTIL R2>9", 12.0),
        ("R2=0\nLOOP\nR2=R2+1\nIF R2>4 GOTOF OUT\nENDLOOP\nOUT:", 5.0),
        ("R2=0\nAGAIN: R2=R2+1\nIF R2<3 GOTOB AGAIN", 3.0),
        ("R2=0\nN70 R2=R2+1\nIF R2<3 GOTO 70", 3.0),
        ("R2=0\nPART:\nR2=R2+1\nREPEAT PART P=4", 5.0),
        ("R2=0\nFIRST:\nR2=R2+1\nLAST:\nR2=R2*2\nREPEAT FIRST LAST P2", 4.0),
        ("R2=0\nONE: R2=R2+1\nREPEATB ONE P=2", 3.0),
        ("R2=4\nGOTOF THERE\nR2=5\nTHERE: ;here", 4.0),
    ],
)
def test_siemens_structures_and_jumps_run_as_the_control_runs_them(flow, last):
    told = read(f"R1=3\n{flow}\nG0 X=R2\nM30\n".encode())
    assert told["G0 X=R2"] == {"X": (0.0, last)}


SUB = b"M30\n%_N_CUT_SPF\nPROC CUT(REAL DEEP, INT TIMES=2)\nG0 X=DEEP*TIMES\nG0 Z3\nRET\n"
MAIN = b"%_N_MAIN_MPF\n"


def test_siemens_subprograms_of_the_file_are_called_with_what_they_are_given():
    assert read(b"CUT(4)\nG0 Y1\n" + SUB)["G0 X=DEEP*TIMES"] == {"X": (0.0, 8.0)}
    assert read(b"CUT(4,3)\nG0 Y1\n" + SUB)["G0 X=DEEP*TIMES"] == {"X": (0.0, 12.0)}
    told = read(b"CUT(4)\nG0 X0 Z0\nCUT(5)\nG0 Y1\n" + SUB)
    assert told["G0 X=DEEP*TIMES"] == ONCE
    assert told["G0 Z3"] == {"Z": (0.0, 3.0)}
    assert told["G0 Y1"] == {"Y": (0.0, 1.0)}


def test_siemens_l_numbers_are_names_and_leading_zeros_count():
    sub = b"M30\n%_N_L10_SPF\nG91 G0 X5\nG90\nM17\n"
    assert read(b"L10 P3\nG0 Y1\nG0 X20\n" + sub)["G0 X20"] == {"X": (15.0, 20.0)}
    assert read(b"L010\nG0 Y1\n" + sub)["G0 Y1"] == LOST


@pytest.mark.parametrize(
    "line",
    [b"DRILL", b"L55", b"CUT(VAR1,2,3)", b'CALL "CUT"', b'EXTCALL("CUT")', b"MYCYC(1)", b"GUD=4"],
)
def test_what_siemens_runs_elsewhere_leaves_nothing_known(line):
    told = read(
        line + b"\nG0 Y1\nG40 G90 G710 G94 G64 G54 F9\nG0 X1 Y1 Z1\nG0 X2\n" + SUB, second=False
    )
    assert told["G0 Y1"] != {"Y": (0.0, 1.0)}
    assert told["G0 X2"] == {"X": (1.0, 2.0)}, "known again, once the program states it"
    assert not isinstance(told["G0 Z3"], dict), "it may have called the subprogram"


@pytest.mark.parametrize(
    "flow",
    [
        b"GOTOB LATER\nLATER:",  # it stands behind, and is looked for in front
        b"GOTOF NOWHERE",
        b"HERE:\nHERE:\nGOTOB HERE",
        b"CASE R1 OF 1 GOTOF A1B DEFAULT GOTOF A2B\nA1B:\nA2B:",
        b"IF R900 GOTOF INSIDE\nWHILE R901\nINSIDE:\nENDWHILE",
        b"WHILE R1<9\nENDIF",
        b"EXECSTRING(WORDS)",
    ],
)
def test_jumps_that_nobody_can_follow_leave_nothing_certain_behind_them(flow):
    told = read(b"G0 X1\nR1=1\n" + flow + b"\nG0 X5 Y5\nM30\n", second=False)
    assert not isinstance(told["G0 X5 Y5"], dict)


def test_both_ways_of_an_unknown_condition_are_joined():
    told = read(b"G0 X1\nIF R90==1 GOTOF SKIP\nG0 X4\nG0 Z7\nSKIP:\nG0 Y3\nG0 X5\nG0 Z7\n")
    assert told["G0 X4"] == {"X": (1.0, 4.0)}, "where it runs, it runs so"
    assert told["G0 Y3"] == {"Y": (0.0, 3.0)}
    assert told["G0 X5"] == "start unknown"
    told = read(b"G0 X1\nREPEAT\nG0 X3\nG91 G0 X1\nG90\nUNTIL R90==1\nG0 X5\n", second=False)
    assert told["G0 X3"] == ONCE
    assert told["G0 X5"] == {"X": (4.0, 5.0)}


def test_recursion_and_endless_loops_are_left_alone(monkeypatch):
    sub = b"M30\n%_N_LOOP_SPF\nG0 X5\nG0 X6\nLOOPS\nM17\n%_N_LOOPS_SPF\nLOOP1\nM17\n"
    assert not isinstance(read(b"LOOPS\nG0 Y1\n" + sub)["G0 Y1"], dict)
    monkeypatch.setattr(following, "MOST_STEPS", 300)
    told = read(b"R1=0\nWHILE R1<1000\nG0 X=R1\nR1=R1+1\nENDWHILE\nG0 X1 Y1\nM30\n")
    assert not any(isinstance(why, dict) for why in told.values())


def test_siemens_frames_are_shifted_by_numbers():
    told = read(b"G0 X1\nTRANS X10 Z=2*2\nG0 X0\nATRANS X1\nG0 X5\nTRANS\nG0 X6\n")
    assert told["G0 X0"] == {"X": (-9.0, 0.0)}
    assert told["G0 X5"] == {"X": (-1.0, 5.0)}
    assert told["G0 X6"] == {"X": (16.0, 6.0)}


def test_a_turned_frame_is_not_known_until_it_is_ended():
    turned = "rotation, scaling, mirroring or polar active"
    for begin in (b"ROT RPL=30", b"AROT Z30", b"MIRROR X0", b"SCALE X2", b"ROT Z5\nATRANS X1"):
        for end in (b"TRANS", b"ROT", b"TRANS X0 Y0", b"MIRROR"):
            told = read(begin + b"\nG0 X1\n" + end + b"\nG0 X3 Y3 Z3\nG0 X4\n")
            assert told["G0 X1"] == turned
            assert told["G0 X4"] == {"X": (3.0, 4.0)}, (begin, end)


def test_a_synchronized_action_may_act_at_any_time():
    stated = b"G40 G90 G710 G94 G64 G54 F9\nG0 X1 Y1 Z1\nG0 X2\n"
    text = b"ID=1 WHENEVER $AA_IW[X]>50 DO POS[Y]=10\n" + stated
    assert read(text)["G0 X2"] == LOST


# --- macro B ---


@pytest.mark.parametrize(
    ("text", "last"),
    [
        (b"#1=3.\n#1=#1+4.\nG0 X#1", 7.0),
        (b"#101=2.\nG0 X[#101*3.+FIX[2.9]]", 8.0),
        (b"#1=5.\n##1=6.\nG0 X#5", None),
        (b"#2=1.\n#1=2.\nG0 X##1", 1.0),
        (b"#1=3.\nIF[#1 EQ 3.]THEN #2=8.\nG0 X#2", 8.0),
        (b"#2=4.\nIF[#500 EQ 3.]THEN #2=8.\nG0 X#2", None),
        (b"#1=0\nN10 #1=#1+1.\nIF[#1 LT 4.]GOTO 10\nG0 X#1", 4.0),
        (b"#1=0\nWHILE[#1 LT 4.]DO1\n#1=#1+3.\nEND1\nG0 X#1", 6.0),
        (b"#1=20\n#2=4.\nGOTO#1\nN10 #2=9.\nN20 G0 X#2", 4.0),
        (b"IF[[1 EQ 1] AND [2 GT 3]]GOTO10\n#2=5.\nN10\nG0 X#2", 5.0),
        (b"#2=5.\nIF[#0 EQ 0]GOTO10\nG0 X#2\nN10", 5.0),
        (b"#1=0.1\n#2=#1*3.\n#3=1.\nIF[#2 EQ 0.3]THEN #3=2.\nG0 X#3", None),
        (b"#3=1.\nIF[#3001 GT 5.]THEN #3=2.\nG0 X#3", None),
        (b"#500=3.\nG0 X#500", 3.0),
        (b"G0 X#500", None),
    ],
)
def test_macro_b_computes_where_a_rapid_ends(text, last):
    told = list(read(text + b"\nM30\n", "fanuc").values())[-1]
    assert (told["X"][1] if isinstance(told, dict) else None) == last


MACRO = b"M30\nO9000\n%s\nM99\n"


@pytest.mark.parametrize(
    ("call", "body", "last"),
    [
        ("G65 P9000 A1.5 X7.", "G0 X[#1+#24]", 8.5),
        ("G65 P9000 I1. J2. K3. I4.", "G0 X[#4*1000.+#5*100.+#6*10.+#7]", 1234.0),
        ("G65 P9000 J2. I4.", "G0 X[#5*10.+#7]", 24.0),
        ("G65 P9000 A5", "G0 X#1", None),  # 5 of what, the control decides
        ("G65 P9000 A5.", "IF[#2 EQ #0]THEN #1=9.\nG0 X#1", 9.0),
        ("#1=6.\nM98 P9000", "G0 X#1", 6.0),
        ("#1=6.\nG65 P9000", "IF[#1 NE #0]THEN #2=1.\n#2=4.\nG0 X#2", 4.0),
        ("#100=6.\nG65 P9000 A[#100+1.]", "G0 X#1", 7.0),
    ],
)
def test_macros_have_variables_of_their_own(call, body, last):
    told = read(f"{call}\n".encode() + MACRO % body.encode(), "fanuc")
    why = told[body.splitlines()[-1]]
    assert (why["X"][1] if isinstance(why, dict) else None) == last


def test_what_a_macro_leaves_is_the_callers():
    text = b"#1=2.\nG65 P9000 A7.\nG0 X#1\n" + MACRO % b"#1=9.\n#150=3.\nG0 Y#150"
    told = read(text, "fanuc")
    assert told["G0 X#1"] == {"X": (0.0, 2.0)}
    assert told["G0 Y#150"] == {"Y": (0.0, 3.0)}


@pytest.mark.parametrize(
    "line",
    [b"G65 P8000 A1.", b"G66 P9000 A1.", b"M98 P8000", b"#5221=4.", b"G65 P#1", b"M198 P9000"],
)
def test_what_macro_b_runs_elsewhere_leaves_nothing_known(line):
    told = read(line + b"\nG0 Y1.\nM30\n", "fanuc")
    assert not isinstance(told["G0 Y1."], dict)


def test_numbers_that_stand_twice_are_no_targets():
    told = read(b"N10 G0 X5.\nN10 G0 X6.\nGOTO 10\nG0 Y1.\n", "fanuc")
    assert not any(isinstance(why, dict) for why in told.values())


def test_plain_files_are_not_followed():
    """What has no flow is read in one go, whatever it computes."""
    told = read(b"#1=4.\nG0 X#1\nG0 X5.\nM30\n", "fanuc")
    assert told["G0 X#1"] == {"X": (0.0, 4.0)}


# --- what is written ---

COMPUTED = {
    "siemens": b"G17 G710 G90 G94 G64 G40 F500\nR1=10\nDEF REAL UP=2.5\nG0 X0 Y0 Z=UP\n"
    b"AGAIN:\nG0 X=R1*2 Y=-R1\nG1 Z-5\nG0 Z=UP+R1\nG0 X=IC(-40) Y=AC(7)\nR1=R1+0\n"
    b"R2=R2+1\nG0 X0 Y0 Z=UP\nG91 G0 X=R1\nM30\n",
    "fanuc": b"O1\nG21 G17 G40 G90 G94 G64 F500.\n#1=10.\nG0 X0. Y0. Z5.\nWHILE[#2 EQ #0]DO1\n"
    b"#2=1.\nEND1\nIF[#1 GT 3.]GOTO10\nG0 X99.\nN10\nG0 X#1 Y[#1*2.]\nG1 Z-5.\nG0 Z[#1+2.5]\n"
    b"G91 G0 X#1 Y-#1\nM30\n",
}


@pytest.mark.parametrize("dialect", COMPUTED)
def test_computed_rapids_are_written_as_numbers_and_proven(dialect):
    vmc = Machine.load(find_machine("vmc"))
    program = replace(vmc.program, start=HOME, startup="G90", decimal_point="calculator")
    axes = tuple(replace(axis, travel=None) for axis in vmc.axes)
    machine = replace(vmc, axes=axes, program=program)
    data = COMPUTED[dialect]
    result = process(data, machine, dialect=dialect, controller=dialect)
    lines = result.output.splitlines()
    streams = [line for line in lines if line.startswith((b"; gcodejerk: ", b"(gcodejerk: "))]
    assert len(streams) >= 3
    points = [line for line in lines if line.startswith(b"G1 ") and b" F" in line]
    assert not any(c in line for line in points for c in (b"R", b"#", b"=", b"("))
    proof = verify(data, result.output, machine, dialect=dialect, controller=dialect)
    assert not proof.violations


def test_a_line_that_did_nothing_on_one_pass_is_traced_on_that_pass_too():
    # What is known behind it is what holds on every pass, also where its condition was false.
    data = (
        b"O1\nG21 G90 G94 G17 G40 G49 G80 G54\n#1=1.\n#2=2.\nN10 G90\nIF [#1 NE #2] THEN #1=#1\n"
        b"G0 X0. Y1.\n#2=1.\nIF [0. EQ 0.] GOTO 10\nM30\n"
    )
    after = {
        line: place
        for line, place, _ in trace(io.BytesIO(data), dialect="fanuc", start=START["fanuc"])
    }
    assert np.isnan(after[6][1])
    assert after[7][1] == 1.0
