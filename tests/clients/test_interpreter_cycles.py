"""Cycles written out against LinuxCNC's own interpreter: the same calls as its own expansion."""

import io
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from interpreter import run_oracle

from gcodejerk.cycles.expansion import expand
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import Start
from gcodejerk.rewrite.pipeline import process
from gcodejerk.testing.cycles import cycle_programs

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SHARED = ROOT.parent / "shared"
INSTALLED = (Path("/usr/share/linuxcnc"), Path("/usr/share/doc/linuxcnc"))
STARTUP = "G17 G21 G40 G49 G54 G64 G80 G90 G94 G97"
TOLERANCE = 2e-6
STILL = 1e-7
CYCLES = re.compile(rb"(?im)^[^(;\n]*g(73|8[1-9])\b")

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]


def calls(data, path):
    """Rapids, feed moves, dwells and feeds of a program, and the interpreter's refusal.

    Moves that stand still are left out, and so are dwells of no time.
    """
    path.write_bytes(data)
    table = HERE / "linuxcnc" / "sim.tbl"
    run = run_oracle(path, "--tool-table", table, "--startup", STARTUP, timeout=120)
    at, out = None, []
    for line in run.stdout.splitlines():
        what, values = line.split()[1:2], line.split()[2:]
        if what not in (["TRAVERSE"], ["FEED"], ["DWELL"], ["FEEDRATE"]):
            continue
        numbers = [float(value) for value in values]
        if what in (["TRAVERSE"], ["FEED"]):
            if at is not None and close(at, numbers, STILL):
                continue
            at = numbers
        if what != ["DWELL"] or numbers != [0.0]:
            out.append((what[0], numbers))
    return out, run.stderr.strip()


def close(one, other, tolerance=TOLERANCE):
    """Whether numbers agree."""
    return len(one) == len(other) and all(
        abs(a - b) <= tolerance for a, b in zip(one, other, strict=True)
    )


def assert_same(before, after, program):
    """Compare two lists of calls."""
    for k, (one, other) in enumerate(zip(before, after, strict=False)):
        same = one[0] == other[0] and close(one[1], other[1])
        assert same, f"call {k}: {one} became {other}\n{program.decode('latin-1')}"
    assert len(before) == len(after), program.decode("latin-1")


def written(program):
    """The program with its cycles written out, and how many blocks were."""
    target = io.BytesIO()
    found = expand(io.BytesIO(program), target, start=Start(startup=STARTUP))
    return (target.getvalue() if found.written else program), found


# without shrinking: each try costs two runs of the interpreter
@settings(
    max_examples=60, deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)
@given(cycle_programs())
def test_drawn_cycles_make_the_moves_of_the_interpreters_own(tmp_path, program):
    text, found = written(program)
    assert not found.findings
    assert found.written == found.holes
    before, refusal = calls(program, tmp_path / "a.ngc")
    after, refused = calls(text, tmp_path / "b.ngc")
    assert not refusal, program.decode()
    assert not refused, program.decode()
    assert_same(before, after, program)


HEAD = b"G21 G90 G98 F100\nM3 S500\nG0 X0 Y0 Z10\n"
# Each is there because the manual leaves it open, or an earlier version here took it differently.
CASES = [
    b"G81 X1 Y1 Z-5 R2 L3\n",
    b"G91 G81 X1 Y1 Z-5 R-7 L3\nX3\n",
    b"G91 G99 G81 X1 Y1 Z-5 R-3 L2\nX3\nX2 R3\nX1\n",
    b"G0 Z1\nG81 X1 Y1 Z-5 R2\nX3 R1.5\nX4 R5\nX5 R4\n",
    b"G0 Z1\nG91 G81 X1 Y1 Z-5 R2 L2\nX3\n",
    b"G99 G81 X1 Y1 Z-5 R2\nX3 R5\nX4 R3\nG98\nX5\nX6\nG99\nX7\nG98 X9 R1 L2\n",
    b"G99 G81 X1 Y1 Z-5 R2\nG91\nX5\nG90 X7\n",
    b"G83 X1 Y1 Z-.5 R0 Q.1\n",
    b"G83 X1 Y1 Z-5 R2 Q2\nX3 Q.7\nX4 Z-6\n",
    b"G73 X1 Y1 Z-1 R0 Q.1\nG73 X2 Z-1 R0 Q.3\n",
    b"G83 X1 Z-1 R1 Q.2\nG99 X2 Q.25\n",
    b"G91 G83 X1 Z-1 R-9.3 Q.1\nX1 Q.3\n",
    b"G81 X1 Z2 R2\n",
    b"G82 X1 Z-5 R2 P0\nG82 X2\nP.5 X3\nG89 X4 Z-5 R1 P.1\nG85 X5 Z-3 R1\nY4\n",
    b"G18 G99 G82 X1 Z1 Y-5 R2 P.1 L2\nX4\n",
    b"G19 G98 G73 Y1 Z1 X-5 R2 Q3.5 L2\nZ4\n",
    b"G20\nF5 G0 Z1\nG83 X1 Y1 Z-.5 R.1 Q.2\nX2\n",
    b"G95 F.2\nG81 X1 Y1 Z-5 R2\n",
    b"G81 X1 Y1 Z-5 R2 F50\nF60 X3\n(a)\nM8\nG4 P.5\nX4 M1\nM0\nX5\n",
    b"G81 X1 Y1 Z-5 R2\nG0\nG81 X3 Z-4 R1\nG1 Z3\nG81 X5 Z-4 R1\n",
    b"G7\nG18 G81 X10 Y-1 R2\nX20\n",
]


def test_cases_make_the_moves_of_the_interpreters_own(tmp_path):
    for k, case in enumerate(CASES):
        program = HEAD + case + b"G80\nG0 X9\nM2\n"
        text, found = written(program)
        assert found.written == found.holes > 0, (case, found.findings)
        before, refusal = calls(program, tmp_path / f"a{k}.ngc")
        after, refused = calls(text, tmp_path / f"b{k}.ngc")
        assert (refusal, refused) == ("", ""), case
        assert_same(before, after, program)


def test_the_spindle_is_stopped_and_started_as_the_interpreter_does(tmp_path):
    program = HEAD + b"G86 X1 Z-5 R2 P.1\nM4\nX3\nG80\nM2\n"
    text, found = written(program)
    assert found.written == 2
    told = []
    for k, data in enumerate((program, text)):
        path = tmp_path / f"{k}.ngc"
        path.write_bytes(data)
        run = subprocess.run(["rs274", "-g", path], capture_output=True, text=True, check=False)
        lines = re.findall(r"(?:STRAIGHT|DWELL|START_SPINDLE|STOP_SPINDLE).*", run.stdout)
        told.append([line for k, line in enumerate(lines) if line != lines[k - 1]])
    assert told[0] == told[1]
    assert sum("START_SPINDLE" in line for line in told[0]) == 4


def real_files():
    """Every real program that holds a cycle, each content once."""
    found = [*sorted(SHARED.glob("hosts/nc/*.ngc")), ROOT / "samples" / "holes.ngc"]
    for folder in INSTALLED:
        found += sorted(folder.rglob("*.ngc"))
    return list({p.read_bytes(): p for p in found if CYCLES.search(p.read_bytes())}.values())


def test_real_programs_make_the_same_moves_with_their_cycles_written_out(tmp_path):
    paths = real_files()
    compared = blocks = 0
    for k, path in enumerate(paths):
        program = path.read_bytes()
        text, found = written(program)
        if not found.written:
            continue
        before, refusal = calls(program, tmp_path / f"a{k}.ngc")
        if refusal:
            continue
        after, refused = calls(text, tmp_path / f"b{k}.ngc")
        assert not refused, (path, refused)
        assert_same(before, after, text)
        compared += 1
        blocks += found.written
    assert compared >= 1
    if SHARED.exists():
        assert compared >= 5
        assert blocks >= 60


def visits(places, wanted):
    """Whether all wanted calls occur in this order."""
    rest = iter(places)
    return all(
        any(call[0] in kinds and close(call[1], at) for call in rest) for kinds, at in wanted
    )


@pytest.mark.parametrize("path_mode", [b"", b"G64 P0.05\n", b"G61\n"])
def test_rapids_of_cycles_end_where_the_interpreter_ends_them(tmp_path, path_mode):
    vmc = Machine.load(find_machine("vmc"))
    program = path_mode + HEAD + b"G83 X1 Y1 Z-5 R2 Q3\nX30\nG82 X9 Z-5 R2 P.5\nG80\nG0 X0\nM2\n"
    result = process(program, vmc, expand_cycles=True)
    assert result.planned >= 12
    before, _ = calls(program, tmp_path / "a.ngc")
    after, refused = calls(result.output, tmp_path / "b.ngc")
    assert not refused
    kinds = {"TRAVERSE": ("TRAVERSE", "FEED"), "FEED": ("FEED",), "DWELL": ("DWELL",)}
    assert visits(after, [(kinds[what], at) for what, at in before if what in kinds])
