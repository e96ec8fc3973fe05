"""Cycles of Fanuc, Haas and Mach: written out as manuals tell, or left alone; damage is found."""

import io
import random
import re
from dataclasses import replace
from fractions import Fraction

import pytest

from gcodejerk.cycles.expansion import expand
from gcodejerk.machine import Machine
from gcodejerk.machine.file.writer import machine_yaml
from gcodejerk.nc import Start, read_program
from gcodejerk.start import CycleSettings
from gcodejerk.verification.cycles.expansion import check_expansion

SETTINGS = CycleSettings(chip_retract=0.5, peck_clearance=0.4, clear_above_r=1.0, boring_out="feed")
START = Start(startup="G90 G94 G17 G21", decimal_point="standard", cycles=SETTINGS)
HEAD = b"G54 G90 G98 G17 G21\nG0 G43 H1 Z20.\nX0. Y0.\nF100.\n"
END = b"G80\nM30\n"


def written(program, dialect="fanuc", start=START):
    target = io.BytesIO()
    found = expand(io.BytesIO(program), target, dialect=dialect, start=start, comments=False)
    return target.getvalue(), found


def lines_of(series, dialect="fanuc", start=START):
    """What stands in the place of a series."""
    text, found = written(HEAD + series + END, dialect, start)
    return text.removeprefix(HEAD).removesuffix(END).decode().splitlines(), found


def check(program, text, dialect="fanuc", start=START):
    return check_expansion(io.BytesIO(program), io.BytesIO(text), dialect=dialect, start=start)


# The way of each cycle by the figures of the manuals; by hand.
WAYS = {
    ("fanuc", b"G99 G81 X5. Z-3. R2.\n"): "G99|G0 X5.|G0 Z2.|G9 G1 Z-3.|G0 Z2.",
    ("fanuc", b"G98 G82 X5. Z-3. R2. P250\n"): "G98|G0 X5.|G0 Z2.|G9 G1 Z-3.|G4 P250|G0 Z20.",
    ("haas", b"G98 G82 X5. Z-3. R2. P.25\n"): "G98|G0 X5.|G0 Z2.|G9 G1 Z-3.|G4 P0.25|G0 Z20.",
    ("fanuc", b"G99 G83 X5. Z-5. R2. Q3.\n"): (
        "G99|G0 X5.|G0 Z2.|G9 G1 Z-1.|G0 Z2.|G0 Z-0.6|G9 G1 Z-4.|G0 Z2.|G0 Z-3.6|G9 G1 Z-5.|G0 Z2."
    ),
    ("haas", b"G99 G83 X5. Z-5. R2. Q3.\n"): (
        "G99|G0 X5.|G0 Z2.|G9 G1 Z-1.|G0 Z3.|G0 Z-0.6|G9 G1 Z-4.|G0 Z3.|G0 Z-3.6|G9 G1 Z-5.|G0 Z2."
    ),
    ("fanuc", b"G98 G73 X5. Z-5. R2. Q3.\n"): (
        "G98|G0 X5.|G0 Z2.|G9 G1 Z-1.|G0 Z-0.5|G9 G1 Z-4.|G0 Z-3.5|G9 G1 Z-5.|G0 Z20."
    ),
    ("fanuc", b"G98 G85 X5. Z-3. R2.\n"): "G98|G0 X5.|G0 Z2.|G9 G1 Z-3.|G9 G1 Z2.|G0 Z20.",
    ("fanuc", b"G99 G89 X5. Z-3. R2. P9\n"): "G99|G0 X5.|G0 Z2.|G9 G1 Z-3.|G4 P9|G9 G1 Z2.|G0",
    # whole numbers are least increments, and the program's own words stay as they are
    ("fanuc", b"G99 G83 X5000 Z-3000 R2000 Q2500\n"): (
        "G99|G0 X5000|G0 Z2.|G9 G1 Z-0.5|G0 Z2.|G0 Z-0.1|G9 G1 Z-3.|G0 Z2."
    ),
    # a peck that ends at the bottom is the last one
    ("fanuc", b"G99 G73 X5. Z0. R.3 Q.1\n"): None,
    # in G91 R counts from the initial level, Z from R, and repeats go on
    ("fanuc", b"G91 G99 G81 X5. Z-7. R-18. K2\n"): (
        "G91 G99|G0 X5.|G0 Z-18.|G9 G1 Z-7.|G0 Z7.|G0 X5.|G9 G1 Z-7.|G0 Z7."
    ),
    # in G90 they stay in place; the way to the next hole is level, where G99 has left the tool
    ("haas", b"G99 G81 X5. Z-3. R2. L2\nG98 X7.\n"): (
        "G99|G0 X5.|G0 Z2.|G9 G1 Z-3.|G0 Z2.|G9 G1 Z-3.|G0 Z2.|G98|G0 X7.|G9 G1 Z-3.|G0 Z20."
    ),
    ("fanuc", b"G99 G81 X5. Z-3. R2.\nX7. R1.\n"): (
        "G99|G0 X5.|G0 Z2.|G9 G1 Z-3.|G0 Z2.|G0 X7.|G0 Z1.|G9 G1 Z-3.|G0 Z1."
    ),
    # a first hole where the tool stands
    ("fanuc", b"G99 G81 Z-3. R2.\n"): "G99|G0 Z2.|G9 G1 Z-3.|G0 Z2.",
}


@pytest.mark.parametrize(("dialect", "series"), WAYS)
def test_a_cycle_goes_as_the_manual_tells(dialect, series):
    lines, found = lines_of(series, dialect)
    way = WAYS[dialect, series]
    if way is None:
        start = replace(START, cycles=replace(SETTINGS, chip_retract=0.05))
        lines, found = lines_of(series, dialect, start)
        way = "G99|G0 X5.|G0 Z0.3|G9 G1 Z0.2|G0 Z0.25|G9 G1 Z0.1|G0 Z0.15|G9 G1 Z0.|G0 Z0.3"
    assert "|".join(lines) == way
    assert not found.findings


def test_a_haas_drills_where_the_tool_stands_if_setting_28_is_on():
    series = b"G99 G83 Z-3. R2. Q4.\nX5.\nG83 Z-4. R2. Q9.\n"
    lines, found = lines_of(series, "haas", WITHOUT_XY)
    pecks = "G9 G1 Z-2.|G0 Z3.|G0 Z-1.6|G9 G1 Z-3.|G0 Z2."
    assert not found.findings
    assert "|".join(lines) == f"G99|G0 Z2.|{pecks}|G0 X5.|{pecks}|G9 G1 Z-4.|G0 Z2."
    program = HEAD + series + END
    text, _ = written(program, "haas", WITHOUT_XY)
    assert check(program, text, "haas", WITHOUT_XY).ok
    assert not check(program, text, "haas").ok


def test_g1_is_in_force_again_behind_each_hole():
    lines, _ = lines_of(b"G1 Y1.\nG99 G81 X5. Z-3. R2.\nX6.\nG80\nX9.\n")
    assert lines[1:] == [
        *("G99", "G0 X5.", "G0 Z2.", "G9 G1 Z-3.", "G0 Z2.", "G1"),
        *("G0 X6.", "G9 G1 Z-3.", "G0 Z2.", "G1", "G80", "X9."),
    ]


def test_inches_take_settings_that_are_whole_increments():
    program = HEAD.replace(b"G21", b"G20") + b"G99 G73 X1. Z-.5 R.1 Q.4\n" + END
    start = replace(START, startup="G90 G94", cycles=replace(SETTINGS, chip_retract=1.27))
    text, found = written(program, start=start)
    assert b"G9 G1 Z-0.3\nG0 Z-0.25\nG9 G1 Z-0.5\nG0 Z0.1\n" in text
    assert check(program, text, start=start).ok
    _, found = written(program, start=replace(START, startup="G90 G94"))
    assert "chip_retract" in found.findings[0].message


UNSAID = replace(START, cycles=CycleSettings())
WITHOUT_XY = replace(START, cycles=replace(SETTINGS, without_xy="drills"))
CYCLE = b"G99 G81 X1. Y1. Z-5. R2.\n"
PECKS = b"G99 G83 X1. Z-5. R2. Q2.\n"
LEFT = {
    "tapping": ("fanuc", b"G84 X1. Z-5. R2.\n", "only the controller", START),
    "spindle": ("fanuc", b"G86 X1. Z-5. R2.\n", "no source", START),
    "tapping behind": ("haas", CYCLE + b"G84 X2. Z-5. R2.\n", "only the controller", START),
    "5114": ("fanuc", PECKS.replace(b"G83", b"G73"), "cycles.chip_retract", UNSAID),
    "5115": ("fanuc", PECKS, "cycles.peck_clearance", UNSAID),
    "52": ("haas", PECKS, "clear_above_r", replace(
        START, cycles=CycleSettings(peck_clearance=0.4))),
    "boring": ("fanuc", b"G85 X1. Z-5. R2.\n", "cycles.boring_out", UNSAID),
    "short pecks": ("fanuc", PECKS.replace(b"Q2.", b"Q.3"), "not longer", START),
    "seconds": ("fanuc", b"G82 X1. Z-5. R2. P.5\n", "as in G4", START),
    "milliseconds": ("haas", b"G82 X1. Z-5. R2. P500\n", "as in G4", START),
    "revolutions": ("fanuc", b"G95 F.1\nG82 X1. Z-5. R2. P500\n", "G95", START),
    "a dwell that stays": ("haas", b"G82 X1. Z-5. R2. P.5\nG83 X2. Z-5. R2. Q2.\n", "dwell", START),
    "other pecks": ("haas", b"G83 X1. Z-5. R2. I3. J1. K1.\n", "order", START),
    "L of a Fanuc": ("fanuc", b"G81 X1. Z-5. R2. L2\n", "order", START),
    "setting 28": ("haas", b"G81 Z-5. R2.\n", "a setting decides", START),
    "Z alone": ("haas", CYCLE + b"Z-6.\n", "its cycle's code", WITHOUT_XY),
    "high R": ("fanuc", b"G81 X1. Z-5. R30.\n", None, START),
    "higher R": ("fanuc", CYCLE + b"X2. R5.\n", "R is above", START),
    "whole Q": ("fanuc", PECKS.replace(b"Q2.", b"Q2000"), "decimal point",
                replace(START, decimal_point="calculator")),
    "whole Z": ("fanuc", CYCLE.replace(b"-5.", b"-5"), "decimal point",
                replace(START, decimal_point=None)),
    "G91 within": ("fanuc", CYCLE + b"G91 X5.\n", None, START),
    "polar": ("fanuc", b"G16\nG81 X1. Y1. Z-5. R2.\nG15\n", None, START),
    "plane": ("fanuc", b"G18\nG81 X1. Y-5. Z1. R2.\n", None, START),
    "no motion": ("fanuc", b"G2 X0. Y0. I1.\nG81 X1. Z-5. R2.\n", "G0 or G1", START),
    "R alone": ("fanuc", CYCLE + b"R3.\nX2.\n", None, START),
    "a stop": ("fanuc", CYCLE + b"M0\nX2.\n", "start unknown", START),
    "a stop in the block": ("fanuc", CYCLE.replace(b"\n", b" M0\n"), "order", START),
    "M98": ("fanuc", CYCLE + b"M98 P5\nX2.\n", None, START),
    "return": ("fanuc", CYCLE + b"G28 Z20.\nX2.\n", None, START),
    "K0": ("fanuc", b"G81 X1. Z-5. R2. K0\n", None, START),
    "no repeats": ("haas", b"G81 X1. Z-5. R2. L0\n", None, START),
    "G0 beside": ("fanuc", b"G0 G81 X1. Z-5. R2.\n", None, START),
    "block delete": ("fanuc", CYCLE + b"/X2.\n", "block delete", START),
    "a jump back": ("fanuc", CYCLE + b"N20 X2.\nG80\nG0 Z50.\nGOTO 20\n", "jumps", START),
    "a loop": ("fanuc", b"WHILE[#1LT3]DO1\n" + CYCLE + b"X2.\nG80\nEND1\n", None, START),
    "a local call": ("haas", CYCLE + b"N20 X2. Y2.\nG80\nM97 P20\n", "jumps", START),
    "a tool's program": ("fanuc", CYCLE + b"T5\n", "stands in the series", START),
    "pole": ("haas", b"G81 X1. Y1. Z-5. R2. P5\n", None, START),
}  # fmt: skip


@pytest.mark.parametrize("case", LEFT)
def test_what_is_not_certain_is_left_whole(case):
    dialect, series, reason, start = LEFT[case]
    lines, found = lines_of(series, dialect, start)
    assert (found.written, lines) == (0, [])
    if reason is not None:
        assert any(reason in f.message for f in found.findings), found.findings


def drawn(rng, haas):
    """A program of holes, and where its tool goes: rapids, feed moves and dwells, exactly.

    The path is told by a formula for each hole, from the drawn numbers, not from the text.
    """
    number = lambda low, high: Fraction(rng.randint(low * 100, high * 100), 100)  # noqa: E731
    text = lambda value: f"{float(value):.2f}"  # noqa: E731
    lines, path = [HEAD.decode().strip()], []
    at = [Fraction(0), Fraction(0), Fraction(20)]

    def go(kind, axis, value):
        if at[axis] != value:
            at[axis] = value
            path.append((kind, *at))

    for _ in range(3):
        level, back_to_r = at[2], rng.random() < 0.5
        code = rng.choice(["G81", "G82", "G83", "G73", "G85", "G89"])
        r, z, q, p = number(0, 2), -number(1, 9), number(1, 3), rng.randint(1, 900)
        holes = [(number(-50, 50), number(-50, 50)) for _ in range(rng.randint(1, 3))]
        for k, (x, y) in enumerate(holes):
            words = [f"X{text(x)}", f"Y{text(y)}"]
            if k == 0:
                words = ["G99" if back_to_r else "G98", code, *words, f"Z{text(z)}", f"R{text(r)}"]
                words += [f"Q{text(q)}"] if code in ("G83", "G73") else []
                words += [f"P{p / 1000 if haas else p}"] if code in ("G82", "G89") else []
            lines.append(" ".join(words))
            if at[:2] != [x, y]:
                at[:2] = [x, y]
                path.append(("G0", *at))
            go("G0", 2, r)
            depth = r
            while code in ("G83", "G73") and depth - q > z:
                depth -= q
                go("G1", 2, depth)
                if code == "G83":
                    go("G0", 2, r + (1 if haas else 0))
                go("G0", 2, depth + {"G83": Fraction(4, 10), "G73": Fraction(5, 10)}[code])
            go("G1", 2, z)
            if code in ("G82", "G89"):
                path.append(("G4", Fraction(p, 1000)))
            if code in ("G85", "G89"):
                go("G1", 2, r)
            go("G0", 2, r if back_to_r else level)
        lines += ["G80", "G0 Z20."]
        go("G0", 2, Fraction(20))
    return ("\n".join([*lines, "M30"]) + "\n").encode(), path


def played(text, haas):
    """Where the tool goes in explicit moves."""
    at, motion, path = [Fraction(0), Fraction(0), Fraction(20)], "G0", []
    for line in text.decode().splitlines()[4:]:
        assert not re.search(r"G[78][1-9]", line)
        if found := re.search(r"G4 P([\d.]+)", line):
            path.append(("G4", Fraction(found[1]) / (1 if haas else 1000)))
            continue
        motion = found[0] if (found := re.search(r"G[01]\b", line)) else motion
        before = list(at)
        for letter, value in re.findall(r"([XYZ])(-?[\d.]+)", line):
            at["XYZ".index(letter)] = Fraction(value)
        if at != before:
            path.append((motion, *at))
    return path


@pytest.mark.parametrize("dialect", ["fanuc", "haas"])
@pytest.mark.parametrize("seed", range(12))
def test_drawn_cycles_go_where_the_formulas_say(dialect, seed):
    program, path = drawn(random.Random(f"{dialect}{seed}"), dialect == "haas")
    text, found = written(program, dialect)
    assert not found.findings
    assert played(text, dialect == "haas") == path
    judged = check(program, text, dialect)
    assert judged.ok, judged.violations
    assert judged.rewritten == found.written == judged.confirmed


ODD = """
G92 Z1.|G49|G55|G28 Z5.|G53 G0 Z-1.|/X3.|/G80|#1=3|X#1|G84 X1. Z-3. R2.|G20|G18|G17|G90|G91
G95 F.3|G41 D1|M30|M6 T1|M5|R1.|R1. X2.|X2. K2|X2. L2|X2. A3.|G81|G81 X1. Z5. R1.|G0 X4..2|G1
G2 X3. I1.|X3. P200|Z-4.|G83 X1. Z-9. R1. Q1.5|G4 P100|(c)||G98|G99 X9.|M8 X4.|M0|M1 X3.|T5|G0
X3. F50|G16|G43 H1 Z30.|N5 X7. (x)|G9 X3.|x5. y5.|G99G81X1.Y1.Z-5.R2.F50.|G80 X3.|X3 Y4
"""
ODD_LINES = ODD.strip().replace("\n", "|").split("|")


@pytest.mark.parametrize("dialect", ["fanuc", "haas"])
def test_whatever_stands_among_cycles_what_is_written_out_is_accepted(dialect):
    rng, times = random.Random(dialect), 0
    for _ in range(60):
        program, _ = drawn(rng, dialect == "haas")
        lines = program.splitlines(keepends=True)
        for _ in range(rng.randint(1, 3)):
            lines.insert(rng.randint(0, len(lines)), rng.choice(ODD_LINES).encode() + b"\n")
        program = b"".join(lines)
        text, found = written(program, dialect)
        judged = check(program, text if found.written else program, dialect)
        assert judged.ok, (judged.violations, program, text)
        assert judged.rewritten == found.written
        times += bool(found.written)
    assert times > 20


PROGRAM = (
    HEAD
    + b"""\
G1 X1. F200.
N10 G99 G81 X10. Y5. Z-5. R2. F100. M8
X20000
G98 Y15.
G83 X2. Z-6. R2. Q3.
G73 X4. Z-6. R2. Q3000 K2
G82 X5. Z-3. R1. P500
G89 X6. Z-3. R1. P500
G80
X3.
G0 Z20.
G91 G81 X10. Z-7. R-18. K2
G80 G90
M30
"""
)
WRITTEN = written(PROGRAM)[0]


def once(old, new):
    def damage(text):
        assert old in text
        return text.replace(old, new, 1)

    return damage


DAMAGE = {
    "a hole is moved": once(b"G0 X10. Y5.\n", b"G0 X10. Y5.001\n"),
    "a whole number is another": once(b"G0 X20000\n", b"G0 X20001\n"),
    "a whole number gets a point": once(b"G0 X20000\n", b"G0 X20000.\n"),
    "a depth is changed": once(b"G9 G1 Z-5.\n", b"G9 G1 Z-5.1\n"),
    "a depth loses its point": once(b"G9 G1 Z-5.\n", b"G9 G1 Z-5\n"),
    "a retract is missing": once(b"Z-5.\nG0 Z2.\n", b"Z-5.\n"),
    "a retract is too low": once(b"G0 Z20.\n", b"G0 Z2.\n"),
    "a peck is missing": once(b"G9 G1 Z-1.\nG0 Z2.\nG0 Z-0.6\n", b""),
    "a peck does not clear": once(b"G9 G1 Z-1.\nG0 Z2.\nG0 Z-0.6", b"G9 G1 Z-1.\nG0 Z-0.6"),
    "a peck comes too near": once(b"G0 Z-0.6\n", b"G0 Z-0.7\n"),
    "a chip is not broken": once(b"G9 G1 Z-1.\nG0 Z-0.5\n", b"G9 G1 Z-1.\n"),
    "a repeat is missing": once(b"G0 X10.\nG0 Z-18.\nG9 G1 Z-7.\nG0 Z25.\n", b""),
    "a dwell is lost": once(b"G4 P500\n", b""),
    "a dwell is in seconds": once(b"G4 P500\n", b"G4 P500.\n"),
    "a dwell is shorter": once(b"G4 P500\n", b"G4 P50\n"),
    "a standstill is lost": once(b"G9 G1 Z-5.\n", b"G1 Z-5.\n"),
    "a feed move becomes a rapid": once(b"G9 G1 Z-5.\n", b"G0 Z-5.\n"),
    "a rapid becomes a feed move": once(b"G0 Z2.\n", b"G9 G1 Z2.\n"),
    "a boring bar leaves rapidly": once(b"G9 G1 Z1.\n", b"G0 Z1.\n"),
    "G1 does not return": once(b"G0 Z2.\nG1\n", b"G0 Z2.\n"),
    "G0 returns in its place": once(b"G0 Z2.\nG1\n", b"G0 Z2.\nG0\n"),
    "G99 is lost": once(b"N10 G99 F100. M8", b"N10 F100. M8"),
    "M8 is lost": once(b"N10 G99 F100. M8", b"N10 G99 F100."),
    "a hole is left as it was": once(b"G0 X20000\nG9 G1 Z-5.\nG0 Z2.\nG1\n", b"X20000\n"),
    "G80 is dropped": once(b"G80\nX3.", b"X3."),
    "an exact stop is given to a rapid": once(b"G0 X20000\n", b"G9 G0 X20000\n"),
}


def test_what_was_written_out_is_accepted():
    found = check(PROGRAM, WRITTEN)
    assert found.ok, found.violations
    assert (found.rapids, found.rewritten) == (8, 8)


@pytest.mark.parametrize("case", DAMAGE)
def test_every_damage_is_noticed(case):
    damaged = DAMAGE[case](WRITTEN)
    assert damaged != WRITTEN
    assert not check(PROGRAM, damaged).ok


@pytest.mark.parametrize("field", ["chip_retract", "peck_clearance", "boring_out"])
def test_the_proof_does_not_guess_a_setting(field):
    start = replace(START, cycles=replace(SETTINGS, **{field: None}))
    assert not check(PROGRAM, WRITTEN, start=start).ok
    program = PROGRAM.replace(b"K2", b"L2")
    assert not check(program, WRITTEN, dialect="haas").ok


DOUBTLESS = (
    *("seconds", "revolutions", "a dwell that stays", "setting 28", "Z alone", "no motion"),
    *(
        "a stop",
        "a stop in the block",
        "R alone",
        "a jump back",
        "a local call",
        "a tool's program",
    ),
)


@pytest.mark.parametrize("case", DOUBTLESS)
def test_a_writer_that_does_not_doubt_is_found_out(case, monkeypatch):
    dialect, series, _, start = LEFT[case]
    program = HEAD + series + END
    monkeypatch.setattr("gcodejerk.cycles.expansion._finds_jumps", lambda *_: False)
    series_of = "gcodejerk.cycles.series."
    monkeypatch.setattr("gcodejerk.cycles.expansion.why_left_alone", lambda *_: None)
    monkeypatch.setattr("gcodejerk.cycles.expansion.passes", lambda *_: True)
    monkeypatch.setattr(series_of + "_dwell_is_that_of_g4", lambda *_: True)
    text, found = written(program, dialect, start)
    assert found.written
    assert not check(program, text, dialect, start).ok


MACH = Start(startup="G17 G90 G94 G21 G40 G64", spindle="mill")
MACH_HEAD = b"G17 G21 G90 G94 G40 G61\nG0 X0 Y0 Z10 F100\n"
MACH_WAYS = {
    b"G98 G81 X1 Z-5 R2\nX3 L2\n": (
        "G98|G0 X1|G0 Z2.|G1 Z-5.|G0 Z10.|G0 X3|G0 Z2.|G1 Z-5.|G0 Z10.|G0 Z2.|G1 Z-5.|G0 Z10."
    ),
    b"G99 G85 X1 Z-5 R2\nX3 R1\n": ("G99|G0 X1|G0 Z2.|G1 Z-5.|G1 Z2.|G0 X3|G0 Z1.|G1 Z-5.|G1 Z1."),
    b"G91 G99 G81 X1 Z-7 R-8 L2\n": "G91 G99|G0 X1|G0 Z-8.|G1 Z-7.|G0 Z7.|G0 X1|G1 Z-7.|G0 Z7.",
}
MACH_LEFT = {
    b"G99 G83 X1 Z-5 R2 Q1\n": "way back of the pecks",
    b"G99 G73 X1 Z-5 R2 Q1\n": "way back of the pecks",
    b"G99 G82 X1 Z-5 R2 P1\n": "dwell",
    b"G98 G85 X1 Z-5 R2\n": "beyond R",
    b"G99 G81 X1 Z-5 R2\nG98 X2\n": "two ways",
    b"G91 G99 G81 X1 Z-5 R-2\nX2\n": "two ways",
    b"G99 G81 X1 Z-5 R12\n": "R is above",
    b"G99 G81 X1 Z-5 R2\nX2 R5\n": "R is above",
    b"G99 G81 X1 Z-5 R2\nM0\nX2\n": "start unknown",
    b"G99 G81 X1 Z-5 R2\nG90 G91\nX2\n": None,
    b"G81 X1 Z-5 R2\n": "G98 or G99",
    b"G99 G18 G81 X1 Y-5 R2\n": None,
    b"G99 G81 X1 Z-5 R2 K2\n": "order",
    b"G99 G81 X1 Z-5 R2\nX3 M1\n": "order",
}


@pytest.mark.parametrize("series", MACH_WAYS)
def test_a_cycle_of_mach_goes_as_nist_tells(series):
    program = MACH_HEAD + series + END
    text, found = written(program, "mach", MACH)
    assert not found.findings
    lines = text.removeprefix(MACH_HEAD).removesuffix(END).decode().splitlines()
    assert "|".join(lines) == MACH_WAYS[series]
    judged = check(program, text, "mach", MACH)
    assert judged.ok, judged.violations
    for k, line in enumerate(lines):
        if line.startswith(("G0 ", "G1 ")):
            other = [*lines[:k], *lines[k + 1 :]]
            damaged = MACH_HEAD + "\n".join(other).encode() + b"\n" + END
            assert not check(program, damaged, "mach", MACH).ok, line


@pytest.mark.parametrize("series", MACH_LEFT)
def test_what_mach_has_settings_for_is_left_whole(series):
    _, found = written(MACH_HEAD + series + END, "mach", MACH)
    assert found.written == 0
    reason = MACH_LEFT[series]
    assert reason is None or any(reason in f.message for f in found.findings), found.findings


MACH_DOUBTS = [
    series for series, reason in MACH_LEFT.items() if reason in ("two ways", "start unknown")
]


@pytest.mark.parametrize("series", MACH_DOUBTS)
def test_a_writer_that_does_not_doubt_mach_is_found_out(series, monkeypatch):
    monkeypatch.setattr("gcodejerk.cycles.series._not_told", lambda *_: ())
    program = MACH_HEAD + series + END
    text, found = written(program, "mach", MACH)
    assert found.written
    assert not check(program, text, "mach", MACH).ok


def test_k_of_a_haas_is_no_number_of_repeats():
    """K is the least depth of a peck there, and either where the control is not known."""
    program = HEAD + b"G91 G83 X5. Z-7. R-18. Q2. K3.\nG80 G90\nG0 X50.\nM30\n"
    ends = {}
    for dialect in ("fanuc", "haas", "iso-mill"):
        rapids = read_program(io.BytesIO(program), dialect=dialect, start=START).rapids
        ends[dialect] = float(rapids.start[-1, 0])
    assert ends["fanuc"] == 15.0
    assert ends["haas"] == 5.0
    assert ends["iso-mill"] != ends["iso-mill"]


def test_r_alone_may_have_made_a_hole():
    program = HEAD + b"G99 G81 X5. Z-7. R2.\nR3.\nG80\nG0 Z50.\nM30\n"
    rapids = read_program(io.BytesIO(program), dialect="fanuc", start=START).rapids
    assert rapids.start[-1, 2] != rapids.start[-1, 2]


def test_the_machine_file_states_the_settings():
    text = """
interval: 0.001
positioning: linear
controller: haas
axes: {Z: {rapid: {velocity: 600, acceleration: 5000}}}
units: inch
program: {cycles: {chip_retract: 0.02, clear_above_r: 0, boring_out: feed, without_xy: drills}}
"""
    machine = Machine.loads(text)
    said = machine.program_start().cycles
    assert said.chip_retract == pytest.approx(0.508)
    assert (said.peck_clearance, said.clear_above_r, said.boring_out) == (None, 0.0, "feed")
    assert said.without_xy == "drills"
    assert Machine.loads(machine_yaml(machine)).program.cycles == machine.program.cycles
