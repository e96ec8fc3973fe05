"""The quick way and the careful way through a program give the same columns, on every real file."""

import io
from dataclasses import replace
from pathlib import Path

import pytest

from gcodejerk.axes import AXES
from gcodejerk.nc import DIALECTS, Start, find_dialect, read_program
from gcodejerk.nc.reader import Reader
from gcodejerk.start import RapidFeed
from gcodejerk.testing.programs import differences

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
FOLDERS = [
    SHARED / "hosts" / "nc",
    SHARED / "hosts" / "nc_invalid",
    SHARED / "corpus",
    Path("/usr/share/linuxcnc"),
    Path("/usr/share/doc/linuxcnc"),
]
ENDINGS = (".ngc", ".nc", ".gcode", ".mpf", ".h")
STARTS = {
    "nothing known": Start(),
    "all known": Start(
        positions=dict.fromkeys(AXES, 1.0),
        offsets={"G54": dict.fromkeys(AXES, 2.0)},
        tool_lengths={1: 10.0},
        startup="G17 G21 G40 G49 G54 G64 P0.01 G90",
    ),
}


PARTS = 3
"""Of a folder, for as many cores."""


def real_files(folder):
    """Programs of a folder, each content once."""
    paths = [p for p in sorted(folder.rglob("*")) if p.suffix.lower() in ENDINGS and p.is_file()]
    return list({path.read_bytes(): path for path in reversed(paths)}.values())[::-1]


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("start", STARTS.values(), ids=STARTS)
@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_both_ways_agree_on_every_real_file(folder, start, part):
    files = real_files(folder) if folder.exists() else []
    if not files:
        pytest.skip(f"no programs in {folder.name}: it is not on this machine")
    for path in files[part::PARTS]:
        data = path.read_bytes()
        if data:
            assert differences(data, start) == [], path


PLAIN = [b"G0 X%d Y%d\n" % (n, n + 1) for n in range(40)]
BEGINNINGS = (b"", b"5", b"-", b".", b" 5", b"(c)5", b"5 (c)", b"/", b"/5", b"X", b"%", b";", b"\r")
ENDS = (b"", b"X1", b" G0 X9", b"\r", b" ", b"(c)", b";5", b"Y", b"5", b"-", b"5\r", b"\rX1")


@pytest.mark.parametrize("where", [0, 1, 20, 39, 40])
@pytest.mark.parametrize("beginning", BEGINNINGS)
def test_both_ways_agree_on_an_odd_line_anywhere_in_a_run(where, beginning, request):
    # Every other end, and the others at the next place: each stands at two or three of the five.
    stride = 1 if request.config.getoption("--long") else 3
    for end in ENDS[where % stride :: stride]:
        odd = beginning + end + b"\n"
        run = [*PLAIN[:where], odd, *PLAIN[where:]]
        assert differences(b"".join([b"G21 G90\n", *run])) == [], odd
        assert differences(b"".join(run)) == [], odd
        assert differences(b"".join(run)[:-1]) == [], odd


ODD_WORDS = (
    *("X123456789", "X1234567890", "X0000000001", "X-0", "X+0.", "Y-.5", "Y+.0", "Z.", "Z-", "Z+."),
    *("X1234567.1234567", "X12345678.123456", "X123456789.12345", "X-123456789.12345"),
    *("X1234567.12345678", "X1.23456789012345", "X.12345678901234", "X.123456789012345"),
    *(
        "X1,5",
        "X1/5",
        "X/5",
        "X,5",
        "X1.2.3",
        "X1-2",
        "X--1",
        "X-+1",
        "X5.-",
        "X.-5",
        "X1 .5",
        "X 5",
    ),
    *(
        "F-0",
        "F+5",
        "F-5",
        "F0",
        "S-5",
        "S+5",
        "N10.5Y1",
        "N-5Y1",
        "N+5Y1",
        "N.5Y1",
        "N123456789Y1",
    ),
    *(
        "N1234567890Y1",
        "N5(a)Y1",
        "(a)N5Y1",
        " N5Y1",
        "Y1N5",
        "G01.X1",
        "G1.0X1",
        "G001X1",
        "G+1X1",
    ),
    *("G.1X1", "G1X1G0", "G0G0X1", "X1X2", "G4P1", "G00X1", "G03X1R5", "G04X1", "G10X1", "G31X1"),
    *(
        "(5)X1",
        "(5 5)5",
        "X1(12345678901234567890)",
        "X1(X2)",
        "X1;X2",
        "X1;5",
        ";5",
        "X1;(",
        "X1(;)",
    ),
    *("X1(a\r)", "X1;a\r5", "X1\r", "X1()", "()X1", "X1()()Y2", "X1(a)Y2(b)", "X1(a(b)", "X1(a))"),
)


@pytest.mark.parametrize("word", [*ODD_WORDS, "X-1234567890", "G0 Y+12345678901234567890"])
def test_both_ways_agree_on_an_odd_word_at_the_end_of_a_file(word):
    assert differences(b"G21 G90\n" + word.encode()) == []


HEADS = {
    "siemens": ["G710 G90 G94 G17 G40 G64", "F100"],
    "fagor": ["G71 G90 G94 G17 G40", "F100"],
    "heidenhain-iso": ["G71 G90 G17 G40", "F100"],
    "marlin": ["G21", "G90", "G1 X1 F100"],
    "klipper": ["G90", "G1 X1 F100"],
    "duet": ["G21", "G90", "G94", "G17", "G1 X1 F100"],
    "fanuc-lathe-a": ["G21 G99 G40 F100."],
    "klartext": ["0 BEGIN PGM PART MM", "1 L X+0 Y+0 Z+0 R0 F100"],
    "fanuc-lathe-b": ["G21 G95 G90 G40 F100."],
}
"""What a program begins with, so that runs are taken behind it; most: G21 G90 G94 G17 G40."""
ODD_LINES = (
    *(*ODD_WORDS, "X1 E.5", "G0 X1 E.5", "G1 X1 F100 E1", "E1", "X1*", "X1 Y2* ", "X1*5", "*"),
    *(
        "G0 X5",
        "G0X5",
        "G0X10X5",
        "G00 X5",
        "G1 x5",
        "g1 X5",
        "\tG0 X5",
        "G0\tX5",
        "G0 X5\t",
        " G0 X5",
    ),
    *("G1 X5 F300", "G1 Z5 F100", "G1 Z50 F100", "X5 F100", "G0 X5 F300", "S5", "G1 X5 S5", "F300"),
    *(
        "G2 X1 Y1 I.5 J.5",
        "G3 X1. Y1. R5.",
        "X1 I1",
        "G1 X1 J1",
        "Y1;(5",
        "Y1;;(",
        "Y1 ; G0 X5",
        ";G0 X5",
    ),
)
"""Lines that some dialect reads in a way of its own."""


def beginning(dialect):
    """What a program begins with, and a run of lines that move, as the dialect has them."""
    language = find_dialect(dialect)
    head = HEADS.get(dialect, ["G21 G90 G94 G17 G40 F100."])
    axes = "XZ" if language.lathe == "yes" else "XY"
    code = "" if language.modal_motion else "G0 "
    plain = [f"{code}{axes[n % 2]}{n}.5 {axes[1 - n % 2]}{n + 1}." for n in range(26)]
    if language.text.klartext:
        return head, [line.replace(code, "L ") + " FMAX" for line in plain]
    return [*head, *([] if code else ["G0 X0. Z0."])], plain


@pytest.mark.parametrize("dialect", [d for d in DIALECTS if find_dialect(d).quick])
def test_both_ways_agree_on_every_odd_line_in_a_run(dialect, request):
    language = find_dialect(dialect)
    head, plain = beginning(dialect)
    begins = Start(diameter=language.lathe == "yes", rapid_feed=RapidFeed(100.0, 5.0))
    # Each dialect has a quarter of the lines, and its neighbours the others.
    stride = 1 if request.config.getoption("--long") else 4
    for word in ODD_LINES[list(DIALECTS).index(dialect) % stride :: stride]:
        lines = [*head, *plain, word, *head, *plain, "G1 Z50. F100.", *plain, word]
        data = "\n".join(lines).encode("latin-1")
        assert differences(data, begins, dialect) == [], word
        data = "\r\n".join([*lines, ""]).encode("latin-1")
        assert differences(data, replace(begins, rapid_feed=None), dialect) == [], word


@pytest.mark.parametrize("dialect", [d for d in DIALECTS if find_dialect(d).quick])
def test_plain_lines_of_every_dialect_are_taken_as_runs(dialect, monkeypatch):
    taken = []
    whole = Reader.read_run

    def read_run(reader, lines, first, last, place):
        stop = whole(reader, lines, first, last, place)
        taken.append(stop - first)
        return stop

    monkeypatch.setattr(Reader, "read_run", read_run)
    head, plain = beginning(dialect)
    data = "\n".join([*head, *plain, ""]).encode()
    start = Start(diameter=find_dialect(dialect).lathe == "yes")
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    assert sum(taken) >= len(plain)
    assert len(rapids) >= len(plain)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_both_ways_agree_on_a_long_run_in_every_dialect(dialect):
    # Found by fuzzing: lines of linear and rotary axes together.
    lines = [b"G21 G90 G64", b"G0 A90 X0 Y0", b"G0 A-90 X1", b"G1 X5. F20", b"G0 X7", b"A5"] * 9
    assert differences(b"\n".join(lines) + b"\nM2\n", STARTS["nothing known"], dialect) == []


@pytest.mark.parametrize(
    ("dialect", "modes"), [("fanuc-lathe-a", "G99"), ("fanuc-lathe-b", "G95 G90")]
)
def test_both_ways_agree_on_long_runs_of_a_lathe(dialect, modes):
    # U and W are increments of X and Z for system A, and nothing for B: never axes of their own.
    start = Start(positions={"X": 20.0, "Z": 2.0}, diameter=True, startup=f"{modes} G21 F0.1")
    steps = b"U-1. W-1.\nG01 X30. F0.2\nG00 X40.\nZ1.\n" * 20
    contour = b"G71 P10 Q20 U0.4 W0.1 F0.25\nN10 G00 X16.\n" + steps + b"N20 X44.\nG00 X60. Z5.\n"
    assert differences(b"G00 X40. Z2.\n" + steps + contour + steps + b"M30\n", start, dialect) == []
