"""Which streams a control could not read, or would read otherwise: too long, too many digits.

And programs that read how many lines stand in front of one, which streams change.

The last point of a stream repeats the words of its rapid's block, and the block's other words stand
in a line of their own; so it is the block that decides, and a rapid whose lines would not fit is
left alone before anything is planned.

Rule: lengths are those of the longest spelling that could be needed, so nothing is ever cut.
"""

from __future__ import annotations

import re
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import axis_steps
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Program, Rapids, parse_block
from gcodejerk.nc.text.chunks import read_chunks
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.storage import windows
from gcodejerk.units import MM_PER_INCH

_OF_CONTROL = re.compile(rb"#[ \t]*<[ \t]*_[^<>\n]*>")
"""Variables whose names begin as those of the control do."""
_COMMENT = re.compile(rb"\([^()\n]*(?:\)|$)|;[^\n]*")
AROUND = len(b"G1 G61.1  F") + 15
"""Of the last point, besides the block's own words."""
REWRITTEN = 18
"""An axis word that is not the block's own: a letter, a sign, digits and a point, a blank."""


def line_limit(dialect: Dialect) -> int:
    """Longest line that is written, in bytes."""
    own = 0 if dialect.writing is None else dialect.writing.line_limit
    return own or dialect.text.line_limit


def reasons_to_leave(
    program: Program, source: BinaryIO, machine: Machine, dialect: Dialect
) -> NDArray[np.uint8]:
    """Reasons of a program's rapids, those added whose streams would not fit.

    Parameters
    ----------
    program : Program
        As it was read.
    source : binary file
        Its bytes.
    machine : Machine
        Whose resolutions the points are written with.
    dialect : Dialect
        Of the streams.

    Returns
    -------
    ndarray of uint8, shape (n,)
        CERTAIN, or an index in `REASONS`.
    """
    rapids = program.rapids
    reason = rapids.reason.copy()
    certain = reason == CERTAIN
    for part in windows(len(rapids)):
        too_wide = _digits(rapids.part(part), machine, dialect)
        reason[part][certain[part] & too_wide] = REASONS.index(Reason.LINE_LIMIT)
    # An axis that counts its turns reads each point as it reads the rapid's own word: a point that
    # is rounded back behind the one before it would send the axis all the way round.
    reason[certain & (rapids.turned != 0)] = REASONS.index(Reason.ROTARY_WAY)
    limit = line_limit(dialect)
    size = rapids.end - rapids.begin
    # Every word of the block may be an axis word that grows; few blocks come near the limit.
    near = certain & (size + AROUND + REWRITTEN * len(AXES) > limit)
    for i in np.flatnonzero(near).tolist():
        source.seek(int(rapids.begin[i]))
        block = source.read(int(size[i]))
        if max(_lengths(block, dialect)) > limit:
            reason[i] = REASONS.index(Reason.LINE_LIMIT)
    if reads_own_lines(source, dialect):
        reason[reason == CERTAIN] = REASONS.index(Reason.LINES_READ)
    return reason


def reads_own_lines(source: BinaryIO, dialect: Dialect) -> bool:
    """Whether a program reads the number of a line, which every line in front of it changes."""
    name = dialect.arithmetic.own_line.upper().encode()
    if not name:
        return False
    source.seek(0)
    for chunk in read_chunks(source, ""):
        for found in _OF_CONTROL.finditer(chunk.data):
            if found[0].translate(None, b" \t").upper() != name:
                continue
            line = chunk.data.rfind(b"\n", 0, found.start()) + 1
            if _COMMENT.sub(b"", chunk.data[line : found.end()]).endswith(found[0]):
                return True
    return False


def _lengths(block: bytes, dialect: Dialect) -> tuple[int, int]:
    """Length of the line with the block's other words, and of the last point, at most."""
    words = parse_block(block, dialect).words
    scaled = dialect.whole_numbers == "machine"
    point = AROUND
    axes = 0
    for word in words:
        if word.letter in AXES or word.letter in dialect.increments:
            own = word.end - word.begin
            axes += own
            computed = word.value is None or word.function != ""
            grows = word.letter in dialect.increments or scaled or computed
            # Of an increment, the last word holds what is left, with the decimals of a step too.
            point += max(own + 8, REWRITTEN if grows else 0) + 1
    return len(block.rstrip()) - axes, point


def _digits(rapids: Rapids, machine: Machine, dialect: Dialect) -> NDArray[np.bool_]:
    """Rapids with a point that has more digits than the control reads."""
    writing = dialect.writing
    out = np.zeros(len(rapids), dtype=np.bool_)
    if writing is None:
        return out
    for axis in machine.axes:
        k = AXES.index(axis.name)
        for inch in (False, True):
            decimals = int(axis_steps(machine, inch, writing.doubles)[1][k])
            unit = MM_PER_INCH if inch and not axis.rotary else 1.0
            farthest = np.fmax(np.abs(rapids.start[:, k]), np.abs(rapids.target[:, k])) / unit
            farthest = np.where(rapids.diameter & (axis.name == "X"), 2.0 * farthest, farthest)
            whole = np.floor(np.log10(np.fmax(np.nan_to_num(farthest), 1.0)) + 1e-12) + 1.0
            named = (rapids.words >> k & 1) != 0
            out |= named & (rapids.inch == inch) & (whole + max(decimals, 1) > writing.digits)
    return out
