"""A second reading of lines in Heidenhain Klartext: what `reading` is for words of letters.

Rule: of a statement that is no straight line only its name counts, and the table of the dialect
says what it does; what the table does not have is not understood.
"""

from __future__ import annotations

import math
import re

from gcodejerk.nc.dialects.dialect import Dialect, Effect

_FRONT = re.compile(r"\s*(?P<skip>/)?\s*(?:\d+(?:\s+|$))?(?P<late>/)?\s*(?P<rest>.*)")
_CYCLE = re.compile(r"CYCL\s+DEF\s+(\d+)(?:\.\d+)?(?!\d)")
_FUNCTION = re.compile(r"FN\s*(\d+)\s*:")
_LINE = re.compile(r"L(?:\s+(.*))?")
_PLAIN = r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)"
_VALUE = rf"(?:{_PLAIN}|[+-]?Q[LR]?\d+)"
_PIECE = re.compile(
    rf"(?P<step>I?)(?P<axis>[XYZABCUVW])(?P<place>{_VALUE})|R(?P<side>[0LR])"
    rf"|F\s*(?P<feed>MAX|AUTO|{_VALUE})|M\s*(?P<m>\d{{1,3}})"
)
_AWAY = re.compile(
    rf"L(\s+R0)?(\s+FMAX)?\s+M140\s+MB\s*(MAX|{_PLAIN})(\s+F(MAX|{_PLAIN}))?", re.ASCII
)
_FUNCTIONS = re.compile(r"(?=STOP\b|M\s*\d)(?P<stop>STOP\b)?(?:\s*M\s*\d{1,3})*(?!\S)")
_PARAMETER = re.compile(r"Q[LRS]?\d+\s*=")
_SIDE = re.compile(r"(?<![A-Z0-9])R([0LR])(?![A-Z0-9.,+-])")
_OTHER_M = re.compile(r"(?<=\s)M\s*(\d{1,3})")
_OTHER_F = re.compile(rf"(?<=\s)F\s*(MAX|AUTO|{_VALUE})")
_NAMES = {"0": 40.0, "L": 41.0, "R": 42.0}
Word = tuple[str, float, bool]


class Statement:
    """What a line says: words, what else it does, and whether that is all of it."""

    def __init__(self) -> None:
        self.words: list[Word] = []
        self.effects: list[Effect] = []
        self.relative: dict[str, str] = {}
        self.deleted = False
        self.understood = True

    def fail(self) -> Statement:
        """Not understood."""
        self.understood = False
        return self

    def put(self, letter: str, number: float) -> None:
        """Add a word."""
        self.words.append((letter, number, False))


def read_statement(text: bytes, dialect: Dialect) -> Statement:
    """Read one line without its end.

    Parameters
    ----------
    text : bytes
        The line.
    dialect : Dialect
        Whose table names the statements.

    Returns
    -------
    Statement
    """
    found = Statement()
    if len(text) > dialect.text.line_limit:
        return found.fail()
    front = _FRONT.fullmatch(text.decode("latin-1").upper().rstrip())
    if front is None:
        return found.fail()
    found.deleted = bool(front["skip"] or front["late"])
    if front["rest"].startswith("*"):
        return found
    said, _, _ = front["rest"].partition(";")
    said = said.strip()
    goes_on = front["rest"].endswith("~")
    if not said:
        return found
    if _PARAMETER.match(said):
        return found
    if _AWAY.fullmatch(said) and not goes_on:
        found.effects.append(dialect.names["M140"])
        return found
    if (straight := _LINE.fullmatch(said)) and not goes_on:
        return _straight(found, straight[1] or "")
    return _named(found, said, dialect, goes_on=goes_on)


def _straight(found: Statement, words: str) -> Statement:
    """``L X+10 Y+5 R0 FMAX M3``."""
    rapid = False
    seen: set[str] = set()
    for piece in re.sub(r"\b([FM])\s+(?=\d|MAX|AUTO|Q)", r"\1", words).split():
        match = _PIECE.fullmatch(piece)
        if match is None:
            return found.fail()
        what = match["axis"] or ("R" if match["side"] else "F" if match["feed"] else "")
        if what and what in seen:
            return found.fail()
        seen.add(what)
        if match["axis"]:
            found.put(match["axis"], _number(match["place"]))
            if match["step"]:
                found.relative[match["axis"]] = "IC"
        elif match["side"]:
            found.put("G", _NAMES[match["side"]])
        elif match["m"]:
            _function(found, int(match["m"]))
        elif match["feed"] == "MAX":
            rapid = True
        else:
            found.put("F", _number(match["feed"]))
    found.words.insert(0, ("G", 0.0 if rapid else 1.0, False))
    return found


def _named(found: Statement, said: str, dialect: Dialect, *, goes_on: bool) -> Statement:
    """A statement by its name, or M functions alone."""
    cycle, function = _CYCLE.match(said), _FUNCTION.match(said)
    if cycle:
        name = f"CYCL DEF {int(cycle[1])}"
    elif function:
        name = f"FN {int(function[1])}"
    else:
        parts = said.split()
        pair = " ".join(parts[:2])
        name = pair if pair in dialect.names or pair in ("BEGIN PGM", "END PGM") else parts[0]
    if goes_on and not cycle:
        return found.fail()
    if name == "BEGIN PGM":
        unit = said.split()[-1]
        if unit not in ("MM", "INCH"):
            return found.fail()
        found.put("G", 70.0 if unit == "INCH" else 71.0)
    elif name == "END PGM":
        found.put("M", 30.0)
    elif functions := _FUNCTIONS.fullmatch(said):
        if functions["stop"]:
            found.put("M", 0.0)
        for number in map(int, re.findall(r"M\s*(\d{1,3})", said)):
            if number or not functions["stop"]:  # STOP M0 is one stop
                _function(found, number)
    elif _FUNCTIONS.match(said):
        return found.fail()
    else:
        _other(found, name, said, dialect)
    return found


def _other(found: Statement, name: str, said: str, dialect: Dialect) -> None:
    """What the table has by its name; anything else is of flow."""
    effect = dialect.names.get(name, "flow")
    if name == "TOOL CALL":
        found.put("T", math.nan)
    else:
        for number in _OTHER_M.findall(said):
            _function(found, int(number))
    for side in _SIDE.findall(said):
        found.put("G", _NAMES[side])
    if effect == "home" and (feed := _OTHER_F.search(said)) and feed[1] != "MAX":
        found.put("F", _number(feed[1]))
    if effect != "none":
        found.effects.append(effect)


def _function(found: Statement, number: int) -> None:
    """An M function; some are statements of their own."""
    if number == 99:
        found.effects.append("cycle")
    elif number in (91, 92):
        found.effects.append("machine")
    else:
        found.put("M", float(number))


def _number(text: str) -> float:
    """A number, with a point or a comma; NaN for a parameter."""
    return math.nan if text[-1].isalpha() or "Q" in text else float(text.replace(",", "."))
