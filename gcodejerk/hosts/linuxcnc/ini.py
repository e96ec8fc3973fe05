"""A LinuxCNC INI: its lines as they are, and what stands in them.

Rule: the file is kept as bytes. Lines are put in between and taken out again, nothing else changes.
"""

from __future__ import annotations

import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path

from gcodejerk.errors import EmitError, Place

NEEDED = ("EMC", "HAL", "TRAJ", "KINS", "EMCMOT", "TASK")
"""Sections that every LinuxCNC configuration has."""
BEGIN, END = b"# gcodejerk begin", b"# gcodejerk end"
_SECTION = re.compile(rb"\s*\[(\w+)\]")
_PAIR = re.compile(rb"\s*([A-Za-z_]\w*)\s*=\s*(.*?)\s*$")
_BLOCK = re.compile(
    rb"# gcodejerk begin( unended)?\r?\n(?:(?!# gcodejerk)[^\n]*\n)*# gcodejerk end(?:\r?\n|\Z)"
)
_UNENDED = re.compile(
    rb"\r?\n# gcodejerk begin unended\r?\n(?:(?!# gcodejerk)[^\n]*\n)*# gcodejerk end\Z"
)


@dataclass(frozen=True, slots=True)
class Entry:
    """One line `KEY = VALUE`."""

    section: str
    key: str
    value: str
    line: int
    """Counted from 1."""


@dataclass(frozen=True, slots=True)
class Ini:
    """An INI file."""

    path: Path
    data: bytes
    entries: tuple[Entry, ...]
    sections: tuple[tuple[str, int], ...]
    """Each with its line."""

    @property
    def folder(self) -> Path:
        """Where it stands; relative names in it begin here."""
        return self.path.parent

    def place(self, line: int | None = None) -> Place:
        """A place in it."""
        return Place(str(self.path), line)

    def all(self, section: str, key: str) -> list[Entry]:
        """Every line of a key, in their order."""
        return [e for e in self.entries if e.section == section and e.key == key]

    def value(self, section: str, key: str) -> str | None:
        """The first value of a key."""
        found = self.all(section, key)
        return found[0].value if found else None

    def with_lines(self, line: int, text: str) -> bytes:
        """Its bytes with marked lines put behind a line (counted from 1)."""
        lines = self.data.splitlines(keepends=True)
        before = lines[line - 1]
        newline = b"\r\n" if before.endswith(b"\r\n") else b"\n"
        body = newline.join(part.encode() for part in text.splitlines())
        if before.endswith(b"\n"):
            block = newline.join([BEGIN, body, END]) + newline
        else:
            block = newline + newline.join([BEGIN + b" unended", body, END])
        return b"".join([*lines[:line], block, *lines[line:]])


def read_ini(path: str) -> Ini:
    """Read an INI.

    Raises
    ------
    EmitError
        It is none, or cannot be read.
    """
    return parse_ini(Path(path), read_bytes(path))


def read_bytes(path: str) -> bytes:
    """The bytes of an INI."""
    try:
        return Path(path).read_bytes()
    except (OSError, ValueError) as error:
        raise EmitError(
            f"{path} cannot be read: {getattr(error, 'strerror', None) or error}",
            "name the .ini file of a configuration",
        ) from error


def parse_ini(path: Path, data: bytes) -> Ini:
    """The same from its bytes."""
    entries, sections, section = [], [], ""
    for number, line in enumerate(data.splitlines(), 1):
        if line.lstrip().startswith((b"#", b";")):
            continue
        if match := _SECTION.match(line):
            section = match[1].decode()
            sections.append((section, number))
        elif match := _PAIR.match(line):
            value = match[2].decode("utf-8", "replace")
            entries.append(Entry(section, match[1].decode(), value, number))
    names = {name for name, _ in sections}
    missing = [name for name in NEEDED if name not in names]
    if missing:
        raise EmitError(
            f"this is no LinuxCNC configuration: it has no section [{missing[0]}]",
            "name the .ini file that LinuxCNC is started with",
            Place(str(path)),
        )
    return Ini(path, data, tuple(entries), tuple(sections))


def check_motion(ini: Ini) -> None:
    """Refuse another motion module than motmod, and arguments that stand in the INI."""
    found = ini.all("EMCMOT", "EMCMOT")
    words = found[0].value.split() if found else []
    if words == ["motmod"]:
        return
    place = ini.place(found[0].line if found else None)
    if words[:1] == ["motmod"]:
        raise EmitError(
            f"[EMCMOT] EMCMOT gives motmod arguments: {' '.join(words[1:])}",
            "give them behind `loadrt [EMCMOT]EMCMOT` in the HAL file, where they are read",
            place,
        )
    named = words[0] if words else "missing"
    raise EmitError(f"[EMCMOT] EMCMOT is {named}, not motmod", "only motmod was played", place)


def without_lines(data: bytes) -> bytes:
    """The bytes of an INI without marked lines.

    Raises
    ------
    EmitError
        The marks are not in pairs, or do not hold what was written.
    """
    out = _BLOCK.sub(b"", _UNENDED.sub(b"", data))
    if BEGIN in out or END in out:
        line = out[: max(out.find(BEGIN), out.find(END))].count(b"\n") + 1
        raise EmitError(
            f"the marks '{BEGIN.decode()}' and '{END.decode()}' are not in pairs, near line {line}",
            "take out the lines between them by hand, or take back the backup",
        )
    return out


def marked(data: bytes) -> list[str]:
    """What stands between marks, each block without them."""
    return [
        "\n".join(m[0].decode("utf-8", "replace").splitlines()[1:-1]) for m in _BLOCK.finditer(data)
    ]


def is_writable(path: Path) -> bool:
    """Whether a file or folder may be written to; one without any such permission is not."""
    try:
        mode = stat.S_IMODE(path.stat().st_mode)
    except OSError:
        return False
    return bool(mode & 0o222) and os.access(path, os.W_OK)
