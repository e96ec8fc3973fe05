"""What functions and operators give, for the second reading.

Rule: where the last digit decides, and where a control's parameter does, nothing is known (NaN).
"""

from __future__ import annotations

import math
import operator as operators
from collections.abc import Callable

from gcodejerk.verification.second_reading.reading import NAN

VACANT = -math.inf
"""What a macro was not given."""


def typed(kind: str, number: float) -> float:
    """What a variable of a type holds of a number."""
    if kind == "REAL" or number != number:
        return number
    if kind == "BOOL":
        return float(number != 0.0)
    if number % 1.0 == 0.5:
        return number + 0.5 if number > 0.0 else NAN
    return float(round(number)) if abs(number) < 1e9 else NAN


def angle_of(y: float, x: float) -> float:
    """Angle of a vector; NaN where it may be 180 or -180."""
    y, x = (0.0 if z == VACANT else z for z in (y, x))
    if x != x or y != y or (abs(y) < 1e-6 and x < 1e-6):
        return NAN
    return math.degrees(math.atan2(y, x))


def computed(name: str, x: float, floor: bool) -> float:
    """A function of one number; angles in degrees, and with `floor` FIX and FUP down and up."""
    if x != x:
        return NAN
    if name in ("FIX", "FUP", "ROUND", "TRUNC"):
        return _rounded(name, x, floor)
    if name in ("SIN", "COS", "TAN"):
        if abs(x) > 1e5:
            return NAN
        number = getattr(math, name.lower())(math.radians(x))
        return float(number) if abs(number) < 1e6 else NAN
    if name in ("ASIN", "ACOS"):
        number = math.degrees(getattr(math, name.lower())(x))
        return number if number >= 0.0 else NAN
    if name == "POT":
        return x * x
    if name == "ABS":
        return abs(x)
    simple = {"SQRT": math.sqrt, "LN": math.log, "EXP": math.exp}
    return float(simple[name](x)) if name in simple else NAN


def _rounded(name: str, x: float, floor: bool) -> float:
    """A whole number; NaN where the last digit decides which."""
    edge = x + 0.5 if name == "ROUND" else x
    if abs(edge - round(edge)) < 1e-6 and not (name != "ROUND" and x == round(x)):
        return x + 0.5 if name == "ROUND" and x > 0.0 and (x + 0.5).is_integer() else NAN
    if name in ("FIX", "FUP") and floor:
        return float(math.floor(x) if name == "FIX" else math.ceil(x))
    away = math.copysign(math.ceil(abs(x)), x)
    return float({"ROUND": round(x), "FUP": away}.get(name, math.trunc(x)))


def binary(operator: str, a: float, b: float) -> float:
    """An operation of two numbers."""
    vacant = VACANT in (a, b)
    if vacant and operator in ("EQ", "NE"):
        return float((a == b) is (operator == "EQ"))
    a, b = 0.0 if a == VACANT else a, 0.0 if b == VACANT else b
    if operator in _SIMPLE:
        number = _SIMPLE[operator](a, b)
        return number if math.isfinite(number) else NAN
    if operator in _COMPARED:
        near = abs(a - b) <= 1e-6 * max(abs(a), abs(b))
        if near and a != b and not (operator[0] in "=<>" and math.isclose(a, b, rel_tol=1e-12)):
            return NAN
        difference = 0.0 if near else a - b
        return float(_COMPARED[operator](difference))
    if operator in ("AND", "OR", "XOR", "MOD", "DIV"):
        return _whole(operator, a, b)
    number = math.pow(a, b)
    return number if math.isfinite(number) else NAN


def _whole(operator: str, a: float, b: float) -> float:
    """An operation of truth values, or of whole numbers; NaN of others."""
    if operator in ("AND", "OR", "XOR"):
        if {a, b} - {0.0, 1.0}:
            return NAN
        return float({"AND": min(a, b), "OR": max(a, b), "XOR": abs(a - b)}[operator])
    if not (a.is_integer() and b.is_integer() and 0.0 <= a < 1e8 and b > 0.0):
        return NAN
    return float(a % b if operator == "MOD" else a // b)


_SIMPLE: dict[str, Callable[[float, float], float]] = {
    "+": operators.add,
    "-": operators.sub,
    "*": operators.mul,
    "/": operators.truediv,
}
_COMPARED: dict[str, Callable[[float], bool]] = {
    **dict.fromkeys(("EQ", "=="), lambda d: d == 0.0),
    **dict.fromkeys(("NE", "<>"), lambda d: d != 0.0),
    **dict.fromkeys(("GT", ">"), lambda d: d > 0.0),
    **dict.fromkeys(("GE", ">="), lambda d: d >= 0.0),
    **dict.fromkeys(("LT", "<"), lambda d: d < 0.0),
    **dict.fromkeys(("LE", "<="), lambda d: d <= 0.0),
}
