"""What text may leave on that is not followed, by the codes that stand in it.

Where the last line leads to the first one (M99 in the main program, M47, GOTOS), the first line
finds what the last pass has left; and a line that is not understood may run all the same. Modal
groups are forgotten there; this module owns what is no group and off until something begins it:
macros and cycles that run at every position, polar and rotated frames, compressors, limits, a scale
of F.

Rule: comments count as code. What may have been begun is unknown until it is ended.
"""

from __future__ import annotations

import re
from typing import BinaryIO, NamedTuple

from gcodejerk.nc.dialects.dialect import OVERRIDES_SET, Dialect, Effect
from gcodejerk.nc.interpreter.effects import MODAL_MACRO
from gcodejerk.nc.interpreter.limits import LIMIT
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.text.chunks import read_chunks

_G_CODE = re.compile(rb"G[ \t]*0*([0-9]+(?:\.[0-9]*)?)", re.IGNORECASE)
_M_CODE = re.compile(rb"M[ \t]*0*([0-9]+)(?![0-9.])", re.IGNORECASE)
_NAME = re.compile(rb"\$|[A-Z_][A-Z_][A-Z0-9_]*", re.IGNORECASE)
NO_CODE = 10**6
"""Above all codes of all controls, times ten."""
_TRANSFORMS: dict[Effect, str] = {
    "modal cycle": MODAL_MACRO,
    "transform": "frame",
    "swivel": "swivel",
    "turned frame": "programmed frame",
    "further turn": "programmed frame",
    "written": "written frame",
}
_BARS: dict[Effect, str] = {
    "compressor": "compressor",
    "smoothing": "compressor",
    "feed group": "feed group",
    "feed override": "feed override",
    "corners": "rounded corners",
    "watch": "synchronized action",
    "limit": LIMIT + "anything",
}
"""Effect -> its name among `State.transforms` and `State.bars`."""


class LeftOn(NamedTuple):
    """Names of what may be on."""

    transforms: frozenset[str] = frozenset()
    bars: frozenset[str] = frozenset()

    def beside(self, other: LeftOn) -> LeftOn:
        """What either may have left on."""
        return LeftOn(self.transforms | other.transforms, self.bars | other.bars)

    def enter(self, state: State) -> None:
        """Make it unknown."""
        if self.transforms:
            state.put("transforms", {**state.transforms, **dict.fromkeys(self.transforms)})
        if self.bars:
            state.put("bars", {**state.bars, **dict.fromkeys(self.bars)})


NOTHING = LeftOn()


def code_of(number: bytes, times: float = 10.0) -> int:
    """The number of a code, times ten as in `gcodes`; `NO_CODE` for one that no control has."""
    value = times * float(number)
    return round(value) if value < NO_CODE else NO_CODE


# Complex: one line for each kind of code.
def left_by(text: bytes, dialect: Dialect) -> LeftOn:
    """Look text through, as it is written."""
    codes = [code_of(number) for number in set(_G_CODE.findall(text))]
    orders = [code_of(number, 1.0) for number in set(_M_CODE.findall(text))]
    names = set(_NAME.findall(text.upper())) if dialect.text.names else set()
    effects = [dialect.effect(code) for code in codes]
    effects += [dialect.names.get(each.decode(), "none") for each in names]
    transforms = {dialect.transforms[code][0] for code in codes if code in dialect.transforms}
    transforms |= {_TRANSFORMS[effect] for effect in effects if effect in _TRANSFORMS}
    bars = {dialect.bars[code][0] for code in codes if code in dialect.bars}
    bars |= {dialect.m_bars[m] for m in orders if m in dialect.m_bars}
    bars |= {"feed override" for m in orders if m in dialect.m_scales}
    bars |= {_BARS[effect] for effect in effects if effect in _BARS}
    if any(f"M{m}" in dialect.limits for m in orders):
        bars.add(LIMIT + "anything")
    variable = dialect.arithmetic.overrides.encode()
    if variable and b"#" in text and variable in text:
        bars.add(OVERRIDES_SET)
    return LeftOn(frozenset(transforms), frozenset(bars))


def left_on(file: BinaryIO, dialect: Dialect, name: str) -> LeftOn:
    """Look a file through, and go back to where it stood.

    Parameters
    ----------
    file : BinaryIO
        Seekable.
    dialect : Dialect
        How it is written.
    name : str
        For messages.

    Returns
    -------
    LeftOn
    """
    begin = file.tell()
    found = NOTHING
    for chunk in read_chunks(file, name):
        found = found.beside(left_by(chunk.data, dialect))
    file.seek(begin)
    return found
