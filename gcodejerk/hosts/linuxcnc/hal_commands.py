"""The HAL files of a configuration: what they load, link and run, without running them.

Rule: what cannot be known without running it (Tcl, variables that are not the INI's) is refused
where it matters, never guessed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from gcodejerk.errors import EmitError, Place
from gcodejerk.hosts.linuxcnc.ini import Ini

LIBRARY = Path("/usr/share/linuxcnc/hallib")
_FROM_INI = re.compile(r"\[(\w+)\]\(?(\w+)\)?")


@dataclass(slots=True)
class Hal:
    """What the HAL files of a configuration say, in the order in which they run."""

    loaded: dict[str, Place] = field(default_factory=dict)
    """Realtime components."""
    arguments: dict[str, str] = field(default_factory=dict)
    """What each was loaded with."""
    signal: dict[str, tuple[str, Place]] = field(default_factory=dict)
    """Pin -> the signal that it is linked to."""
    functions: dict[str, list[str]] = field(default_factory=dict)
    """Thread -> its functions, in their order."""
    unclear: Place | None = None
    """Functions were put in places that depend on others."""


def read_hal(ini: Ini, own: str) -> Hal:
    """Read the HAL files that an INI names, but for one of its own name.

    Raises
    ------
    EmitError
        A file is missing, or is a Tcl script.
    """
    hal = Hal()
    files = ini.all("HAL", "HALFILE")
    if not files:
        raise EmitError("there is no HALFILE in [HAL]", "see LinuxCNC's manual", ini.place())
    for entry in files:
        name = entry.value.split()[0] if entry.value else ""
        if name == own:
            continue
        place = ini.place(entry.line)
        path = _file(ini, name)
        if path.suffix == ".tcl":
            raise EmitError(
                f"HALFILE {name} is a Tcl script, which cannot be read without running it",
                "load what gcodejerk installs by hand: see docs/linuxcnc-hal.md",
                place,
            )
        if not path.is_file():
            raise EmitError(f"HALFILE {name} does not exist", "correct the name", place)
        _run(hal, _commands(path), ini)
    for entry in ini.all("HAL", "POSTGUI_HALFILE"):
        path = _file(ini, entry.value)
        if path.is_file() and path.suffix != ".tcl":
            _run(hal, _commands(path), ini)
    for entry in ini.all("HAL", "HALCMD"):
        _run(hal, iter([(entry.value.split(), ini.place(entry.line))]), ini)
    return hal


def _file(ini: Ini, name: str) -> Path:
    """Where a HAL file is."""
    if name.startswith("LIB:"):
        return LIBRARY / name[4:]
    path = Path(name).expanduser()
    beside = ini.folder / path
    return beside if beside.is_file() or not (LIBRARY / path).is_file() else LIBRARY / path


def _commands(path: Path) -> Iterator[tuple[list[str], Place]]:
    """Words of each command of a file, and its place."""
    text, begun = "", 0
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        begun = begun if text else number
        if line.endswith("\\"):
            text += line[:-1] + " "
            continue
        words = (text + line).split("#")[0].split()
        text = ""
        if words:
            yield words, Place(str(path), begun)


# Complex: one case for each command of HAL.
def _run(hal: Hal, commands: Iterator[tuple[list[str], Place]], ini: Ini) -> None:
    """Note what commands do."""
    for raw, place in commands:
        words = [_FROM_INI.sub(lambda m: ini.value(m[1], m[2]) or m[0], word) for word in raw]
        verb, rest = words[0], [w for w in words[1:] if w not in ("=>", "<=", "<=>")]
        if verb == "source" and rest:
            _run(hal, _commands(_file(ini, rest[0])), ini)
        elif verb == "loadrt" and rest:
            hal.loaded.setdefault(rest[0], place)
            known = hal.arguments.get(rest[0], "")
            hal.arguments[rest[0]] = " ".join([known, *rest[1:]]).strip()
        elif verb == "net" and rest:
            for pin in rest[1:]:
                hal.signal[pin] = rest[0], place
        elif verb == "linksp" and len(rest) > 1:
            hal.signal[rest[1]] = rest[0], place
        elif verb == "linkps" and len(rest) > 1:
            hal.signal[rest[0]] = rest[1], place
        elif verb == "unlinkp" and rest:
            hal.signal.pop(rest[0], None)
        elif verb == "addf" and len(rest) > 1:
            _add_function(hal, rest, place)


def _add_function(hal: Hal, rest: list[str], place: Place) -> None:
    """Put a function into a thread: `addf FUNCTION THREAD [POSITION]`."""
    thread = hal.functions.setdefault(rest[1], [])
    where = int(rest[2]) if len(rest) > 2 and re.fullmatch(r"-?\d+", rest[2]) else -1
    if where > 0:
        thread.insert(where - 1, rest[0])
    elif where == -1:
        thread.append(rest[0])
    else:
        hal.unclear = hal.unclear or place
