"""Lines of words: where both readings understand one, they see the same words in it."""

import random
from collections import Counter

import pytest

from gcodejerk.nc import DIALECTS, find_dialect, parse_block
from gcodejerk.verification.second_reading.reading import Text

NUMBERS = [
    *("5", "-3.25", "+7", "1.", ".5", "0", "00", "01", "5.5.5", "", "-", " 5", "1,5", "1e3"),
    *("#1", "#<a>", "[1+2]", "[#1*2]", "=5", "=#5", "=R1", "=IC(5)", "=AC(3)", "=-.5", "Q1", "+Q2"),
]
CODES = [
    *("G1", "G0", "G01", "G00", "G53", "G90", "G91", "G17", "G28", "G54", "M3", "M03", "G4P1"),
    *("G 1", "G0.0", "G43.1", "G10L2", "x5", "g1", "N10", "N5.5", "X1", "Y2", "Z3", "F100", "A90"),
]
COMMENTS = [
    *("(c)", "(a(b)c)", "(open", "; x", "//x", "(msg, hi)", "(py, x)", "{c}", "( )", ";", "*"),
    *("*45", '"s"', "'", "_", "@", "^", "!", "%", "%PART", "/", "/2", "\t", "\xc4"),
]
NAMED = [
    *("#1=5", "#1=[2+3]", "#5241=7", "#<x>=3", "#1=#2", "VC1=5", "SUPA", "TRANS X5", "FNORM"),
    *("CYCLE81(1,2)", "MCALL", "IF #1 EQ 2 GOTO 5", "GOTOF L1", "STOPRE", 'MSG("hi")', "ANG=45"),
    *("RND=2", "CHR=3", "D1", "TR", "OFFN=0", "CFC", "ORIWKS"),
]
COUNT = 2500


def drawn(rng):
    """A line, more or less well-formed, of any dialect."""

    def word():
        kind = rng.random()
        if kind < 0.5:
            return rng.choice("GMXYZABCFSTIJKRPQHDLNUVWE$") + rng.choice(NUMBERS)
        return rng.choice(CODES if kind < 0.75 else COMMENTS if kind < 0.9 else NAMED)

    count = rng.choice((1, 2, 2, 3, 3, 4, 5))
    front = rng.choice(("", "", "N10 ", "/", "/1 ", "N5/", " "))
    return (front + rng.choice(("", "", " ")).join(word() for _ in range(count))).encode("latin-1")


def by_the_first(line, dialect):
    """Words, increments, effects of names, and the mark of block delete; None: not understood."""
    block = parse_block(line, dialect.name)
    effects = sorted(dialect.names.get(name.name, "flow") for name in block.names)
    if block.problem is not None or "flow" in effects:
        return None
    words = sorted(
        (w.letter, "nan" if w.value is None else repr(w.value))
        for w in block.words
        if w.letter != "N"
    )
    increments = {word.letter: word.function for word in block.words if word.function}
    acts = [effect for effect in effects if effect != "none"]
    return words, increments, acts, block.block_delete, block.percent


def by_the_second(line, dialect, text):
    said = text.read(line, first=False)
    if not said.understood or "flow" in said.effects:
        return None
    words = sorted((letter, repr(number)) for letter, number, _ in said.words if letter != "N")
    acts = sorted(effect for effect in said.effects if effect != "limit")
    return words, dict(said.relative), acts, said.deleted, said.percent


@pytest.mark.parametrize("name", [name for name in DIALECTS if name != "klartext"])
def test_both_see_the_same_words(name):
    dialect = find_dialect(name)
    rng, text, kinds = random.Random(name), Text(dialect, decimals_matter=False), Counter()
    for _ in range(COUNT):
        line = drawn(rng)
        first, second = by_the_first(line, dialect), by_the_second(line, dialect, text)
        if first and second:
            assert first == second, line
        kinds[first is not None, second is not None] += 1
    # Few lines are understood by one of the two alone.
    assert kinds[True, True] > 0.03 * COUNT
    assert kinds[True, False] + kinds[False, True] < kinds[True, True], kinds
