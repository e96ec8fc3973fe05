"""Limits of speed and acceleration in a program, for the second reading.

Rule: whatever does not certainly leave the machine file's numbers possible counts as too low. What
bounds the path is held against each move, since several axes make more of it than one.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

from gcodejerk.nc.dialects.dialect import LINEAR, Dialect
from gcodejerk.nc.dialects.limits import PERCENT, SETTING

Said = tuple[str, str, float]
"""M code or name; the word; its number, NaN where it is none."""
_NUMBER = rb"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)"
_PAIR = re.compile(rb"([A-Z_]+)[ \t]*=[ \t]*(?:(" + _NUMBER + rb")(?=[ \t]|$))?")
_PERCENT = re.compile(
    rb"(?<![A-Z0-9_$])([A-Z]+)[ \t]*\[([^\]]*)\][ \t]*=[ \t]*(?:("
    + _NUMBER
    + rb")(?=[ \t]|$)|[^ \t]*)"
)
_NAMES = re.compile(rb"(?<![A-Z0-9_$])[A-Z][A-Z_][A-Z0-9_]*(?![A-Z0-9_]|[ \t]*[=:\[])")
_QUOTED = re.compile(rb'"[^"]*"')
_NOT_ONE = float("nan")
WHICH = {"velocity": 0, "acceleration": 1, "jerk": 2}
"""Of the numbers of an axis."""


def take_limits(text: bytes, dialect: Dialect) -> tuple[bytes, list[Said]]:
    """Take what sets limits out of a line, in capitals and without comments.

    Parameters
    ----------
    text : bytes
        The line.
    dialect : Dialect
        Of the program.

    Returns
    -------
    rest : bytes
        What is left; names without brackets, and settings, stay.
    said : list of Said
    """
    tables = dialect.limits
    if SETTING in tables and text.startswith(b"$"):
        bare = text[1:].replace(b" ", b"").replace(b"\t", b"")
        number, _, value = bare.partition(b"=")
        return text, [(SETTING, number.decode("latin-1"), _number(value))]
    if dialect.one_command:
        name = text.split(maxsplit=1)[0].decode("latin-1") if text.split() else ""
        pairs = _PAIR.findall(text) if name in tables else []
        return text, [(name, word.decode(), _number(value)) for word, value in pairs]
    said: list[Said] = []

    def take(match: re.Match[bytes]) -> bytes:
        name = match[1].decode()
        if PERCENT not in tables.get(name, {}):
            return match[0]
        said.append((name, match[2].decode("latin-1").strip(), _number(match[3] or b"")))
        return b" "

    for word in _NAMES.findall(_QUOTED.sub(b"", text)) if dialect.limit_modes else ():
        if word.decode() in dialect.limit_modes:
            said.append((word.decode(), "", _NOT_ONE))
    return (_PERCENT.sub(take, text), said) if b"[" in text else (text, said)


def too_low(
    said: Iterable[Said], dialect: Dialect, stated: Mapping[str, tuple[float, float, float]]
) -> dict[str, bool]:
    """What is limited of the axes, and whether that may be in the way of a stream.

    Parameters
    ----------
    said : iterable of Said
        Of one block.
    dialect : Dialect
        Of the program.
    stated : mapping
        `gcodejerk.start.Start.limits`.
    """
    found: dict[str, bool] = {}
    for name, word, number in said:
        table = dialect.limits.get(name, {})
        if mode := dialect.limit_modes.get(name):
            unlimited = any(jerk == math.inf for *_, jerk in stated.values()) or not stated
            found[mode.thing] = mode.keeps == "lower" or (mode.keeps == "jerk" and unlimited)
            continue
        if PERCENT in table:
            found[f"{name} of {word}"] = not number >= 100.0
            continue
        if name == SETTING and any(part in word for part in ("RST", "RATE", "ACCEL")):
            found["settings"] = True
        if word not in table:
            continue
        limit = table[word]
        if not limit.axis:
            continue
        needs = [of[WHICH[limit.quantity]] for axis, of in stated.items() if limit.axis == axis]
        low = not stated or any(not number * limit.scale * (1.0 + 1e-9) >= n for n in needs)
        if name == SETTING and not low:
            continue  # it may be refused, and what was set before stays
        thing = f"{limit.quantity} {limit.axis}"
        found[thing] = found.get(thing, False) or low
    return found


def along_path(said: Iterable[Said], dialect: Dialect) -> dict[str, float]:
    """The lowest limit of the path that a block sets, of each quantity; 0 where it is no number."""
    found: dict[str, float] = {}
    for name, word, number in said:
        limit = dialect.limits.get(name, {}).get(word)
        if limit is not None and not limit.axis and name != SETTING and word != PERCENT:
            value = number * limit.scale if number > 0.0 else 0.0
            found[limit.quantity] = min(value, found.get(limit.quantity, value))
    return found


def too_fast(
    slow: Mapping[str, float],
    moved: Mapping[str, float],
    stated: Mapping[str, tuple[float, float, float]],
    together: bool,
    along: tuple[float, float, float] = (math.inf, math.inf, math.inf),
) -> bool:
    """Whether a straight move may have to be faster than the path is allowed to be.

    Parameters
    ----------
    slow : mapping
        Quantity -> limit of the path.
    moved : mapping
        Axis -> way of the axes that move. [mm] or [deg]
    stated : mapping
        `gcodejerk.start.Start.limits`.
    together : bool
        The axes go in proportion, so that the slowest of them bounds the others.
    along : tuple of float
        `gcodejerk.start.Start.along`.
    """
    if not stated:
        return bool(slow)
    if len({axis in LINEAR for axis in moved}) > 1:
        together, moved = False, dict.fromkeys(stated, 1.0)  # nobody says what the path is
    own = {axis: way for axis, way in moved.items() if axis in stated}
    length = math.hypot(*moved.values())
    for quantity, limit in slow.items():
        tops = {axis: stated[axis][WHICH[quantity]] for axis in own}
        if together:
            most = min((tops[axis] * length / abs(way) for axis, way in own.items()), default=0.0)
            if LINEAR.issuperset(moved):
                most = min(most, along[WHICH[quantity]])
        else:
            most = math.hypot(*tops.values())
        if limit * (1.0 + 1e-9) < most:
            return True
    return False


def _number(text: bytes) -> float:
    return float(text) if re.fullmatch(_NUMBER, text) else _NOT_ONE
