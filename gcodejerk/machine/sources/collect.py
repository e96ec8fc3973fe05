"""Whose configuration a file is, and one draft of all files that somebody names."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.reading import NotAFileError, read_file
from gcodejerk.machine.sources.draft import Draft
from gcodejerk.machine.sources.fanuc import is_fanuc, read_fanuc
from gcodejerk.machine.sources.grbl import is_fluidnc, is_grbl, read_fluidnc, read_grbl
from gcodejerk.machine.sources.klipper import is_klipper, read_klipper
from gcodejerk.machine.sources.linuxcnc import is_linuxcnc, read_linuxcnc
from gcodejerk.machine.sources.marlin import is_marlin, read_marlin

MOST_BYTES = 4 << 20
KINDS = (
    "a LinuxCNC INI, a grbl or grblHAL $$ dump, FluidNC's YAML, Klipper's printer.cfg with "
    "resonances_x.csv, Marlin's M503 report, RepRapFirmware's config.g, Fanuc parameters (1420, "
    "1620, 1621, 1401)"
)
_SPECTRUM = re.compile(
    r"^\s*#?\s*\"?(freq|frequency|f)\b[^,\n]*,.*psd|^\s*[\d.eE+-]+\s*,\s*[\d.eE+-]+", re.I
)
_SCORES = re.compile(r",\w+\([\d.]+\)")
"""Columns of shapers, which stand beside what SHAPER_CALIBRATE has scaled for them."""
_AXIS_OF_FILE = re.compile(r"(?:^|[_\-. ])([xyz])(?:[_\-. ]|$)", re.IGNORECASE)


def recognise(text: str) -> str:
    """Whose configuration a text is.

    Parameters
    ----------
    text : str
        Of a whole file.

    Returns
    -------
    str
        ``linuxcnc``, ``klipper``, ``fluidnc``, ``grbl``, ``marlin``, ``fanuc``, ``spectrum``,
        ``machine`` for a machine file, or empty.
    """
    if is_klipper(text):
        return "klipper"
    if is_linuxcnc(text):
        return "linuxcnc"
    if is_fluidnc(text):
        return "fluidnc"
    if is_grbl(text):
        return "grbl"
    if is_marlin(text):
        return "marlin"
    if is_fanuc(text):
        return "fanuc"
    if re.search(r"^positioning:", text, re.MULTILINE) and re.search(r"^axes:", text, re.MULTILINE):
        return "machine"
    return "spectrum" if _SPECTRUM.search(text[:4000]) else ""


def draft_of(files: Sequence[str], folder: Path) -> Draft:
    """One draft of a control's configuration and of measured spectra.

    Parameters
    ----------
    files : sequence of str
        Paths, - for standard input: at most one configuration; spectra name their axis
        (`resonances_x_1.csv`).
    folder : Path
        Where the machine file will be: names of spectra are written from there.

    Returns
    -------
    Draft
        Not settled yet; an empty one where no file is a configuration.

    Raises
    ------
    MachineError
        A file cannot be read or is none of these; or there are two configurations.
    """
    drafts: list[Draft] = []
    spectra: list[Path] = []
    for name in files:
        path = Path(name)
        text = _text(path)
        kind = recognise(text)
        path = Path("<stdin>") if name == "-" else path
        if kind == "spectrum" and name == "-":
            raise MachineError(
                "a spectrum came from standard input",
                "name its file: the machine file refers to it",
            )
        if kind == "spectrum":
            if _SCORES.search(text.partition("\n")[0]):
                raise MachineError(
                    "this is Klipper's table of a calibration: scaled, no spectrum to judge by",
                    "give resonances_*.csv (TEST_RESONANCES AXIS=X OUTPUT=resonances)",
                    Place(name),
                )
            spectra.append(path)
        elif kind == "machine":
            raise MachineError(
                "this is a machine file already", f"check it: gcodejerk machine check {name}",
                Place(name),
            )  # fmt: skip
        elif not kind:
            raise MachineError(
                "this is no configuration that gcodejerk knows",
                f"it reads {KINDS}; or state the machine with --axis",
                Place(name),
            )
        else:
            drafts.append(_read(kind, path, text))
            drafts[-1].sources.append(path.name)
    if len(drafts) > 1:
        raise MachineError(
            f"{' and '.join(draft.sources[0] for draft in drafts)} are two configurations",
            "name one; a machine has one control",
        )
    draft = drafts[0] if drafts else Draft("")
    for path in spectra:
        _spectrum(draft, path, folder)
    return draft


def _read(kind: str, path: Path, text: str) -> Draft:
    if kind == "linuxcnc":
        return read_linuxcnc(path, text)
    if kind == "klipper":
        return read_klipper(path, text)
    readers = {"grbl": read_grbl, "fluidnc": read_fluidnc, "marlin": read_marlin}
    return readers.get(kind, read_fanuc)(text, path.name)


def _spectrum(draft: Draft, path: Path, folder: Path) -> None:
    """A measured spectrum belongs to the axis that its name says."""
    match = _AXIS_OF_FILE.search(path.stem)
    if match is None:
        raise MachineError(
            "the name does not say which axis was shaken",
            "call it resonances_x.csv, resonances_y.csv or resonances_z.csv", Place(str(path)),
        )  # fmt: skip
    axis = draft.axis(match[1].upper())
    if axis.spectrum is not None:
        raise MachineError(
            f"{axis.name} has a spectrum already, {axis.spectrum}", "name one for each axis",
            Place(str(path)),
        )  # fmt: skip
    try:
        axis.spectrum = path.resolve().relative_to(folder.resolve()).as_posix()
    except ValueError:
        axis.spectrum = path.resolve().as_posix()
    draft.sources.append(path.name)


def _text(path: Path) -> str:
    place = Place(str(path))
    try:
        piped = str(path) == "-"
        data = sys.stdin.buffer.read(MOST_BYTES + 1) if piped else read_file(path, MOST_BYTES + 1)
    except FileNotFoundError:
        raise MachineError("there is no such file", f"name {KINDS}", place) from None
    except IsADirectoryError:
        raise MachineError("is a folder", "name the configuration in it", place) from None
    except NotAFileError:
        raise MachineError("is a pipe or a device", "write it to a file first", place) from None
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise MachineError(f"cannot be read: {reason}", "check the path", place) from None
    if len(data) > MOST_BYTES:
        raise MachineError("is larger than any configuration", f"name {KINDS}", place)
    encoding = "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    return data.decode(encoding, "replace").replace("\r\n", "\n").replace("\r", "\n")
