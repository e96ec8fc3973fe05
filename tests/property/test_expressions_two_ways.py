"""Expressions: the two readings compute the same, each by its own means, or one does not know."""

import math
import random
import re
from collections import Counter

import pytest

from gcodejerk.nc import DIALECTS, Start
from gcodejerk.nc.interpreter.expressions import evaluate
from gcodejerk.verification.second_reading.worth import OPEN, Expressions, UnknownError

VARIABLES = {
    "#": {"1": 1.5, "2": -0.25, "10": 3.0, "101": -2.0},
    "R": {"R1": 1.5, "R2": -0.25, "R10": 3.0, "DEPTH": -2.0, "A[1]": 4.0},
    "Q": {"Q1": 1.5, "Q2": -0.25, "Q10": 3.0, "Q101": -2.0},
}
NUMBERS = ["2", "1.5", ".25", "3.", "0", "7", "0.1", "12.75", "-1.", "-2.8"]
COUNT = 4000
LEAST = {"linuxcnc": 0.3}
"""Share of expressions that both know, where it is not 0.5: LinuxCNC's last digits decide."""
TYPED = re.compile(rb"(?<![#A-Z0-9.\[])(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
"""Numbers that are no variable's."""


class Drawn:
    """Draws expressions of a dialect."""

    def __init__(self, dialect):
        self.rng, rules = random.Random(dialect.name), dialect.arithmetic
        self.operators = [name for level in rules.levels for name in level]
        self.functions = sorted(rules.functions)
        self.opens, self.closes = rules.brackets
        self.kind = dialect.text.variables

    def atom(self):
        if self.rng.random() < 0.5:
            return self.rng.choice(NUMBERS)
        name = self.rng.choice(list(VARIABLES[self.kind]))
        return f"#{name}" if self.kind == "#" else name

    def bracket(self, depth):
        return f"{self.opens}{self.any(depth - 1)}{self.closes}"

    def any(self, depth=3):
        kinds = ["atom", "work", "work", "bracket", "minus", "function", "function"]
        kinds += ["not", "truth"] if self.kind == "R" else []
        kind = self.rng.choice(kinds) if depth > 0 else "atom"
        if kind == "work":
            operator = self.rng.choice(self.operators)
            blank = " " if operator.isalpha() else self.rng.choice(("", "", " "))
            return blank.join((self.any(depth - 1), operator, self.any(depth - 1)))
        if kind == "bracket":
            return self.bracket(depth)
        if kind == "minus":
            return "-" + self.bracket(depth)
        if kind == "not":
            return f"NOT {self.any(0)}"
        if kind == "truth":
            return self.rng.choice(("TRUE", "FALSE"))
        if kind == "function" and self.functions:
            name = self.rng.choice(self.functions)
            if name == "ATAN2":
                return f"ATAN2{self.opens}{self.any(depth - 1)},{self.any(depth - 1)}{self.closes}"
            second = f"/{self.bracket(depth)}" if name == "ATAN" else ""
            return name + self.bracket(depth) + second
        return self.atom()


def second_worth(expressions, text, variables, typed=()):
    try:
        steps, at = expressions.read(text, 0)
    except UnknownError:
        return math.nan
    return expressions.worth(steps, variables, typed) if at == len(text) else math.nan


@pytest.mark.parametrize(
    "name", sorted(name for name, each in DIALECTS.items() if each.arithmetic.levels)
)
def test_both_readings_compute_the_same_or_one_does_not_know(name):
    dialect = DIALECTS[name].set_up(Start())
    drawn, rules = Drawn(dialect), dialect.arithmetic
    expressions, variables = Expressions(rules), VARIABLES[dialect.text.variables]
    known = Counter()
    for _ in range(COUNT):
        text = drawn.any().encode()
        first = evaluate(text, variables, rules)
        second = second_worth(expressions, text, variables)
        known[not math.isnan(first), not math.isnan(second)] += 1
        if not math.isnan(first) and not math.isnan(second):
            # Those that are not exact are rounded to an increment: only LinuxCNC shows its digits.
            assert first == pytest.approx(second, rel=0.0 if rules.exact else 1e-12), text
        typed = [float(number) for number in TYPED.findall(text)]
        with_places = second_worth(expressions, TYPED.sub(OPEN, text), variables, typed)
        assert with_places == pytest.approx(second, rel=0.0, abs=0.0, nan_ok=True), text
    assert known[True, True] > LEAST.get(name, 0.5) * COUNT
    # A reading that knows more than the other is no danger; that it does is seldom.
    assert known[False, True] < 0.02 * COUNT


@pytest.mark.parametrize("text", [b"DEPTH(2)", b"R1(2)", b"GRID(1,2)", b"NOT", b"TRUE(1)"])
def test_what_is_no_variable_of_siemens_is_known_to_none(text):
    dialect = DIALECTS["siemens"].set_up(Start())
    variables = {**VARIABLES["R"], "GRID": 1.0}
    assert math.isnan(evaluate(text, variables, dialect.arithmetic))
    assert math.isnan(second_worth(Expressions(dialect.arithmetic), text, variables))


@pytest.mark.parametrize(
    ("name", "down", "up"), [("mach", -2.0, -1.0), ("fanuc", -1.0, -2.0), ("haas", -1.0, -2.0)]
)
def test_fix_and_fup_of_what_is_negative(name, down, up):
    # NIST's RS274/NGC rounds down and up ("fix[-2.8] = -3"), Fanuc towards zero and away from it.
    dialect = DIALECTS[name].set_up(Start())
    expressions = Expressions(dialect.arithmetic)
    for text, wanted in ((b"FIX[-1.5]", down), (b"FUP[-1.5]", up)):
        assert evaluate(text, {}, dialect.arithmetic) == wanted
        assert second_worth(expressions, text, {}) == wanted
