"""What the stamp of a processed program says of the options that it was made with.

A stamp carries a hash of the machine file's settings and of the user's choices, not the choices
themselves: there is no room. There are few enough of them to try: the choice that gives the hash
is the one that was made, and the machine file is the one that was used.

Rule: an option that the user repeats is taken as the user says; the stamp only fills in.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import entry_points
from itertools import product
from typing import BinaryIO

from gcodejerk.machine import Machine
from gcodejerk.machine.file.table import PROFILES
from gcodejerk.nc import DIALECTS

WITHIN = 1 << 17
"""A stamp that stands farther from the top is not looked for. [bytes]"""
FORM = "stream"
PARAMETERS = "parameters"
"""The form in which a program sets its control."""
FORMS = {"linuxcnc-hal": ("adaptive-feed", "position")}
"""Of controllers that have others than FORM."""
EXPANDED = "expand-cycles"
UNROLLED = "unroll"
_STAMP = re.compile(rb"^[(;] ?gcodejerk stamp [ -~]{1,20}? ([0-9a-f]{8})(?![0-9a-f])", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Stamp:
    """Choices that a processed program was made with."""

    hash: str
    """As the stamp has it."""
    known: bool = False
    """This machine file and these choices give that hash."""
    controller: str = ""
    profile: str | None = None
    dialect: str | None = None
    """None: that of the machine file."""
    expand_cycles: bool = False
    unroll: bool = False


def choices_hash(
    settings_hash: str,
    controller: str,
    profile: str,
    expand_cycles: bool,
    dialect: str | None,
    form: str = FORM,
    rapid_feed: str = "",
    *,
    unroll: bool = False,
) -> str:
    """Eight hex digits of the hash of a machine file's settings and a user's choices."""
    chosen = [controller, form, profile, *([EXPANDED] if expand_cycles else [])]
    chosen += [UNROLLED] if unroll else []
    chosen += [rapid_feed] if rapid_feed else []
    chosen += [] if dialect is None else [f"dialect {dialect}"]
    text = " ".join((settings_hash, *chosen)).encode()
    return hashlib.blake2b(text, digest_size=4).hexdigest()


@cache
def _controllers() -> tuple[str, ...]:
    """Names of all that are installed: the same as long as a process lives."""
    return tuple(entry.name for entry in entry_points(group="gcodejerk.controllers"))


def read_stamp(processed: BinaryIO, machine: Machine) -> Stamp | None:
    """Read the stamp of a processed program.

    Parameters
    ----------
    processed : BinaryIO
        Seekable; left where it was.
    machine : Machine
        What it was processed for, as its file has it.

    Returns
    -------
    Stamp or None
        None where there is no stamp.
    """
    at = processed.tell()
    match = _STAMP.search(processed.read(WITHIN))
    processed.seek(at)
    if match is None:
        return None
    found = match[1].decode()
    fed = "" if machine.rapid_feed is None else machine.rapid_feed.text
    names = dict.fromkeys((machine.controller, *_controllers()))
    profiles = dict.fromkeys((machine.design.profile, *PROFILES))
    chosen = _chosen(found, machine.settings_hash, tuple(names), tuple(profiles), fed)
    return Stamp(found, True, *chosen) if chosen else Stamp(found)


@lru_cache(maxsize=256)
def _chosen(
    stamped: str,
    settings_hash: str,
    names: tuple[str, ...],
    profiles: tuple[str, ...],
    rapid_feed: str,
) -> tuple[str, str, str | None, bool, bool] | None:
    """Controller, profile, dialect and what is written out that give a hash, of all that is there.

    The machine file's own come first: most stamps are found at once.
    """
    for unroll, dialect, expand, name, profile in product(
        (False, True), (None, *DIALECTS, "auto"), (False, True), names, profiles
    ):
        for form in (*FORMS.get(name, (FORM,)), PARAMETERS):
            if stamped == choices_hash(
                settings_hash, name, profile, expand, dialect, form, rapid_feed, unroll=unroll
            ):
                return name, profile, dialect, expand, unroll
    return None
