"""The stamp at the top of an output: what made it, for which settings, and the sum of it all.

Rule: the stamp carries a sum of the whole output, itself left out, so that every later change of
it shows, however small: an F that is 1 % off at low speed moves no point and breaks no limit. Below
it stands one line for the operator: which override acts on streams.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from typing import BinaryIO

from gcodejerk._version import __version__
from gcodejerk.errors import ProgramError
from gcodejerk.machine import Machine

STAMP_LENGTH = 67
"""Of the text without its comment marks: controllers with short lines choke on longer ones."""
SUM_DIGITS = 16
SUM_MARK = b" sum:"
SUM_UNKNOWN = SUM_MARK + b"0" * SUM_DIGITS
"""The sum while it is computed: BLAKE2b, 8 bytes, over the output with these digits in it."""
SUM_WITHIN = 1 << 17
"""A stamp that stands farther from the top than this has no sum. [bytes]"""


class ProcessedError(ProgramError):
    """The program carries our stamp: it was processed before."""


_ODD = re.compile(r"[^A-Za-z0-9 #&+,./:=_-]")
"""What some control takes for more than text, in comments too: ``!`` of grbl holds the feed, and
``%`` ends a program."""
_SIGNED = re.compile(rb"gcodejerk stamp [ -~]{1,40}?" + SUM_MARK + rb"([0-9a-f]{16})")


def is_unchanged(file: BinaryIO) -> bool | None:
    """Whether a stamped program is what was written, by its sum.

    Parameters
    ----------
    file : binary file
        Seekable; read from its beginning, left at its end.

    Returns
    -------
    bool or None
        None where there is no sum to hold it to.
    """
    file.seek(0)
    head = file.read(SUM_WITHIN)
    found = _SIGNED.search(head)
    if found is None:
        return None
    digest = hashlib.blake2b(digest_size=SUM_DIGITS // 2)
    digest.update(head[: found.start(1)] + b"0" * SUM_DIGITS + head[found.end(1) :])
    while data := file.read(1 << 20):
        digest.update(data)
    return digest.hexdigest().encode() == found[1]


def stamp_text(machine: Machine, chosen: Sequence[str]) -> bytes:
    """Text of the stamp: version, a hash of the settings, room for the sum, and the machine.

    Parameters
    ----------
    machine : Machine
        What the program runs on.
    chosen : sequence of str
        The user's choices that shape the output.

    Returns
    -------
    bytes
        Without the marks of a comment.
    """
    text = " ".join((machine.settings_hash, *chosen)).encode()
    digest = hashlib.blake2b(text, digest_size=4).hexdigest()
    plain = _ODD.sub("-", machine.name)
    head = f"gcodejerk stamp {__version__} {digest}".encode() + SUM_UNKNOWN
    return (head + b" " + plain.encode())[:STAMP_LENGTH].rstrip()
