"""Heidenhain Klartext: what its statements are worth, in both readings."""

import io
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, note

from gcodejerk import Machine, process
from gcodejerk.machine import find_machine
from gcodejerk.nc import Start, parse_block, read_program, trace
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.testing import programs
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
START = Start(spindle="mill")
START_UNKNOWN = "start unknown"


def program(*lines, unit="MM", head="L X+0 Y+0 Z+50 R0 F900"):
    """A program with numbered statements."""
    said = ["BEGIN PGM PART " + unit, head, *lines, "END PGM PART " + unit]
    return "".join(f"{k} {line}\n" for k, line in enumerate(said)).encode()


def reasons(*lines, **head):
    """What each rapid is left alone for; None where it is certain, for both readers."""
    data = program(*lines, **head)
    rapids = read_program(io.BytesIO(data), dialect="klartext", start=START).rapids
    found = Findings(9)
    rows = np.flatnonzero(rapids.reason == CERTAIN)
    assert confirm(io.BytesIO(data), "klartext", START, rapids, rows, found) == len(rows)
    assert not found.violations
    return [None if r == CERTAIN else str(REASONS[r]) for r in rapids.reason.tolist()]


def end(*lines, unit="MM"):
    """X, Y, Z in front of END PGM, and whether the last block was a rapid."""
    *_, before, _ = trace(io.BytesIO(program(*lines, unit=unit)), dialect="klartext", start=START)
    return (*before[1][:3], before[2])


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("L X+10 Y-3 FMAX", (10, -3, 50, 0)),
        ("L X+10 Y-3 F MAX", (10, -3, 50, 0)),
        ("L X10", (10, 0, 50, 10)),
        ("L  X+10  F300", (10, 0, 50, 10)),
        ("L X+1,25 FMAX", (1.25, 0, 50, 0)),
        ("L IX+10 IZ-5 FMAX", (10, 0, 45, 0)),
        ("l x+3 r0 fmax m3", (3, 0, 50, 0)),
        ("L X+3 FMAX ; L X+9", (3, 0, 50, 0)),
        ("L X+Q1 FMAX", (math.nan, 0, 50, 0)),
        ("L X-QL3 FMAX", (math.nan, 0, 50, 0)),
        ("L Z+3 FMAX M91", (0, 0, math.nan, 0)),
        ("C X+5 Y+5 DR+", (math.nan,) * 3 + (None,)),
        ("LP PR+5 PA+30", (math.nan,) * 3 + (None,)),
        ("TOOL CALL 3 Z S900", (math.nan,) * 3 + (None,)),
        ("CYCL CALL", (math.nan,) * 3 + (None,)),
        ("L M140 MB MAX", (math.nan,) * 3 + (None,)),
        ("L R0 FMAX M140 MB50 F300", (math.nan,) * 3 + (None,)),
        ("L X+3 FMAX M99", (math.nan,) * 3 + (0,)),
        ("CYCL DEF 7.0 DATUM SHIFT", (math.nan,) * 3 + (None,)),
        ("LBL 1", (math.nan,) * 3 + (None,)),
        ("CC X+5 Y+5", (0, 0, 50, None)),
        ("CYCL DEF 200 DRILLING ~\n   Q200=2 ;CLEARANCE ~\n   Q201=-15", (0, 0, 50, None)),
        ("FN 0: Q1 =+50", (0, 0, 50, None)),
        ("* - L X+9", (0, 0, 50, None)),
        ("BLK FORM 0.1 Z X-5 Y-5 Z-5", (0, 0, 50, None)),
    ],
)  # fmt: skip
def test_a_statement_ends_where_it_says(line, expected):
    assert end(line) == pytest.approx(expected, nan_ok=True)


def test_inches_are_said_by_the_program():
    assert end("L X+1 FMAX", unit="INCH")[0] == 25.4


def test_codes_in_force_at_power_on_are_none_of_its_words():
    start = replace(START, startup="G17 G21 G90")
    data = program("L X+10 FMAX")
    rapids = read_program(io.BytesIO(data), dialect="klartext", start=start).rapids
    assert rapids.reason.tolist() == [CERTAIN]


def test_fmax_holds_for_its_block_and_the_feed_before_for_the_next():
    data = program("L X+10 F300", "L X+20 FMAX", "L X+30", "L X+40 FMAX")
    rapids = read_program(io.BytesIO(data), dialect="klartext", start=START).rapids
    assert rapids.line.tolist() == [4, 6]
    assert rapids.feed.tolist() == [300.0, 300.0]


def test_the_sample_of_another_editor_has_its_two_certain_rapids():
    path = SHARED / "corpus" / "gEdit__h01-3tools.h"
    if not path.exists():
        pytest.skip("../shared is not here")
    rapids = read_program(io.BytesIO(path.read_bytes()), dialect="auto", start=START).rapids
    certain = rapids.line[rapids.reason == CERTAIN].tolist()
    assert certain == [11, 16]


@pytest.mark.parametrize("head", ["L X+0 Y+0 Z+50 F900", "M5 M9"])
def test_a_program_begins_without_cutter_compensation(head):
    # posts that never write R0; selecting a program cancels RL and RR
    here = reasons("L X+5 Y+5 Z+9 F900", "L X+6 FMAX", "L X+7 RR FMAX", "L X+8 FMAX", head=head)
    assert here == [None, *["cutter compensation active"] * 2]


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        (["L X+5 FMAX", "L X+6 RL FMAX", "L X+7 FMAX", "L X+8 R0 FMAX", "L X+9 FMAX"],
         [None, *["cutter compensation active"] * 2, START_UNKNOWN, None]),
        (["APPR LT X+1 Y+1 LEN5 RL", "L X+5 FMAX", "L X+6 R0 FMAX", "L X+7 FMAX"],
         ["behind a call, jump or loop that is not followed", START_UNKNOWN,
          "feed to restore unknown"]),
        (["L X+Q1 FMAX", "L X+6 FMAX", "L X+7 FMAX"],
         ["expression or variable", START_UNKNOWN, None]),
        (["L Z+0 FMAX M91", "L Z+9 FMAX", "L Z+8 FMAX"],
         ["coordinate frame changes in the block", START_UNKNOWN, None]),
        (["STOP", "L X+1 FMAX", "L X+2 FMAX"], [START_UNKNOWN, None]),
        (["STOP M0", "L X+1 FMAX", "L X+2 FMAX"], [START_UNKNOWN, None]),
        (["CYCL DEF 5.0 CIRCULAR POCKET", "CYCL DEF 5.5 F50 DR-", "L X+1 FMAX"], [None]),
        (["M30", "LBL 1", "L X+1 FMAX", "L X+2 FMAX", "LBL 0"],
         ["inside a subprogram, loop or conditional block"] * 2),
    ],
)  # fmt: skip
def test_what_a_rapid_is_left_alone_for(lines, expected):
    found = reasons(*lines)
    # behind END PGM nothing needs F
    assert [None if r == "feed to restore unknown" else r for r in found] == [
        None if r == "feed to restore unknown" else r for r in expected
    ]


def test_what_a_retreat_along_the_tool_leaves_is_known_again_when_it_is_stated():
    found = reasons("L M140 MB MAX", "L X+5 Y+5 R0 FMAX", "L Z+9 FMAX", "L X+6 FMAX", "L F9")
    assert found == [START_UNKNOWN, START_UNKNOWN, None]
    assert reasons("L X+5 FMAX M140 MB MAX", "L X+6 Y+6 Z+6 FMAX", "L X+7 FMAX")[-1] is not None


@pytest.mark.parametrize(
    "line", ["/ CALL LBL 5", "/ CALL LBL 5 REP 2", "/ FN 9: IF +1 EQU +1 GOTO LBL 5"]
)
def test_flow_that_the_operator_may_skip_is_not_followed(line):
    found = reasons(line, "L X+9 R0 FMAX", "M30", "LBL 5", "L X+20 FMAX", "L X+30 FMAX", "LBL 0")
    assert None not in found
    back = reasons("L X+1 FMAX", "LBL 5", "L X+9 FMAX", "L X+8 R0 FMAX", line, "L X+7 FMAX")
    assert back[0] is None
    assert None not in back[1:2] + back[3:]


@pytest.mark.parametrize(
    "line",
    ["CALL LBL 1", "CALL LBL 1 REP 3", "CALL PGM SUB", "PLANE SPATIAL SPA0 SPB0 SPC0 STAY", "M128",
     "L X+1 FMAX M140 MB MAX", "CYCL DEF 10.0 ROTATION", "CYCL DEF 8.0 MIRROR",
     "TRANS DATUM AXIS X+5", "FUNCTION TCPM F TCP", "FN 17: SYSWRITE ID1", "L X+1 X+2 FMAX",
     "X+10 FMAX", "L X+1 ~", "L X+1 FZ0.1", "PATTERN DEF ~", "L X+1 FMAX M126"],
)  # fmt: skip
def test_nothing_is_rewritten_behind_what_may_turn_the_frame(line):
    first, *behind = reasons("L X+5 FMAX", line, "L X+6 R0 FMAX", "L X+7 R0 FMAX")
    assert first is None
    assert None not in behind


def test_a_section_that_is_repeated_is_certain_where_its_passes_agree():
    section = ("LBL 1", "L IX+5 R0 FMAX", "L X+9 FMAX", "L X+8 FMAX")
    assert reasons("L X+5 FMAX", *section, "L F9") == [None] * 4
    found = reasons("L X+5 FMAX", *section, "CALL LBL 1 REP 2", "L X+7 FMAX", "L F9")
    differs = "inside a subprogram, loop or conditional block"
    assert found == [None, differs, differs, None, None]


def test_a_line_keeps_its_words_with_their_places():
    block = parse_block(b"12 L X+10 IZ-3.5 R0 FMAX M3 ; go", "klartext")
    text = b"12 L X+10 IZ-3.5 R0 FMAX M3 ; go"
    words = [(w.letter, w.value, w.function) for w in block.words]
    assert words == [
        ("N", 12.0, ""), ("G", 0.0, ""), ("X", 10.0, ""), ("Z", -3.5, "IC"), ("G", 40.0, ""),
        ("M", 3.0, ""),
    ]  # fmt: skip
    assert [text[w.begin : w.end] for w in block.words if w.letter in "XZ"] == [b"X+10", b"IZ-3.5"]
    assert block.comments == ((28, 32),)
    assert parse_block(b"; go", "klartext").comments == ((0, 4),)
    assert parse_block(b"/ 80 M30", "klartext").block_delete


def test_a_table_of_points_is_written():
    machine = replace(Machine.load(find_machine("vmc")), controller="csv", dialect="klartext")
    made = process(program("L X+50 Y+20 FMAX M8", "L Z+5 FMAX", "L X+1 F100"), machine)
    assert (made.planned, made.verification.confirmed) == (2, 2)
    assert made.output.startswith(b"block,t,")


_LINE = re.compile(r"(/? *)(?:\d+ +)?(/? *)(.*?)(;.*)?$")


@given(programs("klartext"))
def test_ends_of_straight_lines_are_those_of_a_third_reading(data):
    """An oracle that knows straight lines alone, and forgets everything at any other statement."""
    note(data.decode())
    at = dict.fromkeys("XYZ", math.nan)
    scale = 25.4 if b"INCH" in data else 1.0
    seen = list(trace(io.BytesIO(data), dialect="klartext", start=START))
    ended = False
    for (_, told, _), line in zip(seen, data.decode().splitlines(), strict=True):
        skip, late, said, _ = _LINE.match(line).groups()
        words = said.split()
        known = words[:1] == ["L"] and not (skip.strip() or late.strip()) and "RL" not in said
        known = known and not re.search(r"[Q~]|M(?!8|9\b|3\b|13)|X\S+ X|,", said)
        ended = ended or said.startswith(("END", "M30"))
        if not known:
            if said.strip() and not said.startswith(("CC", "FN 0", "Q", "*", "BLK", "M8", "M9")):
                at = dict.fromkeys("XYZ", math.nan)
            continue
        for word in words[1:]:
            if match := re.fullmatch(r"(I?)([XYZ])([-+][0-9.]+)", word):
                by = at[match[2]] if match[1] else 0.0
                at[match[2]] = by + float(match[3]) * scale
        for axis, place in enumerate(told[:3]):
            mine = at["XYZ"[axis]]
            if not ended and place == place and mine == mine:
                assert place == pytest.approx(mine, abs=1e-9), line
