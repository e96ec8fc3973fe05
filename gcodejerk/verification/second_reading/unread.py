"""What a line that is not understood may begin and leave on, for the second reading.

Rule: whatever stands in it counts, in comments too. What may have been begun is not known to be off
until something ends it; what no one word ends is on from here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from gcodejerk.nc.dialects.dialect import Dialect, Effect

_BARE_I = re.compile(rb"[^(;]*(?<![A-Z])I[ \t]*(?:[A-Z(;]|$)")
_CODES = re.compile(rb"([GM])[ \t]*([0-9]+(?:\.[0-9]+)?)", re.IGNORECASE)
_LARGEST = 1e6
"""More than any code's number."""
_NAMES = re.compile(rb"[A-Z]{2}[A-Z0-9_]*|[A-Z]_[A-Z0-9_]+", re.IGNORECASE)
_TELLING: frozenset[Effect] = frozenset(
    ("transform", "swivel", "modal cycle", "corner", "corners", "watch")
)
"""Effects that mean the same wherever they were found; of the others more was read."""
_TURNS: frozenset[Effect] = frozenset(
    ("transform", "swivel", "modal cycle", "turned frame", "further turn", "written")
)
_LASTS: dict[Effect, str] = {
    "compressor": "compressor",
    "smoothing": "compressor",
    "feed group": "feed group",
    "feed override": "F is scaled",
    "corner": "corners that are cut",
    "corners": "corners that are cut",
}


def may_begin(
    text: bytes, effects: Iterable[Effect], dialect: Dialect
) -> tuple[set[str], dict[str, bool | None]]:
    """Look a line through.

    Parameters
    ----------
    text : bytes
        The line.
    effects : iterable of Effect
        Of the names that were found in it all the same.
    dialect : Dialect
        Of the program.

    Returns
    -------
    frames : set of str
        What may turn, scale or mirror.
    bars : dict
        What may forbid to rewrite, and whether it does for good (True) or until it is ended (None).
    """
    found, frames, bars = set(effects) & _TELLING, set[str](), dict[str, bool | None]()
    for letter, number in _CODES.findall(text):
        value = min(float(number), _LARGEST)
        code, m = round(10.0 * value), int(value)
        if letter in b"Gg":
            found.add(dialect.effect(code))
            frames |= {name for name, _ in [dialect.transforms.get(code, ("", False))] if name}
            if code in dialect.bars:
                bars[dialect.bars[code][0]] = None
            continue
        if m in dialect.m_bars:
            bars[dialect.m_bars[m]] = None
        if m in dialect.m_scales:
            bars["F is scaled"] = None
        if f"M{m}" in dialect.limits:
            bars["limit of anything"] = True
    if dialect.text.names:
        found |= {dialect.names.get(name.decode().upper(), "none") for name in _NAMES.findall(text)}
    if not found.isdisjoint(_TURNS):
        frames.add("a named frame")
    bars |= {_LASTS[effect]: None for effect in found if effect in _LASTS}
    bars |= {"synchronized action": True} if "watch" in found else {}
    bars |= {"limit of anything": True} if "limit" in found else {}
    return frames, bars


def says_bare_i(text: bytes) -> bool:
    """Whether an I without a number stands in a line: ``M3 I`` makes S a laser's power (Marlin)."""
    return _BARE_I.match(text) is not None
