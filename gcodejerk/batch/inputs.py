"""Which programs the arguments of a command stand for, and under which names their outputs go.

Rule 1: a file that is named is taken, whatever its name. In a folder, and in those below it, a
program is known by its suffix (`SUFFIXES`); hidden files and folders, links to folders, our own
outputs (`part.jerk.nc`) and the folder that outputs go to are passed over.
Rule 2: the order is that of the arguments, and within a folder that of the names, its files before
its folders: the same on every computer.
Rule 3: all outputs have their names before the first program is opened, so that two of one name are
found while nothing is written yet.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import PurePath

from gcodejerk.errors import EmitError, ProgramError

SUFFIXES = (
    *(".cnc", ".din", ".dnc", ".eia", ".g", ".gco", ".gcode", ".h", ".i", ".iso"),
    *(".min", ".mpf", ".nc", ".ngc", ".prg", ".ptp", ".spf", ".tap"),
)
"""By these a program is known in a folder, in upper or lower case."""
OURS = ".jerk"
"""Stands in front of the suffix of our outputs."""


class NameClashError(EmitError):
    """Two programs would be written to one file, or one over another: wrong usage."""


@dataclass(frozen=True, slots=True)
class Input:
    """A program, and its name below the folder that was given (or below its own)."""

    path: str
    below: str


def is_program(name: str) -> bool:
    """Whether a file in a folder is taken for a program, by its name.

    Examples
    --------
    >>> [is_program(name) for name in ("a.NC", "a.jerk.nc", ".a.nc", "a.txt")]
    [True, False, False, False]
    """
    stem, suffix = os.path.splitext(name)
    return (
        suffix.lower() in SUFFIXES
        and not name.startswith(".")
        and os.path.splitext(stem)[1].lower() != OURS
    )


def find_inputs(
    arguments: list[str], passed_over: str | None = None
) -> tuple[list[Input], list[ProgramError]]:
    """Find the programs that files and folders stand for.

    Parameters
    ----------
    arguments : list of str
        Names of files and of folders; `-` is standard input.
    passed_over : str, optional
        A folder below those given that holds outputs.

    Returns
    -------
    list of Input
        Each path once.
    list of ProgramError
        Folders that cannot be read, and those that hold no program.
    """
    found: dict[Input, None] = {}
    problems: list[ProgramError] = []
    for argument in arguments:
        if not os.path.isdir(argument):
            found[Input(argument, os.path.basename(argument))] = None
            continue
        inside, trouble = _walk(argument, passed_over)
        if not inside and not trouble:
            trouble = [
                ProgramError(
                    f"{argument} holds no program: no file ends in one of {' '.join(SUFFIXES)}",
                    "name the programs themselves, for example with *.txt",
                )
            ]
        found.update(dict.fromkeys(inside))
        problems += trouble
    return list(found), problems


def _walk(root: str, passed_over: str | None) -> tuple[list[Input], list[ProgramError]]:
    """Programs in and below a folder; a list of folders still to read, as depth has no limit."""
    found, problems = [], []
    waiting = [""]
    while waiting:
        below = waiting.pop()
        try:
            with os.scandir(os.path.join(root, below) if below else root) as listing:
                entries = sorted(listing, key=lambda entry: entry.name)
        except OSError as error:
            problems.append(
                ProgramError(
                    f"{os.path.join(root, below)} cannot be read: {error.strerror}",
                    "check its permissions",
                )
            )
            continue
        folders = []
        for entry in entries:
            name = os.path.join(below, entry.name)
            path = name if root == os.curdir else os.path.join(root, name)
            if entry.name.startswith("."):
                continue
            # A link to a folder may lead back to where it stands.
            if entry.is_dir(follow_symlinks=False):
                if passed_over is None or not _same_folder(path, passed_over):
                    folders.append(name)
            elif is_program(entry.name) and os.path.isfile(path):
                found.append(Input(path, name))
            elif is_program(entry.name) and entry.is_symlink() and not os.path.exists(path):
                problem = "is a link that leads nowhere"
                problems.append(ProgramError(f"{path} {problem}", "mend it, or remove it"))
        waiting += reversed(folders)
    return found, problems


def output_name(found: Input, output_dir: str | None, suffix: str) -> str:
    """Where the result of a program goes.

    Parameters
    ----------
    found : Input
        The program.
    output_dir : str or None
        The folder in which its name below is kept; None: beside the program, under another name.
    suffix : str
        Of the output; empty: the program's own.

    Returns
    -------
    str
        A path.

    Examples
    --------
    >>> output_name(Input("jobs/a/part.nc", "a/part.nc"), None, "")
    'jobs/a/part.jerk.nc'
    >>> output_name(Input("jobs/a/part.nc", "a/part.nc"), "out", ".csv")
    'out/a/part.csv'
    """
    if output_dir is not None:
        below = PurePath(found.below)
        return str(PurePath(output_dir) / (below.with_suffix(suffix) if suffix else below))
    path = PurePath(found.path)
    return str(path.parent / f"{path.stem}{OURS}{suffix or path.suffix}")


def report_name(found: Input, report_dir: str) -> str:
    """Where the report on a program goes, in a folder of reports.

    Examples
    --------
    >>> report_name(Input("jobs/a/part.nc", "a/part.nc"), "reports/")
    'reports/a/part.nc.json'
    """
    return str(PurePath(report_dir) / f"{found.below}.json")


def check_names(inputs: list[str], outputs: list[str]) -> None:
    """See that no two outputs are one file, and none is another program.

    Parameters
    ----------
    inputs, outputs : list of str
        Of each program.

    Raises
    ------
    NameClashError
        They are not; which ones.
    """
    programs = {os.path.realpath(name): name for name in inputs}
    taken: dict[str, str] = {}
    for program, output in zip(inputs, outputs, strict=True):
        place = os.path.realpath(output)
        if place in taken:
            raise NameClashError(
                f"{taken[place]} and {program} would both be written to {output}",
                "process them in two runs",
            )
        if place in programs and place != os.path.realpath(program):
            raise NameClashError(
                f"{program} would be written over {programs[place]}, which is to be processed, too",
                "choose another --output-dir",
            )
        taken[place] = program


def _same_folder(one: str, other: str) -> bool:
    """Whether two names are one folder; the other one may not be there yet."""
    return os.path.realpath(one) == os.path.realpath(other)
