"""The feed moves of a program as a line to be drawn: where the tool goes between the rapids.

Rule: this is a picture. Of what is not known nothing is drawn; an arc whose centre does not fit is
its chord.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator
from typing import BinaryIO

from gcodejerk.nc.dialects import find_dialect
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.program import trace
from gcodejerk.nc.text.tokenizer import parse_line
from gcodejerk.start import NOTHING_KNOWN, Start
from gcodejerk.units import MM_PER_INCH

STRAIGHT, CLOCKWISE, COUNTER_CLOCKWISE = 10, 20, 30
STEP = math.radians(10.0)
"""Of an arc, from one point to the next."""
_PLANES = ((0, 1, "I", "J"), (2, 0, "K", "I"), (1, 2, "J", "K"))
"""Two axes and the words of the centre along them: G17, G18, G19."""
_SELECTED = re.compile(rb"G1([789])(?![0-9.])", re.IGNORECASE)
Point = tuple[float, ...]


def feed_moves(
    file: BinaryIO, *, dialect: str, start: Start = NOTHING_KNOWN
) -> Iterator[tuple[Point, tuple[Point, ...]]]:
    r"""Follow a program, and give its feed moves.

    Parameters
    ----------
    file : binary file
        The program, from where it stands; all of it is held in memory.
    dialect : str
        How it is written.
    start : Start, optional
        What may be assumed when it starts.

    Yields
    ------
    begin : tuple of float
        X, Y and Z in program coordinates; NaN where unknown. [mm]
    points : tuple of tuple of float
        Where the move leads: its end, or the points along an arc, of which the end is the last.

    Examples
    --------
    >>> program = io.BytesIO(b"G21 G90 G0 X0 Y0 Z0\nG1 X5 F100\nG2 X5 Y-2 J-1\nM2\n")
    >>> moves = list(feed_moves(program, dialect="linuxcnc"))
    >>> moves[0]
    ((0.0, 0.0, 0.0), ((5.0, 0.0, 0.0),))
    >>> len(moves[1][1]), moves[1][1][-1]
    (18, (5.0, -2.0, 0.0))
    """
    data = file.read()
    language = find_dialect(dialect)
    texts = io.BytesIO(data)
    before: Point = (math.nan, math.nan, math.nan)
    plane = 0
    for _, positions, motion in trace(io.BytesIO(data), dialect=language, start=start):
        text = texts.readline()
        for digit in _SELECTED.findall(text):
            plane = int(digit) - 7
        after = positions[:3]
        arc = motion in (CLOCKWISE, COUNTER_CLOCKWISE)
        moves = motion == STRAIGHT and any(a != b for a, b in zip(before, after, strict=True))
        if arc:
            points = _arc(before, after, text, language, plane, motion == CLOCKWISE)
            if points:
                yield before, points
        elif moves and not all(map(math.isnan, after)):
            yield before, (after,)
        before = after


def _arc(
    begin: Point, end: Point, text: bytes, dialect: Dialect, plane: int, clockwise: bool
) -> tuple[Point, ...]:
    """Points of an arc; its end alone where its centre is not understood, none where it is none."""
    words = {
        word.letter: word.value
        for word in parse_line(text.rstrip(b"\r\n"), dialect).words
        if word.letter in "XYZIJKR" and word.value is not None
    }
    if not words:
        return ()
    chord = (end,) if begin != end else ()
    a, b, i, j = _PLANES[plane]
    if any(map(math.isnan, (begin[a], begin[b], end[a], end[b]))):
        return chord
    if i not in words and j not in words and "R" not in words:
        return chord
    centre = _centre((begin[a], begin[b]), (end[a], end[b]), words, (i, j), clockwise)
    return chord if centre is None else _points(begin, end, (a, b), centre, clockwise)


def _centre(
    p: tuple[float, float],
    q: tuple[float, float],
    words: dict[str, float],
    names: tuple[str, str],
    clockwise: bool,
) -> tuple[float, float] | None:
    """The centre that is as far from both ends, read as mm or inches, relative or absolute."""
    for unit in (1.0, MM_PER_INCH):
        if "R" in words:
            found = _of_radius(p, q, words["R"] * unit, clockwise)
            if found is not None:
                return found
            continue
        u, v = (words.get(name, 0.0) * unit for name in names)
        for x, y in ((p[0] + u, p[1] + v), (u, v)):
            r, other = math.dist(p, (x, y)), math.dist(q, (x, y))
            if r > 0.0 and abs(r - other) < 2e-3 * r + 5e-3:
                return x, y
    return None


def _of_radius(
    p: tuple[float, float], q: tuple[float, float], radius: float, clockwise: bool
) -> tuple[float, float] | None:
    """The centre of an arc of a radius; below zero: the longer arc."""
    d = math.dist(p, q)
    if d == 0.0 or d > 2.0 * abs(radius) * (1.0 + 1e-3):
        return None
    height = math.sqrt(max(radius**2 - 0.25 * d**2, 0.0))
    side = -height if (radius < 0.0) == clockwise else height
    x, y = 0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])
    return x + side * (q[1] - p[1]) / d, y - side * (q[0] - p[0]) / d


def _points(
    begin: Point, end: Point, plane: tuple[int, int], centre: tuple[float, float], clockwise: bool
) -> tuple[Point, ...]:
    """Points along an arc, straight in the third axis."""
    a, b = plane
    first = math.atan2(begin[b] - centre[1], begin[a] - centre[0])
    last = math.atan2(end[b] - centre[1], end[a] - centre[0])
    turn = (first - last if clockwise else last - first) % (2.0 * math.pi)
    turn = turn if turn > 1e-9 else 2.0 * math.pi
    radius = math.dist((begin[a], begin[b]), centre)
    count = max(math.ceil(turn / STEP - 1e-9), 1)
    out = []
    for k in range(1, count):
        angle = first + (-turn if clockwise else turn) * k / count
        point = [x + (y - x) * k / count for x, y in zip(begin, end, strict=True)]
        point[a] = centre[0] + radius * math.cos(angle)
        point[b] = centre[1] + radius * math.sin(angle)
        out.append(tuple(point))
    return (*out, end)
