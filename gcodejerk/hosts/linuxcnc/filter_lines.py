"""The lines of [FILTER] in a LinuxCNC INI: put in, and taken out again.

Rule 1: LinuxCNC reads the first section of a name and the first line of a key, and lines `#INCLUDE`
stand for the files that they name. So the lines go to the end of the first [FILTER] there is, where
that is in the INI itself or ends with an included file; nothing is written into included files.

Rule 2: a key is the ending of a file's name, compared letter by letter; what is filtered already by
something else is never taken away.
"""

from __future__ import annotations

import os
import re
import shlex
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from gcodejerk.errors import EmitError, Place
from gcodejerk.hosts.command import for_shell, one_line
from gcodejerk.hosts.linuxcnc.backups import FILTER, backup_of, drop_backups, keep, write
from gcodejerk.hosts.linuxcnc.ini import is_writable, parse_ini, read_bytes, without_lines

FORM = "filter"
ENDINGS = ("ngc", "nc", "tap", "NGC", "NC", "TAP")
LONGEST = 250
"""LinuxCNC 2.9 reads 255 characters of a line; longer ones are cut there."""
BEGIN, END = b"# gcodejerk filter begin", b"# gcodejerk filter end"
_INCLUDE = re.compile(rb"\s*#INCLUDE[ \t]+(\S.*?)\s*$")
_BLOCK = re.compile(
    rb"# gcodejerk filter begin\r?\n((?:(?!# gcodejerk)[^\n]*\n)*)"
    rb"# gcodejerk filter end(?:\r?\n|\Z)"
)
_UNENDED = re.compile(
    rb"\r?\n# gcodejerk filter begin unended\r?\n((?:(?!# gcodejerk)[^\n]*\n)*)"
    rb"# gcodejerk filter end\Z"
)
_OWN_LINE = re.compile(
    rb"\[FILTER\]|PROGRAM_EXTENSION = .*|(?i:ngc|nc|tap) = .* filter --machine .*"
)
_SPOKEN = ".ngc,.nc,.tap G-code (rapids by gcodejerk)"


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the INI with its included files in their places, as LinuxCNC makes it."""

    text: bytes
    file: Path
    number: int
    """In that file."""
    main: int
    """Line of the INI itself that it comes from."""

    @property
    def place(self) -> Place:
        """Where it stands."""
        return Place(str(self.file), self.number)


def install_filter(path: str, command: tuple[str, ...], machine: str) -> list[str]:
    """Have the screens open programs through `gcodejerk filter`.

    Parameters
    ----------
    path : str
        The INI.
    command : tuple of str
        The words that start gcodejerk.
    machine : str
        What stands behind --machine.

    Returns
    -------
    list of str
        What was done, for the user.

    Raises
    ------
    EmitError
        The configuration does not fit; nothing was changed.
    """
    file, data = Path(path), read_bytes(path)
    clean = _without_filter(file, data)
    changed = _with_lines(file, clean, _value(command, machine))
    if changed == data:
        return [f"{path}: the filter is installed already; nothing was changed"]
    if clean != data:
        raise EmitError(
            "another filter of gcodejerk is installed, or the configuration was changed since",
            f"run `{_way_back(path)}`, then install again",
            Place(path),
        )
    _check_writable(file)
    backup = backup_of(file, FILTER, data, partial(without_all, file))
    keep(backup, data)
    write(file, changed)
    return [
        f"{path}: lines of [FILTER] added; it was kept as {backup.name}",
        f"start LinuxCNC anew; programs that end in {', '.join('.' + e for e in ENDINGS)} are then "
        "processed when they are opened, the files themselves stay as they are",
        f"`{_way_back(path)}` takes it out again",
    ]


def _way_back(path: str) -> str:
    return shlex.join(["gcodejerk", "install", "linuxcnc", path, "--form", "filter", "--remove"])


def remove_filter(path: str) -> list[str]:
    """Take the lines out.

    Returns
    -------
    list of str
        What was done.
    """
    file, data = Path(path), read_bytes(path)
    clean = _without_filter(file, data)
    if clean == data:
        return [f"{path}: no filter of gcodejerk is installed"]
    _check_writable(file)
    write(file, clean)
    done = [f"{path}: the lines of [FILTER] were taken out"]
    return done + drop_backups(file, clean, FILTER, partial(without_all, file))


def _value(command: tuple[str, ...], machine: str) -> str:
    """What stands behind each ending."""
    words = [one_line(word, "the path") for word in (*command, "filter", "--machine", machine)]
    value = for_shell(words)
    longest = max(len(f"{ending} = {value}".encode()) for ending in ENDINGS)
    if longest > LONGEST:
        raise EmitError(
            f"the line would have {longest} bytes, and LinuxCNC reads {LONGEST} safely: {value}",
            "put the machine file, or a link to gcodejerk, into a folder with a shorter path",
        )
    if "\\" in value:
        raise EmitError(
            f"LinuxCNC takes backslashes out of its INI, and there are some in {value}",
            "rename that file or folder",
        )
    return value


def _expanded(file: Path, data: bytes) -> list[Line]:
    """The INI as LinuxCNC sees it."""
    lines = []
    for number, text in enumerate(data.splitlines(), 1):
        lines.append(Line(text, file, number, number))
        found = _INCLUDE.match(text)
        if found is None:
            continue
        name = os.path.expandvars(os.path.expanduser(found[1].decode("utf-8", "replace")))
        included = file.parent / name
        try:
            inside = included.read_bytes().splitlines()
        except (OSError, ValueError) as error:
            raise EmitError(
                f"the file {name} that is included here cannot be read: "
                f"{getattr(error, 'strerror', None) or error}",
                "correct the #INCLUDE",
                Place(str(file), number),
            ) from None
        lines += [Line(line, included, k, number) for k, line in enumerate(inside, 1)]
    return lines


def _with_lines(file: Path, data: bytes, value: str) -> bytes:
    """The INI's bytes with our lines in them; refused where something else filters programs."""
    lines = _expanded(file, data)
    ini = parse_ini(file, b"\n".join(line.text for line in lines))
    entries = [f"PROGRAM_EXTENSION = {_SPOKEN}", *(f"{ending} = {value}" for ending in ENDINGS)]
    found = [k for k, (name, _) in enumerate(ini.sections) if name == "FILTER"]
    if not found:
        return _put(data, len(data.splitlines()), ["[FILTER]", *entries])
    # Lines of the section are begin:end, its head the first of them.
    begin = ini.sections[found[0]][1] - 1
    heads = (k for k in range(begin + 1, len(lines)) if lines[k].text.lstrip().startswith(b"["))
    end = next(heads, len(lines))
    for entry in ini.entries:
        if entry.section == "FILTER" and entry.key in ENDINGS and begin < entry.line <= end:
            raise EmitError(
                f"programs that end in .{entry.key} are filtered already: {entry.value}",
                "take that line out, or call `gcodejerk filter --machine M FILE` from that filter",
                lines[entry.line - 1].place,
            )
    # What is put behind a line of the INI stands behind all that the line includes.
    possible = [
        k for k in range(begin, end) if k + 1 == len(lines) or lines[k + 1].main != lines[k].main
    ]
    if not possible:
        raise EmitError(
            f"[FILTER] stands in the included file {lines[begin].file.name}, and another section "
            "follows in it; included files are not written to, others may share them",
            "make [FILTER] the last section of that file, or add to it:\n    "
            + "\n    ".join(entries),
            lines[begin].place,
        )
    good = [k for k in possible if lines[k].file != file or _says(lines[k].text)]
    return _put(data, lines[(good or possible)[-1]].main, entries)


def _says(text: bytes) -> bool:
    """Whether a line is more than a comment or blank."""
    return text.strip() != b"" and not text.lstrip().startswith((b"#", b";"))


def _put(data: bytes, line: int, entries: list[str]) -> bytes:
    """The bytes with marked lines behind a line, counted from 1."""
    lines = data.splitlines(keepends=True)
    before = lines[line - 1]
    newline = b"\r\n" if before.endswith(b"\r\n") else b"\n"
    body = newline.join(entry.encode() for entry in entries)
    if before.endswith(b"\n"):
        block = newline.join([BEGIN, body, END]) + newline
    else:
        block = newline + newline.join([BEGIN + b" unended", body, END])
    return b"".join([*lines[:line], block, *lines[line:]])


def without_all(file: Path, data: bytes) -> bytes:
    """The bytes without lines of gcodejerk of either kind."""
    return _without_filter(file, without_lines(data))


def _without_filter(file: Path, data: bytes) -> bytes:
    """The bytes without our lines; refused where somebody has edited them."""
    for block in (*_BLOCK.finditer(data), *_UNENDED.finditer(data)):
        for text in block[1].splitlines():
            if not _OWN_LINE.fullmatch(text.strip()):
                raise EmitError(
                    f"a line between the marks of gcodejerk was edited: {text.decode('latin-1')}",
                    f"put it back as it was, or take the lines out by hand (backup: *{FILTER})",
                    Place(str(file), data[: data.find(text, block.start())].count(b"\n") + 1),
                )
    out = _BLOCK.sub(b"", _UNENDED.sub(b"", data))
    if BEGIN in out or END in out:
        line = out[: max(out.find(BEGIN), out.find(END))].count(b"\n") + 1
        raise EmitError(
            f"the marks {BEGIN.decode()!r} and {END.decode()!r} are not in pairs, near line {line}",
            "take out the lines between them by hand, or take back the backup",
            Place(str(file), line),
        )
    return out


def _check_writable(file: Path) -> None:
    """Refuse an INI that cannot be written to, before anything is."""
    for place in (file, file.parent):
        if not is_writable(place):
            raise EmitError(
                f"{place} cannot be written to",
                "copy the configuration to a folder of yours, and name the .ini file there",
            )
