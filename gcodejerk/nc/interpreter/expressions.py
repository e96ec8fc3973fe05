"""Numbers that a program computes: ``[#1 + 2 * SIN[30]]``, ``R1+5*(R2-1)``.

Rule 1: NaN is a number that is not known. It comes out wherever a variable is unknown, where the
control would stop (a division by zero, the root of a negative number) or where two controls of the
dialect could differ; nothing here raises.

Rule 2: the grammar is the dialect's table (`Arithmetic`); work grows with the length of the text,
and brackets deeper than `DEEPEST` are not followed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.interpreter.grammar import Formula, NamedReader, NotComputableError, Reader
from gcodejerk.nc.interpreter.operations import NAN, VACANT

REMEMBERED = 1 << 12
"""Texts of which it is known what they say to compute."""
_SPLIT = re.compile(rb"[0-9.][ \t]+[0-9.]")


def variable_name(text: bytes) -> str:
    """Name of a variable as the state holds it: blanks and case make no difference.

    Examples
    --------
    >>> variable_name(b"< My depth >"), variable_name(b"0012"), variable_name(b"R5")
    ('<MYDEPTH>', '12', 'R5')
    """
    name = text.translate(None, b" \t").decode("latin-1").upper()
    return str(int(name)) if name.isdigit() else name


def evaluate(text: bytes, variables: Mapping[str, float], rules: Arithmetic) -> float:
    r"""Compute an expression.

    Parameters
    ----------
    text : bytes
        As written: a number, a variable, brackets with an expression in them.
    variables : mapping of str to float
        Those that are known, by `variable_name`.
    rules : Arithmetic
        The dialect's.

    Returns
    -------
    float
        NaN where it is not known.

    Examples
    --------
    >>> from gcodejerk.nc.dialects.linuxcnc import LINUXCNC
    >>> evaluate(b"[#1 + 2 ** 3]", {"1": 4.0}, LINUXCNC.arithmetic)
    12.0
    """
    formula = _formula(text, rules)
    if formula is None:
        return NAN
    try:
        value = formula(variables)
    except (ArithmeticError, ValueError):
        return NAN
    return value if math.isfinite(value) or value == VACANT else NAN


@lru_cache(maxsize=REMEMBERED)
def _formula(text: bytes, rules: Arithmetic) -> Formula | None:
    """What a text says to compute; None where it is no expression."""
    if _SPLIT.search(text):
        return None  # one number with a blank in it, or two: dialects differ
    if rules.brackets == "()":
        reader: Reader = NamedReader(text.strip(b" \t").upper(), rules)
    else:
        reader = Reader(text.translate(None, b" \t").upper(), rules)
    try:
        formula = reader.expression(0)
    except (NotComputableError, ArithmeticError, ValueError):
        return None
    return formula if reader.at == len(reader.text) else None
