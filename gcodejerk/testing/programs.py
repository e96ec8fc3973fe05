"""Drawn NC programs, and the comparison of two readings of one.

Rule: what is drawn is well-formed for the dialect; what makes programs odd (blanks, N words,
comments, line ends, packed words) is drawn with it.
"""

from __future__ import annotations

import dataclasses
import io

import numpy as np
from hypothesis import strategies as st

from gcodejerk.errors import ProgramError
from gcodejerk.nc import Program, Start, find_dialect
from gcodejerk.nc.interpreter.modal import MODES
from gcodejerk.nc.program import follow, open_reader
from gcodejerk.nc.text.chunks import read_chunks
from gcodejerk.testing.klartext import klartext_programs
from gcodejerk.testing.vocabulary import VOCABULARIES, draw_lines

Draw = st.DrawFn


def differences(data: bytes, start: Start | None = None, dialect: str = "linuxcnc") -> list[str]:
    """Compare the quick reading of a program with the careful one.

    Parameters
    ----------
    data : bytes
        The program.
    start : Start, optional
        What may be assumed when it starts.
    dialect : str, optional
        How it is written.

    Returns
    -------
    list of str
        What differs: names of columns, of fields, of modal groups. Empty where all is well.
    """
    start = Start() if start is None else start
    readings: list[Program | str] = []
    ends = []
    for fast in (True, False):
        try:
            reader, file = open_reader(io.BytesIO(data), "<program>", dialect, start)
            readings.append(follow(read_chunks(file, reader.name), reader, None, fast))
            ends.append(reader.state)
        except ProgramError as error:
            readings.append(str(error))
    quick, careful = readings
    if isinstance(quick, str) or isinstance(careful, str):
        return [] if quick == careful else [f"refusal: {quick} / {careful}"]
    found = [
        field.name
        for field in dataclasses.fields(quick)
        if field.name not in ("rapids", "steps")  # columns; what reading cost, each way its own
        and getattr(quick, field.name) != getattr(careful, field.name)
    ]
    for field in dataclasses.fields(quick.rapids):
        a, b = getattr(quick.rapids, field.name), getattr(careful.rapids, field.name)
        if a.dtype != b.dtype or not np.array_equal(a, b, equal_nan=a.dtype.kind == "f"):
            found.append(f"rapids.{field.name}")
    found += [f"state.{name}" for name in MODES if getattr(ends[0], name) != getattr(ends[1], name)]
    if ends[0].variables != ends[1].variables:
        found.append("state.variables")
    for name in ("position", "meant", "feed", "g5x", "g92", "tool"):
        if not np.array_equal(getattr(ends[0], name), getattr(ends[1], name), equal_nan=True):
            found.append(f"state.{name}")
    return found


def _number(draw: Draw, limit: float = 200.0) -> str:
    """Draw a number in one of the spellings that are legal."""
    places = draw(st.integers(0, 5))
    value = draw(st.floats(-limit, limit, allow_nan=False).map(lambda v: round(v, places)))
    text = f"{value:.{places}f}"
    if places and draw(st.booleans()):
        text = text.rstrip("0")
    if draw(st.integers(0, 9)) == 0:
        text = text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text
        text = text if text.startswith("-") else "+" + text
    return text if text.strip("+-.") else "0"


def _axes(draw: Draw, letters: str = "XYZ", least: int = 1) -> list[str]:
    chosen = draw(st.lists(st.sampled_from(letters), min_size=least, max_size=3, unique=True))
    return [letter + _number(draw) for letter in chosen]


def _move(draw: Draw) -> list[str]:
    """Draw a rapid or feed move, its code stated or not."""
    letters = draw(st.sampled_from(["XYZ", "XYZ", "XYZ", "XYZA", "XYZABC"]))
    words = _axes(draw, letters)
    code = draw(st.sampled_from(["", "", "", "G0", "G1", "G00", "g1", "G01"]))
    if code:
        words.insert(draw(st.integers(0, len(words))) if code == "G0" else 0, code)
    if draw(st.integers(0, 7)) == 0:
        words.append(f"F{draw(st.integers(1, 3000))}")
    return words


def _arc(draw: Draw) -> list[list[str]]:
    """Draw half circles and the way to them."""
    plane, first, second, i, j = draw(
        st.sampled_from(
            [("G17", "X", "Y", "I", "J"), ("G18", "Z", "X", "K", "I"), ("G19", "Y", "Z", "J", "K")]
        )
    )
    x, y = draw(st.integers(-50, 50)), draw(st.integers(-50, 50))
    radius = draw(st.integers(1, 40))
    code = draw(st.sampled_from(["G2", "G3"]))
    return [
        ["G90", "G91.1", plane],
        ["G0", f"{first}{x}", f"{second}{y}"],
        [code, f"{first}{x + 2 * radius}", f"{second}{y}", f"{i}{radius}", f"{j}0", "F500"],
        *([[f"{first}{x}", f"{second}{y}", f"{i}{-radius}"]] if draw(st.booleans()) else []),
        [draw(st.sampled_from(["G1", "G0"])), f"{first}{x + 1}"],
    ]


def _cycle(draw: Draw) -> list[list[str]]:
    """Draw a drilling cycle with its holes."""
    bottom = draw(st.integers(-30, -1))
    code = draw(st.sampled_from(["G81", "G82", "G83", "G73", "G85", "G89", "G84", "G88"]))
    extra = {"G82": "P0.1", "G89": "P0.1", "G83": "Q2", "G73": "Q2"}.get(code)
    extra = {"G84": "P0.1", "G88": "P0.1"}.get(code, extra)
    plane, across, along = draw(
        st.sampled_from(
            [("G17", "XY", "Z"), ("G17", "XY", "Z"), ("G18", "XZ", "Y"), ("G19", "YZ", "X")]
        )
    )
    back = draw(st.sampled_from(["G98", "G99"]))
    first = [back, code, *_axes(draw, across), f"{along}{bottom}", "R2"]
    holes = [_axes(draw, across) for _ in range(draw(st.integers(0, 4)))]
    return [
        ["S100", "M3"],
        [plane, "G90", "G0", along + str(draw(st.integers(-40, 40)))],
        [*first, *([extra] if extra else []), "F100"],
        *holes,
        *([["G80"]] if draw(st.booleans()) else []),
        ["G0", *_axes(draw)],
    ]


def _mode(draw: Draw) -> list[list[str]]:
    """Modal words between the moves."""
    kind = draw(
        st.sampled_from(
            [
                ["G90"], ["G91"], ["G20", "F10"], ["G21", "F300"], ["G54"], ["G55"], ["G61"],
                ["G64", "P0.05"], ["G64"], ["G92", "X0"], ["G92.1"], ["G43.1", "Z5"], ["G49"],
                ["G7"], ["G8"], ["M3", "S1000"], ["M5"], ["M8"], ["T1", "M6"], ["G4", "P0.01"],
                ["G28"], ["G90", "G53", "G0", "Z0"], ["G28", "Z5"], ["G52", "X1"], ["#1=5"],
                ["G10", "L20", "P1", "X0"], ["F120"], ["M0"], ["M1"], ["M70"], ["M72"], ["#5221=5"],
                ["#1=#<_feed>"], ["G91", "G92", "X1"], ["G20", "G1", "X1", "F9"], ["M4"],
            ]
        )
    )  # fmt: skip
    return [list(kind)]


def _line(draw: Draw, words: list[str], number: int | None) -> bytes:
    """Write a block as text, with whatever may stand around its words."""
    blank = draw(st.sampled_from([" ", " ", "", "  "]))
    text = blank.join(words)
    if draw(st.integers(0, 9)) == 0:
        text = text.lower()
    kind = draw(st.integers(0, 19))
    if kind == 0:
        text += " (comment)"
    elif kind == 1:
        text = f"(first) {text} ; last"
    elif kind == 2:
        text = f" {text} "
    if number is not None:
        text = f"N{number}{blank}{text}"
    if kind == 3:
        text = "/" + text
    return text.encode("latin-1")


@st.composite
def programs(draw: Draw, dialect: str = "linuxcnc") -> bytes:
    """Draw well-formed programs.

    Parameters
    ----------
    draw : callable
        Given by hypothesis.
    dialect : str, optional
        How they are written: one of those in which streams can be written.

    Returns
    -------
    bytes
        A program that ends with M2 or M30, or between two lines of ``%``.

    Examples
    --------
    >>> isinstance(programs(), st.SearchStrategy)
    True
    """
    if dialect == "klartext":
        return draw(klartext_programs())
    newline = draw(st.sampled_from([b"\n", b"\n", b"\r\n"]))
    if dialect == "linuxcnc":
        lines = _linuxcnc_lines(draw)
    elif dialect in VOCABULARIES:
        lines = _other_lines(draw, dialect)
    else:
        raise ProgramError(
            f"no programs are drawn for '{dialect}'",
            f"choose one of: linuxcnc, klartext, {', '.join(VOCABULARIES)}",
        )
    return newline.join(lines) + (newline if draw(st.booleans()) else b"")


def _linuxcnc_lines(draw: Draw) -> list[bytes]:
    """Draw the lines of a program for LinuxCNC."""
    blocks = [["G21", "G90", "G17", "G94", "F300"]] if draw(st.booleans()) else [["F300"]]
    for _ in range(draw(st.integers(1, 8))):
        kind = draw(st.integers(0, 9))
        if kind <= 4:
            moves = [_move(draw) for _ in range(draw(st.integers(1, 5)))]
            blocks.append([draw(st.sampled_from(["G0", "G1"])), *_axes(draw)])
            blocks += moves * draw(st.sampled_from([1, 1, 1, 9]))
        elif kind <= 6:
            blocks += _mode(draw)
        elif kind == 7:
            blocks += [["G94"], *_arc(draw)]
        elif kind == 8:
            blocks += _cycle(draw)
        else:
            blocks.append([])
    numbered = draw(st.booleans())
    lines = [
        _line(draw, words, 10 * (k + 1) if numbered else None) for k, words in enumerate(blocks)
    ]
    lines.append(draw(st.sampled_from([b"M2", b"M30"])))
    return [b"%", *lines, b"%"] if draw(st.booleans()) else lines


def _other_lines(draw: Draw, dialect: str) -> list[bytes]:
    """Draw the lines of a program in another dialect, with numbers and what they end with."""
    rules, words = find_dialect(dialect).text, VOCABULARIES[dialect]
    lines = draw_lines(draw, words)
    if draw(st.booleans()):
        first = 1 if lines[0].startswith("O") else 0
        numbered = [f"N{10 * k} {line}" for k, line in enumerate(lines[first:], 1)]
        if rules.delete == "first":
            numbered = [
                line if mark.startswith("/") else number
                for number, mark, line in zip(numbered, lines[first:], lines[first:], strict=True)
            ]
        lines = [*lines[:first], *numbered]
    out = [line.encode() for line in lines]
    return [b"%", *out, b"%"] if rules.percent == "lone" and draw(st.booleans()) else out
