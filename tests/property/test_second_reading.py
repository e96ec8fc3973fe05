"""The second reading against the first: no false alarm, and every mistake of the first noticed.

The first reading's results are falsified here, rapid by rapid, as a mistake in `nc` would falsify
them; what the programs say is not touched.
"""

import io
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.nc.dialects import DIALECTS
from gcodejerk.testing.cycles import cycle_programs
from gcodejerk.testing.programs import programs
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm
from gcodejerk.verification.second_reading.ahead import Ahead
from gcodejerk.verification.second_reading.tracking import Tracker

WRITTEN = sorted(name for name, dialect in DIALECTS.items() if dialect.writing is not None)
CALM = settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
KNOWN = dict.fromkeys("XYZABC", 0.0)


def start_of(dialect, known=True):
    return Start(
        positions=KNOWN if known else {},
        offsets={"G54": KNOWN, "G55": dict.fromkeys("XYZ", 7.0)} if known else {},
        tool_lengths={1: 12.5},
        decimal_point="calculator",
        diameter="lathe" in dialect,
        startup={"siemens": "G71", "klartext": ""}.get(dialect, "G21") if known else "",
        wraps={"A": "none", "B": "shortest", "C": "sign"} if known else {},
        spindle="mill" if known else None,
        limits=dict.fromkeys("XYZABCUVW", (300.0, 2500.0, 6e5)) if known else {},
    )


def read(data, dialect, start):
    return read_program(io.BytesIO(data), dialect=dialect, start=start).rapids


def judge(data, dialect, start, rapids, rows=None):
    """Violations and how many rapids are confirmed."""
    rows = np.flatnonzero(rapids.reason == CERTAIN) if rows is None else rows
    found = Findings(100)
    confirmed = confirm(io.BytesIO(data), dialect, start, rapids, rows, found)
    return found.violations, confirmed


TWINS = {"edingcnc", "planetcnc", "mazatrol-eia"}
"""Their tables are those of uccnc and mitsubishi but for the name."""


@pytest.mark.parametrize("dialect", [*(d for d in WRITTEN if d not in TWINS), "klartext"])
@CALM
@given(st.data(), st.booleans())
def test_the_second_reading_agrees_with_the_first(dialect, data, known):
    program, start = data.draw(programs(dialect)), start_of(dialect, known)
    violations, _ = judge(program, dialect, start, read(program, dialect, start))
    assert not violations


LINES = [
    *("G0 X1. Y2.", "G0 Z5.", "X3.5", "Y-2.", "Z-.5", "X1. Y1. Z1.", "G1 X2. F90.", "G1 Y3."),
    *("G2 X3. Y1. I1. J0.", "G3 X0. Y0. R5.", "X5. (so)", "N7 X4.", "G1 X9.", "Y8. F70."),
]
ODD = [
    *("X1. X2.", "G1 X2. Z3. Z4.", "X6. (expr, a=5)", "X6. (print, a)", "X6. (py,a)", "F0", "G91"),
    *("G90", "G20", "M98 P1", "U1.", "E5.", "T1", "D1", "x1.", "G41", "G40", "X1E2", "Y9. Y", "@"),
]


@settings(CALM, max_examples=150)
@given(st.sampled_from(sorted({*WRITTEN, "planetcnc"})), st.booleans(), st.booleans(), st.data())
def test_what_is_taken_at_once_is_confirmed_no_sooner_than_line_by_line(dialect, fed, known, data):
    run = st.lists(st.sampled_from(LINES), min_size=4, max_size=20)
    odd = st.lists(st.sampled_from(ODD), max_size=2)
    parts = data.draw(st.lists(st.tuples(run, odd), min_size=1, max_size=4))
    lines = ["G21 G90 G94 G17 G40", "G0 X0. Y0. Z0.", *["G1 X1. F100."] * fed]
    lines += [line for run, odd in parts for line in (*run, *odd)]
    program, start = "\n".join([*lines, ""]).encode(), start_of(dialect, known)
    rapids = read(program, dialect, start)
    violations, confirmed = judge(program, dialect, start, rapids)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Ahead, "take", lambda *_: None)
        patch.setattr(Tracker, "take_run", lambda *_: None)
        slowly, sure = judge(program, dialect, start, rapids)
    assert not violations
    assert not slowly
    assert confirmed <= sure


def test_where_the_last_digit_decides_about_a_whole_turn_the_axis_is_unknown():
    """104.84 from -615 deg is 104.84 - 720 + 360, which is not 104.84 - 360 to the last bit."""
    assert 104.84 - 720.0 + 360.0 != 104.84 - 360.0
    program = b"F300\nG0 X0 C-87\nC-105\nC104.84\nC104.84\nX2\nC-30\nX5\nM2"
    start = start_of("linuxcnc")
    rapids = read(program, "linuxcnc", start)
    again = np.flatnonzero(rapids.line == 5)
    assert (rapids.reason[again] != CERTAIN).all()
    assert np.isnan(rapids.target[again, AXES.index("C")]).all()
    assert not judge(program, "linuxcnc", start, rapids)[0]


@pytest.mark.parametrize("wrap", ["none", "shortest", "sign"])
def test_a_rotary_axis_that_counts_turns_does_so_in_a_run_of_feed_moves(wrap):
    run = b"Z105.9 X162.3\nY0. X199.9 Z-188.75\nA10. C-104.4 Z-49.5\n"
    data = b"G1 F100\n" + run * 5 + b"G1 Z180\nG0 Y190. X-120.\nY77. C-65.98\n"
    start = replace(start_of("linuxcnc"), wraps=dict.fromkeys("ABC", wrap))
    rapids = read(data, "linuxcnc", start)
    assert np.count_nonzero(rapids.reason == CERTAIN) == 2
    violations, confirmed = judge(data, "linuxcnc", start, rapids)
    assert not violations
    assert confirmed == (2 if wrap == "none" else 1)


@pytest.mark.parametrize("wrap", ["none", "shortest", "sign"])
def test_a_rotary_word_that_nobody_can_read_leaves_its_axis_unknown(wrap):
    """Whether grbl takes degrees where G20 is in force, builds decide."""
    data = b"G21 G90\nG0 X1 A4\nG20\nG0 A0.39 X0.5\nG21\nG0 X9\nG0 A8\nG0 A9\nM2\n"
    start = replace(start_of("grbl"), wraps={"A": wrap})
    rapids = read(data, "grbl", start)
    violations, _ = judge(data, "grbl", start, rapids)
    assert not violations
    assert np.isnan(rapids.target[rapids.line == 4, AXES.index("A")]).all()
    assert rapids.reason[rapids.line == 6] == CERTAIN


@pytest.mark.parametrize(("spindle", "certain"), [(None, 1), ("mill", 1), ("laser", 0)])
def test_outputs_may_fire_a_beam_only_where_there_is_one(spindle, certain):
    """M106 is a fan, unless the machine file says that the machine burns."""
    data = b"G21\nG90\nG0 F3000 X0 Y0 Z5\nM106 S20\nG0 X9 F2000\nM2\n"
    start = replace(start_of("marlin", known=False), spindle=spindle)
    rapids = read(data, "marlin", start)
    assert judge(data, "marlin", start, rapids) == ([], certain)
    assert np.count_nonzero(rapids.reason == CERTAIN) == certain


ODD_LINES = ["M3 S#1", "M3 S100 {1+2}", 'M3 S100 "fast"', "M03 S=500 (I)", "X4. M220 S50", "M3 S("]


@pytest.mark.parametrize("odd", ODD_LINES)
@pytest.mark.parametrize("dialect", ["rs274", "grbl", "mach", "uccnc", "centroid"])
def test_a_line_that_is_not_understood_makes_no_laser_of_a_mill(dialect, odd):
    head = "G21 G90 G94 G17 G40 G49\nS500 M3\nG0 X0. Y0. Z5.\nG1 Z1. F90.\nG0 Z5.\n"
    program, start = f"{head}{odd}\nG0 X5.\nM30\n".encode(), start_of(dialect)
    rapids = read(program, dialect, start)
    violations, confirmed = judge(program, dialect, start, rapids)
    assert not violations
    assert confirmed >= 1


@pytest.mark.parametrize("habit", ["M3 I", "M3I S100", "G1 X2. S200 F90."])
def test_what_only_a_laser_does_is_seen_a_second_time(habit):
    program = f"G21 G90 G94 G17 G40 G49\nS500 M3\nG0 X1. Y1. Z5.\nG1 X2. F90.\n{habit}\nM30\n"
    start = start_of("grbl")
    rapids = read(program.encode(), "grbl", start)
    assert rapids.reason.tolist() != [CERTAIN]
    violations, _ = judge(program.encode(), "grbl", start, rapids, [0])
    assert any("a beam may be on" in str(violation) for violation in violations)


@CALM
@given(cycle_programs())
def test_the_second_reading_agrees_behind_drilling_cycles(data):
    start = start_of("linuxcnc")
    violations, _ = judge(data, "linuxcnc", start, read(data, "linuxcnc", start))
    assert not violations


PROGRAM = b"""G21 G90 G94 G17 G40 G98 G64 P0.02 F300.
G0 X0. Y0. Z5.
G0 X10. Y5.
X20. M8
G81 X1. Y1. Z-5. R2. F100
X3. Y2.
G80
G0 X30. Y1.
G91 G0 X2. Z1.
G90 G1 X3. F120
G3 X5. Y3. I1. J1.
G0 X7. Y7.
G20
G0 X2. Y1. F7.
G21 G93
G0 X2. Y9.
G94 F50
G61
G0 X4. Y1.
G0 X4. Z1.
M2
"""
"""Of each rapid that is falsified below there is one at least; line numbers count from 1."""


def _shifted(name, axis="X", by=1e-4):
    def change(rapids, i):
        getattr(rapids, name)[i, AXES.index(axis)] += by

    return change


def _put(name, value):
    def change(rapids, i):
        getattr(rapids, name)[i] = value(rapids, i) if callable(value) else value

    return change


def _absolute(rapids, i):
    """G90 taken where G91 is in force."""
    rapids.incremental[i] = False
    rapids.target[i] = np.where(np.isnan(rapids.start[i]), rapids.target[i], 0.0)
    rapids.target[i, 0], rapids.target[i, 2] = 2.0, 1.0


def _millimetres(rapids, i):
    rapids.inch[i] = False
    for column in (rapids.start, rapids.target):
        column[i] /= 25.4


# What nc might believe wrongly, of the rapid in a line of PROGRAM.
MISTAKES = {
    "a start shifted by one step": (3, _shifted("start")),
    "an end shifted by one step": (3, _shifted("target", "Y")),
    "the start of an axis taken from another": (4, _shifted("start", by=-5.0)),
    "a wrong end of a cycle": (20, _shifted("start", "Z", 3.0)),
    "a wrong end of an arc": (12, _shifted("start", "Y", 1.0)),
    "a move forgotten": (12, _shifted("start", "X", -2.0)),
    "G90 taken for G91": (3, _put("incremental", True)),
    "G91 taken for G90": (9, _absolute),
    "inches taken for mm": (14, _millimetres),
    "mm taken for inches": (3, _put("inch", True)),
    "radius taken for diameter": (3, _put("diameter", True)),
    "another F": (3, _put("feed", 303.0)),
    "F of another unit": (14, _put("feed", 7.0 * 25.4)),
    "F that a cycle changed": (8, _put("feed", 300.0)),
    "G94 taken for G93": (16, _put("feed_mode", 94)),
    "G93 taken for G94": (3, _put("feed_mode", 93)),
    "G64 taken for G61": (19, _put("path", 64)),
    "G61 taken for G64": (3, _put("path", 61)),
    "a tolerance lost": (3, _put("path_p", np.nan)),
    "another tolerance": (3, _put("path_p", 0.05)),
    "an axis word overlooked": (3, _put("words", 1)),
    "an axis word invented": (4, _put("words", 3)),
}
NO_RAPIDS = {
    "a feed move": b"G1 X5. F10\n",
    "a modal feed move": b"G1 X5. F10\nX6.\n",
    "a feed move within many": b"G1 X5. F10\nX6.\nX7.\nX8.\nX9.\nX4.\n",
    "an arc": b"G2 X5. Y0. I2.5 J0.\n",
    "a hole": b"G81 X5. Z-1. R1. F10\nX6.\n",
    "a machine coordinate": b"G53 G0 X5.\n",
    "a return": b"G28 X5.\n",
    "a rapid under compensation": b"G41 D1\nG0 X5.\n",
    "a rapid that may be skipped": b"/G0 X5.\n",
    "a rapid behind the end": b"M2\nG0 X5.\n",
    "a dwell": b"G4 P1\n",
    "an offset": b"G92 X5.\n",
    "a rapid in another system": b"G55 G0 X5.\n",
    "a comment": b"(G0 X5.)\nG0\n",
}


@pytest.mark.parametrize("name", MISTAKES)
def test_every_mistake_of_the_first_reading_is_noticed(name):
    line, change = MISTAKES[name]
    start = replace(start_of("linuxcnc"), offsets={})
    rapids = read(PROGRAM, "linuxcnc", start)
    # Columns that are the same everywhere cannot be written to.
    rapids = replace(rapids, **{f.name: getattr(rapids, f.name).copy() for f in fields(rapids)})
    rows = np.flatnonzero(rapids.reason == CERTAIN)
    assert judge(PROGRAM, "linuxcnc", start, rapids) == ([], len(rows))
    i = int(np.flatnonzero(rapids.line == line)[0])
    assert rapids.reason[i] == CERTAIN
    change(rapids, i)
    violations, _ = judge(PROGRAM, "linuxcnc", start, rapids)
    assert [v.original_line for v in violations] == [line]


def moved_to(rapids, i, line):
    """The rapids, one of them said to stand in another line, with an end that is not known."""
    moved = replace(rapids, **{f.name: getattr(rapids, f.name).copy() for f in fields(rapids)})
    moved.line[i] = line
    return moved


@pytest.mark.parametrize("name", NO_RAPIDS)
@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc"])
def test_what_is_no_rapid_is_never_taken_for_one(name, dialect):
    head = b"G21 G90 G94 G17 G40 G64 F300.\nG0 X0. Y0. Z5.\nX1.\n"
    data = head + NO_RAPIDS[name]
    start = start_of(dialect)
    rapids = read(data, dialect, start)
    moved = moved_to(rapids, 1, 1 + data.rstrip().count(b"\n"))
    violations, confirmed = judge(data, dialect, start, moved, [1])
    assert (len(violations), confirmed) == (1, 0)


@pytest.mark.parametrize(
    "lines",
    [
        b"o100 sub\nG0 X5.\nG0 X6.\no100 endsub\n",
        b"o100 while [#1 LT 5]\nG90 G21 G0 X5.\nG0 X6.\no100 endwhile\n",
        b"#1=#7\nG0 X#1\nG0 X6.\n",
        b"G0 X[2 ** 0.5]\nG0 X6.\n",
        b"o100 call\nG0 X6.\n",
        b"M98 P5\nG0 X6.\n",
        b"o7\nG0 X6.\n",
        b"G10 L2 P1 R30\nG90 G0 X5.\nG0 X6.\n",
        b"(py, x)\nG0 X6.\n",
    ],
)
def test_what_is_not_followed_is_neither_confirmed_nor_refused(lines):
    head = b"G21 G90 G94 G17 G40 G64 F300.\nG0 X0. Y0. Z5.\nX1.\n"
    data, start = head + lines, start_of("linuxcnc")
    last = 1 + max(k for k, line in enumerate(data.splitlines()) if line == b"G0 X6.")
    moved = moved_to(read(data, "linuxcnc", start), 1, last)
    moved.target[1, 0] = 6.0
    assert judge(data, "linuxcnc", start, moved, [1]) == ([], 0)


TESTS = Path(__file__).resolve().parents[1]
OWN = sorted(path.parent.name for path in TESTS.glob("golden/*/in.ngc"))


@pytest.mark.parametrize("case", OWN)
def test_the_second_reading_agrees_on_whole_programs(case):
    """Real files are not everywhere; the programs beside the golden outputs are."""
    machine = Machine.load(TESTS / "golden" / case / "machine.yaml")
    data, start = (TESTS / "golden" / case / "in.ngc").read_bytes(), machine.program_start()
    rapids = read(data, machine.dialect, start)
    violations, confirmed = judge(data, machine.dialect, start, rapids)
    assert violations == []
    certain = np.flatnonzero(rapids.reason == CERTAIN)
    assert (confirmed > 0) == (len(certain) > 0)
    noticed = 0
    for i in certain:
        wrong = read(data, machine.dialect, start)
        named = next(k for k in range(len(AXES)) if rapids.words[i] >> k & 1)
        wrong.target[i, named] += 1e-3
        violations, _ = judge(data, machine.dialect, start, wrong)
        assert {v.original_line for v in violations} <= {rapids.line[i]}
        noticed += bool(violations)
    assert noticed >= confirmed


def test_programs_of_several_dialects_have_rapids_that_are_certain():
    dialects = set()
    for case in OWN:
        machine = Machine.load(TESTS / "golden" / case / "machine.yaml")
        data = (TESTS / "golden" / case / "in.ngc").read_bytes()
        if CERTAIN in read(data, machine.dialect, machine.program_start()).reason:
            dialects.add(machine.dialect)
    assert len(dialects) >= 7


SHARED = TESTS.parents[1] / "shared"
"""Dialect of each real file, by a piece of its name."""
REAL = {
    **{"hosts/nc/*__fanuc*": "fanuc", "hosts/nc/*__grbl*": "grbl", "hosts/nc/*__marlin*": "marlin"},
    **{"hosts/nc/*__linuxcnc*": "linuxcnc", "hosts/nc/*__mach3*": "mach"},
    **{"hosts/nc/*__uccnc*": "uccnc", "hosts/nc/*__centroid*": "centroid"},
    **{"corpus/cncjs*": "grbl", "corpus/gEdit__h*": "klartext"},
    **{"corpus/easy_gcode_plot__[!T]*": "fanuc", "corpus/easy_gcode_plot__TEST_G*": "fanuc"},
    **{"corpus/*TEST_TURN*": "fanuc-lathe-a", "corpus/*mach3*": "mach"},
    **{"corpus/*reprap*": "marlin", "corpus/gEdit__f*": "fanuc", "corpus/*.MPF": "siemens"},
}
STARTUP = {
    **{"fanuc": "G90 G17 G21 G94", "fanuc-lathe-a": "G21 G99", "siemens": "G90 G71"},
    **dict.fromkeys(("mach", "grbl", "uccnc", "centroid"), "G90 G17 G21"),
}
"""What shops of these files have set at their controls, and their programs do not say."""
NONE_CERTAIN = ("corpus/*reprap*", "corpus/gEdit__f*", "corpus/*.MPF")
EXAMPLES = Path("/usr/share/linuxcnc/ncfiles")


@pytest.mark.parametrize("pattern", REAL)
def test_the_second_reading_agrees_on_real_files(pattern):
    if not SHARED.is_dir():
        pytest.skip("no ../shared beside the repository")
    dialect = REAL[pattern]
    start = replace(start_of(dialect), offsets={}, positions={}, startup=STARTUP.get(dialect, ""))
    certain = agreed = 0
    for path in sorted(SHARED.glob(pattern)):
        data = path.read_bytes()
        rapids = read(data, dialect, start)
        violations, confirmed = judge(data, dialect, start, rapids)
        assert not violations, path.name
        certain += int(np.count_nonzero(rapids.reason == CERTAIN))
        agreed += confirmed
    assert agreed == certain
    assert (certain == 0) == (pattern in NONE_CERTAIN)


@pytest.mark.skipif(not EXAMPLES.is_dir(), reason="LinuxCNC's examples are not installed")
def test_the_second_reading_agrees_on_the_examples_of_linuxcnc():
    start = replace(start_of("linuxcnc"), offsets={}, positions={})
    certain = agreed = 0
    for path in sorted(EXAMPLES.rglob("*.ngc")):
        data = path.read_bytes()
        rapids = read(data, "linuxcnc", start)
        violations, confirmed = judge(data, "linuxcnc", start, rapids)
        assert not violations, path.name
        certain += int(np.count_nonzero(rapids.reason == CERTAIN))
        agreed += confirmed
    assert agreed >= 0.9 * certain
