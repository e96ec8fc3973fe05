"""Lines of Klartext: the two readings say the same of each, though neither knows the other."""

import random
from collections import Counter

import pytest

from gcodejerk.nc import find_dialect, parse_block
from gcodejerk.verification.second_reading.klartext import read_statement

KLARTEXT = find_dialect("klartext")
STATEMENTS = [
    *["L"] * 12, "l", "L-5", "LX+5", "C", "c", "C,5", "CC", "CR", "CT", "CP", "LP", "RND R5",
    "CHF 3", "APPR LT", "DEP LT", "FL", "FC", "FPOL", "CTP", "PLANE RESET", "FUNCTION", "TRANS",
    "CYCL CALL", "CYCL  CALL", "CYCL DEF 200 DRILLING", "CYCL DEF 7.0 DATUM SHIFT", "cycl def 9.1",
    "CYCL DEF 10.0 ROTATION", "CYCL DEF 9999", "CYCLE DEF 9.0", "TOOL CALL 5 Z S3000",
    'TOOL CALL "A B" Z', "TOOL  CALL", "TOOL DEF 5", "LBL 1", "LBL 0", "LBL1", "CALL LBL 3",
    "CALL PGM X", "STOP", "STOP M0", "STOP M8", "BEGIN PGM A MM", "begin pgm a inch",
    "BEGIN PGM A", "END PGM A MM", "BLK FORM 0.1 Z", "FN 0: Q1 =", "FN0:Q1=", "FN 9: IF",
    "FN 18: SYSREAD Q1", "FN 17:", "FN 26:", "Q5 =", "QS1 =", "M3", "M8 M9", "M140", "M30",
    "* - heading", "", ";c", "?",
]  # fmt: skip
NUMBERS = [
    *("+5", "-3.25", "7", "1,5", "+.5", "5.", "-,5", "+Q1", "-QL12", "QR3"),
    *("Q", "1.2.3", "--1", "+ 5", "", "1e3", "+5a"),
]
WORDS = [
    *[
        "FMAX",
        "F MAX",
        "fmax",
        "F500",
        "F 500",
        "FAUTO",
        "F AUTO",
        "FQ5",
        "F Q5",
        "F1,5",
        "F",
        "FU2",
    ],
    *[
        "FZ0.1",
        "R0",
        "RL",
        "RR",
        "rl",
        "R 0",
        "R",
        "R+",
        "R-",
        "RLL",
        "R0L",
        "M3",
        "M03",
        "m8",
        "M 9",
    ],
    *["M99", "M91", "M92", "M140", "M128", "M1234", "M", "M3.5", "M89", "M30", "MB MAX", "MB50"],
    *["; hi", "~", "Q5=1", "* x", "DR+", "LEN5", "?"],
]
FRONTS = ["", "", "", "12 ", "12 ", "/ ", "/12 ", "12 / ", "  7  ", "12\t", "/", "3 /", "12"]
ENDS = [*[""] * 6, " ", "~", " ~", " ; c", "; x ~", ";~"]
COUNT = 25_000


def drawn(rng):
    """A line, more or less well-formed."""
    said = [rng.choice(STATEMENTS)]
    for _ in range(rng.choice((0, 1, 1, 2, 2, 3, 4))):
        axis = rng.choice(("", "", "I", "i")) + rng.choice("XYZABCUVWxz") + rng.choice(NUMBERS)
        said.append(axis if rng.random() < 0.4 else rng.choice(WORDS))
    blank = rng.choice((" ", " ", "  ", "\t"))
    return (rng.choice(FRONTS) + blank.join(said) + rng.choice(ENDS)).encode()


def told(understood, deleted, words, increments, effects):
    """What a line says, in an order of its own; which tool is called, the second does not ask."""
    if not understood or "flow" in effects:
        return "anything", deleted
    words = sorted((letter, repr(value)) for letter, value in words if letter != "T")
    return words, deleted, increments, sorted(effects)


def by_the_first(line):
    block = parse_block(line, "klartext")
    effects = [KLARTEXT.names.get(name.name, "flow") for name in block.names]
    words = [(w.letter, float("nan") if w.value is None else w.value) for w in block.words]
    return told(
        block.problem is None,
        block.block_delete,
        [word for word in words if word[0] != "N"],
        {word.letter: word.function for word in block.words if word.function},
        [effect for effect in effects if effect != "none"],
    )


def by_the_second(line):
    said = read_statement(line, KLARTEXT)
    words = [(letter, value) for letter, value, _ in said.words]
    return told(said.understood, said.deleted, words, said.relative, said.effects)


@pytest.mark.parametrize("seed", range(2))
def test_both_say_the_same_of_a_line(seed):
    rng, kinds = random.Random(seed), Counter()
    for _ in range(COUNT):
        line = drawn(rng)
        first = by_the_first(line)
        assert first == by_the_second(line), line
        kinds[first[0] == "anything"] += 1
    assert kinds[False] > 0.15 * COUNT
    assert kinds[True] > 0.15 * COUNT


@pytest.mark.parametrize(
    "line",
    [
        *(b"L X+1 X+2 FMAX", b"L R0 R0 FMAX", b"L R0 RL", b"L FMAX FMAX", b"L F100 F200"),
        *(b"12L X+5", b"C,5 X+5", b"L X+5 FMAX ~", b"STOP X+5", b"M140 MB MAX", b"M8 X+5"),
        *(b"LBL1", b"L X", b"L X+5a", b"X+5 FMAX", b"BEGIN PGM A", b"CALL LBL 1", b"L M1234"),
    ],
)
def test_what_is_no_statement_may_be_anything(line):
    assert by_the_first(line)[0] == by_the_second(line)[0] == "anything"


@pytest.mark.parametrize(
    ("line", "words", "effects"),
    [
        (b"7 L X+1,5 IZ-2 RL F200 M3 ; c", "F200.0 G1.0 G41.0 M3.0 X1.5 Z-2.0", ""),
        (b"l x+3 rr fmax", "G0.0 G42.0 X3.0", ""),
        (b"L X+3 R0 FMAX M8 M8", "G0.0 G40.0 M8.0 M8.0 X3.0", ""),
        (b"cr x+5 y+5 r+20 dr- rl f90", "F90.0 G41.0", "home"),
        (b"C X+5 Y+5 DR+ R0 M9", "G40.0 M9.0", "home"),
        (b"STOP M0 M8", "M0.0 M8.0", ""),
        (b"STOP", "M0.0", ""),
        (b"L X+3 FMAX M99", "G0.0 X3.0", "cycle"),
        (b"L Z+0 FMAX M91", "G0.0 Z0.0", "machine"),
        (b"L M140 MB MAX", "", "cycle"),
        (b"CYCL DEF 7.1 X+5", "", "frames"),
        (b"APPR LT X+1 Y+1 LEN5 RL F90", "G41.0", "label"),
        (b'TOOL CALL "DRL-XM3-5R0" Z S900', "", "cycle"),
        (b"CYCL DEF 14.0 CONTOUR XRL", "", ""),
        (b"Q5 = Q1 + 2", "", ""),
        (b"; L X+9", "", ""),
    ],
)
def test_a_statement_is_what_it_says(line, words, effects):
    for reading in (by_the_first, by_the_second):
        found, _, increments, acts = reading(line)
        assert " ".join(letter + value for letter, value in found) == words
        assert increments == ({"Z": "IC"} if b"IZ" in line else {})
        assert " ".join(acts) == effects
