"""What operators and functions of expressions compute.

Rule: NaN is a number that is not known, and what depends on it is not known either. Where the last
digits decide, two controls may differ: such a result is NaN too.
"""

from __future__ import annotations

import math
import operator as operators
from collections.abc import Callable

from gcodejerk.nc.dialects.arithmetic import Arithmetic

NAN = math.nan
VACANT = math.inf
"""What a variable holds that nobody has set: it counts as 0 but equals no number (macro B)."""
EQUAL = 0.0001
"""LinuxCNC's tolerance of EQ and NE (TOLERANCE_EQUAL)."""
DIGITS = 1e-6
"""Relative difference that controls with eight digits may not see."""
RELATIVE = 1e-12
"""Relative difference below which Siemens takes two numbers for equal (NC programming 12/2019,
p. 444, "relative equality"); a little above it, nobody is sure."""
LARGEST_TANGENT = 1e9
"""Beyond it the last digit of pi decides, at 90 degrees even the sign."""
LARGEST_ANGLE = 1e6
"""Degrees beyond which the last digits of an angle, which rounding decides, are too many turns."""
LAST = 1e-11
"""Relative difference that the last digits of a function can make."""
NEARLY_ZERO = 1e-9
"""What a zero may be after errors of rounding, on one side or the other."""
LARGEST_DIVIDED = 1e8
"""The rest that MOD leaves of more is made of errors of rounding."""
LARGEST_ROUNDED = 2.0**31
"""ROUND goes through an integer of the control."""
COMPARISONS = frozenset(("EQ", "NE", "GT", "GE", "LT", "LE", "==", "<>", ">", ">=", "<", "<="))


def apply(operator: str, a: float, b: float, rules: Arithmetic) -> float:
    """Compute a binary operation."""
    if a != a or b != b:
        return NAN
    if operator in COMPARISONS:
        return _compare(operator, a, b, rules)
    a, b = 0.0 if a == VACANT else a, 0.0 if b == VACANT else b
    if operator in _LOGIC:
        return _logic(operator, a, b) if rules.bits else float(_LOGIC[operator](a != 0.0, b != 0.0))
    if operator in ("MOD", "DIV"):
        return _divide(operator, a, b, rules)
    value = float(_OPERATIONS[operator](a, b))
    return value if math.isfinite(value) else NAN


def _logic(operator: str, a: float, b: float) -> float:
    """Combine two truths; other numbers are combined bit by bit, and left alone here."""
    if {a, b} <= {0.0, 1.0}:
        return float(_LOGIC[operator](a != 0.0, b != 0.0))
    return NAN


def _divide(operator: str, a: float, b: float, rules: Arithmetic) -> float:
    """Compute the rest of a division, or how often."""
    if abs(a) >= LARGEST_DIVIDED:
        return NAN
    if operator == "DIV" or rules.compared == "relative":
        whole = a.is_integer() and b.is_integer() and a >= 0.0 and b > 0.0
        if not whole:
            return NAN
        return float(a // b) if operator == "DIV" else math.fmod(a, b)
    left = math.fmod(a, b)
    if left < 0.0 and not rules.floor:
        return NAN
    return left if left >= 0.0 else abs(left + abs(b))


def _compare(operator: str, a: float, b: float, rules: Arithmetic) -> float:
    """Compare two numbers as the control does; NaN where their last digits decide."""
    if VACANT in (a, b):
        if operator in ("EQ", "NE"):
            return float((a == b) == (operator == "EQ"))
        a, b = (0.0 if x == VACANT else x for x in (a, b))
    if rules.compared == "near":
        apart = abs(a - b)
        if (
            rules.careful
            and operator not in ("EQ", "NE")
            and 0.0 < apart <= LAST * max(abs(a), abs(b))
        ):
            return NAN
        return float(_NEAR[operator](a, b))
    larger = max(abs(a), abs(b))
    if a != b and abs(a - b) <= DIGITS * larger:
        if rules.compared != "relative" or abs(a - b) > RELATIVE * larger:
            return NAN
        b = a
    return float(_EXACT[operator](a, b))


def call(name: str, x: float, rules: Arithmetic) -> float:
    """Compute a function of one argument."""
    if x == VACANT:
        x = 0.0
    if name in _WHOLE and rules.careful and x != round(x) and _is_edge(name, x):
        return NAN
    if name in _WHOLE and not rules.exact:
        edge = x + 0.5 if name == "ROUND" else x
        close = abs(edge - round(edge)) < NEARLY_ZERO * max(1.0, abs(x))
        if close and ((name == "ROUND" and x < 0.0) or edge != round(edge)):
            return NAN  # the last digit decides; or a half of a negative number, one way or other
    value = float(_FUNCTIONS[name](x))
    if name in ("ASIN", "ATAN") and value < 0.0 and not rules.angles:
        return NAN
    if name in ("FIX", "FUP") and rules.floor:
        value = float(math.floor(x) if name == "FIX" else math.ceil(x))
    return value if math.isfinite(value) else NAN


def _is_edge(name: str, x: float) -> bool:
    """Whether the last digits of a number decide what it is rounded to."""
    edge = x + 0.5 if name == "ROUND" else x
    return abs(edge - round(edge)) <= LAST * max(1.0, abs(x))


def arc_tangent(y: float, x: float) -> float:
    """Give the angle of a vector; NaN where the sign of a zero decides between 180 and -180."""
    y, x = (0.0 if z == VACANT else z for z in (y, x))
    if abs(y) <= NEARLY_ZERO * max(1.0, abs(x)) and x <= NEARLY_ZERO:
        return NAN
    return math.degrees(math.atan2(y, x))


def _round(x: float) -> float:
    """Round to the nearest whole number, a half away from zero."""
    return math.copysign(math.floor(abs(x) + 0.5), x) if abs(x) < LARGEST_ROUNDED else NAN


def _turned(function: Callable[[float], float], x: float) -> float:
    """Apply a function of an angle in degrees, but not to thousands of turns."""
    return function(math.radians(x)) if abs(x) < LARGEST_ANGLE else NAN


def _tangent(x: float) -> float:
    """Compute the tangent, but not at its poles."""
    value = _turned(math.tan, x)
    return value if abs(value) < LARGEST_TANGENT else NAN


_LOGIC: dict[str, Callable[[bool, bool], bool]] = {
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
    "XOR": operators.ne,
}
_OPERATIONS: dict[str, Callable[[float, float], float]] = {
    "**": math.pow,
    "*": operators.mul,
    "/": operators.truediv,
    "+": operators.add,
    "-": operators.sub,
}
_EXACT: dict[str, Callable[[float, float], bool]] = {
    **dict.fromkeys(("EQ", "=="), operators.eq),
    **dict.fromkeys(("NE", "<>"), operators.ne),
    **dict.fromkeys(("GT", ">"), operators.gt),
    **dict.fromkeys(("GE", ">="), operators.ge),
    **dict.fromkeys(("LT", "<"), operators.lt),
    **dict.fromkeys(("LE", "<="), operators.le),
}
_NEAR: dict[str, Callable[[float, float], bool]] = {
    **_EXACT,
    "EQ": lambda a, b: abs(a - b) < EQUAL,
    "NE": lambda a, b: abs(a - b) >= EQUAL,
}
_WHOLE = frozenset(("FIX", "FUP", "ROUND", "TRUNC"))
# Angles are degrees everywhere.
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "COS": lambda x: _turned(math.cos, x),
    "EXP": math.exp,
    "FIX": math.trunc,
    "FUP": lambda x: math.copysign(math.ceil(abs(x)), x),
    "LN": math.log,
    "POT": lambda x: x * x,
    "ROUND": _round,
    "SIN": lambda x: _turned(math.sin, x),
    "SQRT": math.sqrt,
    "TAN": _tangent,
    "TRUNC": math.trunc,
}
