"""Streams behind a guard: the original block runs wherever an override would change the stream.

HAL tells by an analog input whether the overrides of feed and rapids stand at 100 %. In front of
each stream LinuxCNC reads that input, and an O-word chooses. Between the block's other words and
what runs behind the motion then stands ::

    M66 E3 L0                          waits for all motions, then reads the input into #5399
    o<gcodejerk-12> if [#5399 GT 0.5]  12: the line of the block
    G0 X0.0000003                      the stream, with all that leads into it
    ...
    o<gcodejerk-12> else
    G0 X10. Y5.                        the block's own axis words
    o<gcodejerk-12> endif

Rule: the guard takes #5399 and names of its own, so a program that may use them is refused. Within
O-word structures of the program rapids are left alone.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import EmitError, Place
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Program

INPUT = 3
"""Number of `motion.analog-in`: the last of the four that motmod has unless told otherwise."""
_COMMENT = re.compile(rb"\(([^)]*)\)|;(.*)")
_ACTIVE = re.compile(rb"(?:ABORT|DEBUG|PRINT|LOG|PY)", re.IGNORECASE)
"""Comments that compute, or may."""
_O_WORD = re.compile(rb"(?:/[0-9]?)?(?:N[0-9.]+)?O(<[^>]*>|[0-9]+|)(.*)")
_NAME = re.compile(rb"<[^>]*>")
_NUMBER = re.compile(rb"([MEP#])\+?([0-9]+\.?[0-9]*|\.[0-9]+)")
ANSWER = (
    (re.compile(rb"#5399(?![0-9])"), "#5399 is used"),
    (re.compile(rb"#[^0-9<]"), "a parameter is used whose number is computed, #5399 perhaps"),
    (re.compile(rb"M66(?![0-9])"), "M66 is used, whose answer is #5399"),
    (re.compile(rb"M[\[#]"), "an M code is computed, M66 perhaps"),
    (re.compile(rb"M97(?![0-9])"), "M97 calls a subprogram, which may use #5399"),
    (re.compile(rb"M98(?![0-9])"), "M98 calls a subprogram, which may use #5399"),
    (re.compile(rb"M99(?![0-9])"), "M99 leads back to a caller, which may use #5399"),
)
"""Where a program uses #5399, or may: M66 of ours overwrites it."""
INSTEAD = {ANSWER[-1]: "end the program with M2 or M30 if no other one calls it, or "}
"""What else helps, in front of the usual remedy."""


def guarded(line: int, stream: Sequence[bytes], own: bytes) -> list[bytes]:
    """The lines of a stream and of the original block, and the branch around them.

    Parameters
    ----------
    line : int
        Of the block, in the original.
    stream : sequence of bytes
        Lines of the stream, modal words included.
    own : bytes
        The block's own motion.

    Returns
    -------
    list of bytes
    """
    name = b"o<gcodejerk-%d>" % line
    return [
        b"M66 E%d L0" % INPUT,
        name + b" if [#5399 GT 0.5]",
        *stream,
        name + b" else",
        own,
        name + b" endif",
    ]


def in_structures(
    program: Program, source: BinaryIO, machine: Machine, dialect: Dialect
) -> NDArray[np.bool_]:
    """Rapids that no guard may stand around.

    Parameters
    ----------
    program : Program
        As it was read.
    source : binary file
        Its bytes.
    machine : Machine
        With or without a guard.
    dialect : Dialect
        Of the program.

    Returns
    -------
    ndarray of bool, shape (n,)
        Those within a structure of O-words; none where there is no guard.

    Raises
    ------
    EmitError
        The program is in another dialect, or may use what the guard does.
    """
    line = program.rapids.line
    inside = np.zeros(len(line), dtype=np.bool_)
    if not machine.controller_options.override_guard:
        return inside
    if dialect.name != "linuxcnc":
        raise EmitError(
            "controller_options.override_guard writes LinuxCNC's words (M66, O-words), but the "
            f"program is read as {dialect.name}",
            "say --dialect linuxcnc, or take override_guard out of the machine file",
        )
    for first, last in _structures(source, program.name):
        inside |= (line >= first) & (line <= last)
    return inside


def lines_of_code(source: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Each line's number, and what the control reads of it: no blanks, capitals only."""
    source.seek(0)
    for number, text in enumerate(source, 1):
        yield number, b"".join(_COMMENT.sub(_active, text).split()).upper()


def plain_numbers(code: bytes) -> bytes:
    """Codes and numbers of outputs, inputs and parameters as LinuxCNC takes them; names left out.

    All are rounded to the nearest integer: ``M67.00001 E2.6`` is M67 E3.
    """
    return _NUMBER.sub(lambda n: n[1] + b"%d" % int(float(n[2]) + 0.5), _NAME.sub(b"<>", code))


def _structures(source: BinaryIO, name: str) -> Iterator[tuple[int, float]]:
    """First and last line of each label's structures."""
    first: dict[bytes, int] = {}
    last: dict[bytes, float] = {}
    calls: dict[bytes, int] = {}
    for number, code in lines_of_code(source):
        match = _O_WORD.match(code)
        if match is not None:
            label = match[1]
            if not label or label.startswith(b"<GCODEJERK-"):
                what = "has a computed label" if not label else "has a name of the guard's"
                raise _refused(f"an O-word {what}", name, number)
            label = label if label.startswith(b"<") else b"%d" % int(label)
            if match[2].startswith(b"CALL"):
                calls.setdefault(label, number)
                first.setdefault(label, number)
            # What stands alone has no end that we know.
            last[label] = number if label in first else np.inf
            first.setdefault(label, number)
        plain = plain_numbers(code)
        for pattern, problem in ANSWER:
            if pattern.search(plain):
                raise _refused(problem, name, number, INSTEAD.get((pattern, problem), ""))
    for label, number in calls.items():
        if last[label] <= number and first[label] >= number:
            raise _refused("a subprogram of another file is called", name, number)
    for label, begun in first.items():
        yield begun, last[label]


def _active(comment: re.Match[bytes]) -> bytes:
    """What a comment may compute; nothing for one that is only read by people."""
    text = (comment[1] if comment[1] is not None else comment[2]).strip()
    return b" " + text if _ACTIVE.match(text) else b""


def _refused(problem: str, name: str, line: int, instead: str = "") -> EmitError:
    return EmitError(
        f"{problem}: no override guard can stand in this program",
        f"{instead}process it with a machine file without controller_options.override_guard",
        Place(name, line),
    )
