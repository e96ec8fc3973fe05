"""Programs whose own words take what the form of `linuxcnc-hal` takes, found a second time.

A request of the program's own (M67, M68 on output 3) plays a rapid in the wrong place or none at
all, M52 switches the factor of every stream, and M66 answers in #5399, which a program may read.

Rule: words are taken apart one by one here, and a number that is computed may be any. LinuxCNC
rounds numbers that have to be integers: what is no further than half from one may be that.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO

from gcodejerk.verification.findings import Findings, Kind

_FOR_PEOPLE = re.compile(rb"\((?!\s*(?:ABORT|DEBUG|PRINT|LOG|PY))[^)]*\)|;(?!\s*PY).*")
_NAMED = re.compile(rb"<[^<>]*>")
_WORD = re.compile(rb"([A-Z])([-+]?[0-9]*\.?[0-9]*)")
_PARAMETER = re.compile(rb"#([-+0-9.]+)")
_WHICH = re.compile(rb"#[\[#]")
TAKEN = 3
"""Number of the output and of the input."""


def check_taken(original: BinaryIO, adaptive: bool, found: Findings) -> None:
    """See that the original leaves to the form what the form needs.

    Parameters
    ----------
    original : BinaryIO
        The whole program; seekable.
    adaptive : bool
        The form is `adaptive-feed`, not `position`.
    found : Findings
        Where what is wrong goes.
    """
    original.seek(0)
    for number, text in enumerate(original, 1):
        line = _FOR_PEOPLE.sub(b"", text.upper().rstrip())
        line = _NAMED.sub(b"", b"".join(line.split()))
        problem = next(_problems(line, adaptive), None)
        if problem is not None:
            found.add(
                Kind.NOT_CERTAIN, None, number, f"{problem}: no stream may stand in this program"
            )


def _problems(line: bytes, adaptive: bool) -> Iterator[str]:
    """What a line takes."""
    words = [(letter, _value(number)) for letter, number in _WORD.findall(line)]
    for letter, code in words:
        if letter != b"M":
            continue
        if (_may_be(code, 67) or _may_be(code, 68)) and _may_be_ours(words, b"E"):
            yield "M67 or M68 asks for a rapid"
        elif _may_be(code, 66) and (_may_be_ours(words, b"P") or not adaptive):
            yield "M66 reads an input"
        elif _may_be(code, 52) and adaptive:
            yield "M52 switches the adaptive feed"
        elif (_may_be(code, 98) or _may_be(code, 99)) and not adaptive:
            yield "M98 calls what may read #5399, and M99 leads back to it"
    if re.search(rb"(?<![A-Z])M[\[#]", line):
        yield "an M code is computed"
    answers = any(_may_be(_value(number), 5399) for number in _PARAMETER.findall(line))
    if not adaptive and (answers or _WHICH.search(line)):
        yield "#5399 is used, or may be"


def _may_be_ours(words: list[tuple[bytes, float | None]], letter: bytes) -> bool:
    """Whether a word of this letter has our number, or one that is computed."""
    return any(name == letter and _may_be(value, TAKEN) for name, value in words)


def _value(number: bytes) -> float | None:
    """Of a number; None where it is none, and may be any."""
    try:
        return float(number)
    except ValueError:
        return None


def _may_be(value: float | None, integer: int) -> bool:
    """Whether a number may be rounded to an integer."""
    return value is None or abs(value - integer) <= 0.5
