"""The reader against LinuxCNC's own interpreter: what it is certain of is what happens."""

import io
import math
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from gcodejerk.nc import AXES, CERTAIN, Start, read_program, trace
from gcodejerk.testing.programs import programs

HERE = Path(__file__).resolve().parent
SHARED = HERE.parents[1].parent / "shared"
PYTHON = "/usr/bin/python3"
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
    command = [PYTHON, str(HERE / "oracle.py"), str(path), "--startup", STARTUP]
    if table.exists():
        command += ["--tool-table", str(table)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=20)
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
    called = set(re.findall(rb"(?im)^[^(;]*o\s*<?([^>\s]+)>?\s+call", data))
    numbered = re.search(rb"(?im)^[^(;]*m98", data)
    return bool(called - defined) or bool(numbered)


def real_files():
    found = sorted(SHARED.glob("hosts/nc/*__linuxcnc*.ngc"))
    for folder in INSTALLED:
        found += sorted(folder.rglob("*.ngc"))
    return [path for path in found if path.stat().st_size < 2_000_000]


def test_every_real_file_reads_as_the_interpreter_runs_it(tmp_path):
    files = real_files()
    if not files:
        pytest.skip("neither the shared programs nor LinuxCNC's examples are here")
    tool_table(tmp_path)
    with ThreadPoolExecutor() as pool:
        results = list(pool.map(lambda path: interpret(path, tmp_path), files))
    compared = certain = 0
    wrong = []
    for path, (moves, refusal) in zip(files, results, strict=True):
        data = path.read_bytes()
        if not moves or uses_other_files(data):
            continue
        compared += not refusal
        for start in (Start(startup=STARTUP), AT_ZERO):
            found, rapids, _ = disagreements(data, moves, start, bool(refusal))
            certain += rapids
            wrong += [f"{path.name}: {message}" for message in found]
    assert not wrong, "\n".join(wrong[:50])
    assert compared > 20
    assert certain > 1000


# without shrinking: each try costs ten runs of the interpreter
@settings(
    max_examples=6,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(st.lists(programs(), min_size=10, max_size=10))
def test_drawn_programs_read_as_the_interpreter_runs_them(tmp_path_factory, drawn):
    folder = tmp_path_factory.mktemp("drawn")
    tool_table(folder)
    paths = []
    for k, data in enumerate(drawn):
        paths.append(folder / f"{k}.ngc")
        paths[-1].write_bytes(data)
    with ThreadPoolExecutor() as pool:
        results = list(pool.map(lambda path: interpret(path, folder), paths))
    for path, (moves, refusal) in zip(paths, results, strict=True):
        for start in (Start(startup=STARTUP), AT_ZERO):
            wrong, _, _ = disagreements(path.read_bytes(), moves, start, bool(refusal))
            assert not wrong, f"{path.read_bytes().decode()}\n{wrong}\n{refusal}"
