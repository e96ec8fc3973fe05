"""The reader against LinuxCNC's own interpreter: what it is certain of is what happens."""

import io
import math
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from interpreter import run_oracle

from gcodejerk.axes import AXES
from gcodejerk.nc import CERTAIN, Start, read_program, trace
from gcodejerk.testing.programs import programs

HERE = Path(__file__).resolve().parent
SHARED = HERE.parents[1].parent / "shared"
STARTUP = "G17 G21 G40 G49 G54 G64 G90 G94 G97"
AT_ZERO = Start(
    positions=dict.fromkeys(AXES, 0.0), offsets={"G54": dict.fromkeys(AXES, 0.0)}, startup=STARTUP
)
TOLERANCE = 1e-6
INSTALLED = [Path("/usr/share/linuxcnc"), Path("/usr/share/doc/linuxcnc")]

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]


def tool_table(folder):
    """Five tools, one of them with a length."""
    table = folder / "tools.tbl"
    table.write_text("".join(f"T{n} P{n} Z{z} D5\n" for n, z in enumerate((1, 12.5, 3, 4, 5), 1)))
    return table


def interpret(path, folder):
    """Moves of a program: (line, what, positions of the axes that it states), and the refusal."""
    table = folder / "tools.tbl"
    tools = ["--tool-table", table] if table.exists() else []
    try:
        done = run_oracle(path, "--startup", STARTUP, *tools, timeout=5)
    except subprocess.TimeoutExpired:
        return [], "endless"
    moves, plane = [], "G17"
    for row in done.stdout.splitlines():
        if not re.match(r"\d+ [A-Z]", row):
            continue  # printed by the program itself
        line, what, *values = row.split()
        if what == "PLANE":
            plane = values[0]
        elif what in ("TRAVERSE", "FEED"):
            moves.append((int(line), what, dict(zip("XYZABC", map(float, values), strict=True))))
        elif what == "ARC":
            first, second, along = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}[plane]
            a, b, _, _, c = map(float, values[:5])
            moves.append((int(line), what, {first: a, second: b, along: c}))
        elif what in ("PROBE", "RIGID_TAP"):
            moves.append((int(line), what, {}))
    return moves, done.stderr.strip()


def last_of_each_visit(moves):
    """The end of every visit of a line: what stands there after its last move."""
    return [
        move
        for move, following in zip(  # noqa: B905 - one longer
            moves, [*moves[1:], (None, None, None)]
        )
        if following[0] != move[0]
    ]


def disagreements(data, moves, start, refused=False):
    """Known positions and certain rapids that the interpreter contradicts.

    What it did before it refused a program counts; what it did not do then does not.
    """
    wrong = []
    after = {line: positions for line, positions, _ in trace(io.BytesIO(data), start=start)}
    for line, what, stated in last_of_each_visit(moves):
        for axis, value in stated.items():
            known = after[line][AXES.index(axis)]
            if not math.isnan(known) and abs(known - value) > TOLERANCE:
                wrong.append(f"line {line} {what}: {axis} is {value}, read as {known}")
    rapids = read_program(io.BytesIO(data), start=start).rapids
    certain = {}
    for i in range(len(rapids)):
        if rapids.reason[i] == CERTAIN:
            certain[int(rapids.line[i])] = rapids.target[i]
    visited = set()
    for line, what, stated in moves:
        if line in certain:
            visited.add(line)
            if what != "TRAVERSE":
                wrong.append(f"line {line} is {what}, read as a rapid")
            for axis, value in stated.items():
                known = certain[line][AXES.index(axis)]
                if not math.isnan(known) and abs(known - value) > TOLERANCE:
                    wrong.append(f"line {line} goes to {axis}{value}, read as {known}")
    if not refused:
        wrong += [f"line {line} makes no rapid" for line in sorted(set(certain) - visited)]
    return wrong, len(certain), len(after)


def uses_other_files(data):
    """Whether lines of other files may run: their numbers would be taken for this file's."""
    defined = set(re.findall(rb"(?im)^\s*o\s*<?([^>\s]+)>?\s+sub", data))
    called = set(re.findall(rb"(?im)^[^(;\n]*o\s*<?([^>\s]+)>?\s+call", data))
    numbered = re.search(rb"(?im)^[^(;\n]*m98", data)
    return bool(called - defined) or bool(numbered)


def real_files():
    found = sorted(SHARED.glob("hosts/nc/*__linuxcnc*.ngc"))
    for folder in INSTALLED:
        found += sorted(folder.rglob("*.ngc"))
    small = {path.read_bytes(): path for path in found if path.stat().st_size < 400_000}
    return sorted(small.values())  # each content once


PARTS = 3
"""Of the real files, for as many cores."""
MANY = 3_000
"""Moves of a program that is read from one start alone."""


@pytest.mark.parametrize("part", range(PARTS))
def test_every_real_file_reads_as_the_interpreter_runs_it(tmp_path, part):
    files = real_files()[part::PARTS]
    if not files:
        pytest.skip("neither the shared programs nor LinuxCNC's examples are here")
    tool_table(tmp_path)
    results = [interpret(path, tmp_path) for path in files]
    compared = certain = 0
    wrong = []
    for path, (moves, refusal) in zip(files, results, strict=True):
        data = path.read_bytes()
        if not moves or uses_other_files(data):
            continue
        compared += not refusal
        # Long loops move alike from anywhere.
        for start in (Start(startup=STARTUP), AT_ZERO)[: 1 if len(moves) > MANY else 2]:
            found, rapids, _ = disagreements(data, moves, start, bool(refusal))
            certain += rapids
            wrong += [f"{path.name}: {message}" for message in found]
    assert not wrong, "\n".join(wrong[:50])
    assert compared > 20 / PARTS
    assert certain > 1000 / PARTS


# without shrinking: each try costs a run of the interpreter
@settings(
    max_examples=60,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(programs())
def test_drawn_programs_read_as_the_interpreter_runs_them(tmp_path, data):
    tool_table(tmp_path)
    path = tmp_path / "part.ngc"
    path.write_bytes(data)
    moves, refusal = interpret(path, tmp_path)
    for start in (Start(startup=STARTUP), AT_ZERO):
        wrong, _, _ = disagreements(data, moves, start, bool(refusal))
        assert not wrong, f"{data.decode()}\n{wrong}\n{refusal}"


# Each is there because some reader, or an earlier version of this one, took it differently.
CASES = [
    b"F100 G0 X1 G80\nX2\nM2\n",
    b"F100 G81 G80 X1\nM2\n",
    b"G0\nX1\nM2\n",
    b"F100\nG1\nX1\nM2\n",
    b"F100\nG2\nX1\nM2\n",
    b"F100\nG2 I5\nX1 I3\nM2\n",
    b"F100\nG2 I5\nG0 X1 I5\nM2\n",
    b"F100\nG1 X5 R5\nM2\n",
    b"F100\nG2 X5 R5\nM2\n",
    b"F100\nG2 X5 Z3 R5\nM2\n",
    b"F100\nG2 Z3 I5\nM2\n",
    b"F100\nG2 Z3 R5\nM2\n",
    b"F100\nG2 X5 I2.5 K3\nM2\n",
    b"F100\nG2 X5 I2.5 R5\nM2\n",
    b"G0 N10 X1\nM2\n",
    b"N10 /G0 X1\nM2\n",
    b"/N10 G0 X1\nM2\n",
    b"N-5 G0 X1\nM2\n",
    b"N5.5 G0 X1\nM2\n",
    b"G0 X1\n%\nX2\nM2\n",
    b"%\nG0 X1\n%\nX2\nM2\n",
    b"O1000\nG0 X1\nM2\n",
    b"G0 X1\nO1000\nX2\nM99\nM2\n",
    b"G7 G0 X10\nG91 X4\nG8 X1\nM2\n",
    b"G0 X5 Y5\nG52 X1\nG0 Y7\nG52 X0 Y0\nX3\nM2\n",
    b"G0 X5 Y5\nG92 X1\nG0 Y7\nG92.1\nZ3\nM2\n",
    b"G0 X5 Y5\nG91 G92 X1\nG0 Y7\nG92.2\nZ3\nG92.3\nZ1\nM2\n",
    b"G0 X5\nG7 G92 X1\nY1\nM2\n",
    b"G20 F10\nG21\nG1 X5\nM2\n",
    b"F100 G0 Z10\nG99 G81 X1 Y1 Z-1 R2\nG98 X2\nX3\nM2\n",
    b"F100 G0 Z10\nG98 G81 X1 Y1 Z-1 R12\nX3\nG80\nG0 Y3\nM2\n",
    b"F100 G0 Z10\nG91 G98 G81 X1 Y1 Z-1 R-5 L3\nX3\nG80\nG0 Y3\nM2\n",
    b"F100 G0 Z10\nG90 G98 G81 X1 Y1 Z-1 R2 L3\nX3\nM2\n",
    b"F100 G0 Z10\nG18 G98 G81 X1 Y-1 R2 L1\nX3\nM2\n",
    b"F100 G0 Z10\nG81 X1 Z-1 R2 L0\nM2\n",
    b"F100 G0 Z10\nG81 X1 Z-1\nM2\n",
    b"F100 G0 Z10\nG81 Z-1 R3\nM2\n",
    b"F100 G0 Z10\nG81 R3\nX1\nM2\n",
    b"F100 G0 Z10\nG82 X1 Z-1 R3 P1\nG81 X2\nM2\n",
    b"F100 G0 Z10\nG82 X1 Z-1 R3 P1\nG81 X2 Z-1\nM2\n",
    b"F100 G0 Z10\nG82 X1 Z-1 R3 P1\nG82\nY5\nG82 Y6\nM2\n",
    b"F100 G0 Z10\nG81 X1 Z-1 R3 A5\nM2\n",
    b"F100 G0 Z10\nG85 X1 Z-1 R3\nG89 X2 Z-2 P1\nG73 X2 Z-2 Q.5\nG83 X5 Z-3 Q.4\nM2\n",
    b"F100 G2 X2 I1\nI1\nM2\n",
    b"F100 G2 X2 I1\nJ1 F100\nM2\n",
    b"G0 X1E3\nM2\n",
    b"G0 X-#1\nM2\n",
    b"#1=3 G0 X-[1+#1]\nM2\n",
    b"G0 X- 5\nM2\n",
    b"g0x +0. 12 34y 7\nM2\n",
    b"G 0 X 1\nM2\n",
    b"% \nG0 X1\nM2\n %\n",
    b"%(x)\nG0 X1\nM2\n",
    b"G0 X1 M7 M8\nM2\n",
    b"G0 X1 G54 \nG0 X1 G4 P.1 G92.1\nM2\n",
    b"G28 G0 X1 \nM2\n",
    b"G92 G0 X1 \nM2\n",
    b"G0 X1\nG92.1 G0 X2\nG92 Z3\nX5\nM2\n",
    b"G0 X1\nG53 X3\nG53 G1 F100 X4\nG91 G53 G0 X1\nM2\n",
    b"F100\nG33 Z-1 K1\nM2\n",
    b"M3 S10\nG33.1 Z-1 K1\nM2\n",
    b"F100\nG76 P1 Z-1 I-1 J.1 K.5 Q29.5\nM2\n",
    b"F100\nG5 X1 Y1 I1 J1 P-1 Q-1\nG1 Y3\nG5.1 X5 Y5 I1 J1\nM2\n",
    b"G0 X1 D5\nM2\n",
    b"G0 X1 L5\nM2\n",
    b"G0 X1 P5\nM2\n",
    b"G0 X1 H5\nM2\n",
    b"G64 P.1 Q.2\nG0 X1 G64 P1\nM2\n",
    b"G0 X1 T1 S100 F100\nM2\n",
    b"G0 X1 ;c (d\nG0 X2 (a) Y3 (b)\nG0 X3 (a;b) Z1\nM2\n",
    b"G93 G1 X1\nM2\n",
    b"G93 G1 X1 F3\nX2\nM2\n",
    b"G93 G1 X1 F3\nG94 X2\nM2\n",
    b"F50 G94 G1 X1\nG95 X2\nM2\n",
    b"G43 H1\nG0 Z5\nG49\nG0 X5\nM2\n",
    b"G54 G0 X5\nG10 L2 P1 R90\nX7\nY1\nM2\n",
    b"G0 X5 G17.1\nM2\n",
    b"G0 U5 V2 W1\nM2\n",
    b"F100 G99 G81 X1 Z-1 R5\nG91 X2\nG90 G0 Z20\nG81 X5 Z-1 R3\nG98 X6\nM2\n",
    b"G0 G41 D4 X5\nY5\nM2\n",
    b"G17 G0 X1 G18 G19\nM2\n",
    b"G01.0 F100. X00001.500\nM2\n",
    b"G0 X1 G90.1 G61.1 M3 S10 M8\nM2\n",
    b"F10 G20 G0 Z.25\nG98 G81 X1 Y1 Z-.1 R.1\nX2\nM2\n",
    b"F10 G20 G0 Z.25\nG81 X1 Y1 Z-.1 R.025\nX2\nG80\nG0 X3\nG81 X3 Z-.1 R.025\nM2\n",
    b"F10 G20 G99 G0 Z.25\nG1 X1 Y1 Z.1\nG98 G81 X1 Y1 Z-.1 R.025\nM2\n",
    b"O100 if [1]\nG0 X1\nO100 endif\nG0 Y1\nM2\n",
    b"G0 X0\nO1 repeat [3]\nG91 X1\nG90\nO1 endrepeat\nG0 Y1\nM2\n",
    b"o1 sub\nG0 X5\no1 endsub\nG0 Y1\no1 call\nG0 Z1\nM2\n",
    b"G0 X1 (a) M2\nX5\n",
    b"F100 G83 G98 X1 Z-3 R1 Q.5 L2\nG0 X2\nM2\n",
    b"G0 X1 #1=3\nM2\n",
    b"#1=5 #2=6 G0 X#1 Y#2\nM2\n",
    b"G0 X[1+[2*3]]Y[sin[30]]Z[atan[1]/[2]]\nM2\n",
    b"G0X1Y2F100G1Z3\nM2\n",
    b"F100 G1 X1\nG80\nG0\nX3\nM2\n",
    b"G91 G0 X1\nG28 X1\nX1\nM2\n",
    b"G90 G0 X1 A10 B20 C30\nG91 A10\nG20 A1 X1\nM2\n",
    b"G0 X5\nG43.1 Z5\nG0 Z1\nG49\nG0 X1\nM2\n",
    b"G0 Z5\nT2 M6\nG43\nG0 X5\nM2\n",
    b"G0 Z5 X0\nG43 H2\nG0 X5\nM2\n",
    b"G0 X5 Y5\nG10 L20 P1 X0\nG0 Y0\nM2\n",
    b"G0 X5 Y5\nG10 L2 P2 X10\nG55\nG0 Y0\nM2\n",
    b"G0 X5\nG92 X0\nG54 G0 Y1\nG55\nG0 Y3\nM2\n",
    b"M70\nG91\nM72\nG0 X1\nX2\nM2\n",
    b"G0 X1\nG5.2 X1 Y1 L3 P1\nX2 Y2 P1\nG5.3\nG0 X1\nM2\n",
    b"G18 F100 G2 X1 Z1 R5\nG19 G3 Y3 Z3 R9\nG0 X0\nM2\n",
    b"F100 G2 X2 I1 P2\nX4 I1\nM2\n",
    b"G0 X1 M3 M5\nM2\n",
    b"G0 X1\nG38.2 Z-1 F10\nG0 Z1\nM2\n",
    b"G0 X1.\nX2..\nM2\n",
    b"G94 G93 G0 X1\nM2\n",
    b"G0 X1000000000000\nM2\n",
    b"G0 @5 ^30\nM2\n",
    b"G0 X1 /Y2\nM2\n",
    b"%\n%\nG0 X1\n",
    b"G0 X-0\nG-0 X1\nM2\n",
    b"G00.0 X1\nG0.04 X2\nM2\n",
    b"G1.5 X1\nM2\n",
    b"G0 X1;M2\nX2\nM2 X3\n",
    b"G76 P1 Z-1 I-1 J.1 K.5 Q29.5 X3\nM2\n",
    b"G0 X1 G49\nG0 X2 G43 H2\nX3\nM2\n",
    b"G90 G53 G0 X1 Y1\nG54 Z1\nM2\n",
    b"G0 X#<_x> \nM2\n",
    b"N1\nG0 N\nM2\n",
    b"G61 G0 X1 P5\nM2\n",
    b"F100 G1 Z1 S100\nS-5\nM2\n",
    b"F-5\nM2\n",
    b"G0 X1\nM90 M3 S1\nM3 M90\nX2\nM2\n",
    # the level of G98 is where the series began, and R may be another one in each block
    b"F100 G0 Z1\nG98 G81 X1 Y1 Z-5 R2\nX3 R1.5\nX4 R5\nX5 R4\nG80\nG0 X9\nM2\n",
    b"F100 G0 Z1\nG98 G81 X1 Y1 Z-5 R2\nM3 S9\nX3 R1.5\nG80\nG81 X5 Z-4 R1\nM2\n",
    # in G91 every block of a series counts R from that level
    b"F100 G0 Z10\nG91 G99 G81 X1 Y1 Z-5 R-3 L2\nX3\nX2\nG80\nG0 X1\nM2\n",
    b"F100 G0 Z10\nG91 G98 G81 X1 Y1 Z-5 R-3 L2\nX3\nX2 R3\nX2\nG80\nG0 X1\nM2\n",
    b"F100 G0 Z10\nG99 G81 X1 Y1 Z-5 R2\nG91\nX5\nG90 X7\nG80\nG0 X9\nM2\n",
    b"F100 G0 Z10\nG98 G81 X1 Y1 Z-5 R-6\nG0 X3\nM2\n",
    b"o1 call\nG0 X1\nM2\no1 sub\nG0 X5\no1 endsub\n",
    b"o1 sub\nG0 X#1 Y#2 Z#30\no1 endsub\no1 call [3]\nG0 Z1\nM2\n",
    b"#1=7 #<a>=3\no1 sub\n#1=9 #31=4 #<a>=8\no1 endsub\no1 call [3]\nG0 X#1 Y#31 Z#<a>\nM2\n",
    b"o1 sub\nG0 X1\no1 return [5]\nG0 X2\no1 endsub [7]\no1 call\nG0 X#<_value>\nM2\n",
    b"o1 repeat [2.6]\nG91 G0 X1\no1 endrepeat\no2 repeat [-1]\nX1\no2 endrepeat\nY1\nM2\n",
    b"o1 sub\nG91\nM73\nG21\nG90\no1 endsub\no1 call\nG0 X1\nX1\nM2\n",
    b"o1 if [1]\no2 sub\nG0 X1\no2 endsub\no1 endif\no2 call\nG0 Y1\nM2\n",
    b"o1 sub\nG0 X1\nM2\no1 endsub\no1 call\nG0 X2\nM2\n",
    b"o1 sub\nG0 X1\no1 endsub\no1 sub\nG0 X2\no1 endsub\no1 call\nM2\n",
    b"#1=5 G0 X#1\n#1=6 #2=#1\nG0 X#1 Y#2\nX-#1 Y-[#1] Z+#1\nM2\n",
    b"o1 sub\no2 if [#1 GT 3]\nG0 X#1\no1 return\no2 endif\no1 call [#1+1]\nY#1\no1 endsub\n"
    b"o1 call [0]\nG0 Z1\nM2\n",
    b"o<a b> sub\nG0 X#1\no<AB> endsub\no<ab> call [1+1] [3]\nG0 Y1\nM2\n",
    b"o1 sub\nT2 M6\nG43\nG0 Z5\no1 endsub\no1 call\nG0 X1\no1 call\nG0 Z1\nM2\n",
    # a repeat that a return leaves goes on later with the count that it had
    b"o100 sub\no101 repeat [3]\n#1=[#1+1]\no103 if [#1 EQ 2]\no100 return\no103 endif\n"
    b"G91 G0 X1\nG90\no101 endrepeat\no100 endsub\no100 call [0]\nG0 Y1\no100 call [10]\n"
    b"G0 Z1\nM2\n",
    # a break is remembered by the interpreter, and ends a later do
    b"#1=0\no1 while [#1 LT 3]\n#1=[#1+1]\no2 if [#1 EQ 1]\no1 break\no2 endif\no1 endwhile\n"
    b"#2=0\no3 do\n#2=[#2+1]\nG0 X#2\no3 while [#2 LT 3]\nG0 Y1\nM2\n",
    b"G0 X1 Y1\nG10 L2 P1 R45\nG0 X2\nG53 G0 Y2\nG0 Z1\nG10 L2 P1 R0\nG0 Y1\nM2\n",
    b"o1 while [#5420 LT 3]\nG91 G0 X1\no1 endwhile\nG90 G0 Y1\nM2\n",
]


def test_odd_programs_read_as_the_interpreter_runs_them(tmp_path):
    tool_table(tmp_path)
    paths = []
    for k, data in enumerate(CASES):
        paths.append(tmp_path / f"{k}.ngc")
        paths[-1].write_bytes(data)
    results = [interpret(path, tmp_path) for path in paths]
    assert sum(bool(moves) for moves, _ in results) > len(CASES) // 2
    for data, (moves, refusal) in zip(CASES, results, strict=True):
        # Long loops move alike from anywhere.
        for start in (Start(startup=STARTUP), AT_ZERO)[: 1 if len(moves) > MANY else 2]:
            wrong, _, _ = disagreements(data, moves, start, bool(refusal))
            assert not wrong, (data, wrong, refusal)
