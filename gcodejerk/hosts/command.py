"""How a host starts gcodejerk: the words of the command, and how a shell is given them.

Rule: an installed line holds the full path of the command. A host has a search path, a folder and
an interpreter of its own, and none of them is the one that the user installed from.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine, find_machine

_NAMES = ("gcodejerk", "gcodejerk.exe")


def own_command() -> tuple[str, ...]:
    """The words that start this gcodejerk from anywhere.

    Returns
    -------
    tuple of str
        The full path of the script beside this Python, or else of the one on the search path, or
        else this Python and the module.
    """
    for name in _NAMES:
        script = Path(sys.executable).parent / name
        if script.is_file():
            return (str(script.absolute()),)
    found = shutil.which("gcodejerk")
    if found is not None:
        return (str(Path(found).absolute()),)
    return (str(Path(sys.executable).absolute()), "-m", "gcodejerk.cli")


def machine_word(name: str) -> str:
    """What stands behind --machine in an installed line; the file is read once, to be sure of it.

    Parameters
    ----------
    name : str
        As the user named it.

    Returns
    -------
    str
        The name of a shipped machine, or the full path of a file.

    Raises
    ------
    MachineError
        There is none, or it is wrong.
    """
    file = find_machine(name)
    Machine.load(file)
    # The place of a shipped machine may be another one after an update, its name is not.
    return name if str(file) != str(Path(name)) else str(file.absolute())


def for_shell(words: tuple[str, ...] | list[str]) -> str:
    """Words as a line for sh.

    Examples
    --------
    >>> for_shell(["/opt/my tools/gcodejerk", "process"])
    "'/opt/my tools/gcodejerk' process"
    """
    return shlex.join(words)


def for_windows(words: tuple[str, ...] | list[str]) -> str:
    r"""Words as a line for Windows: what holds a blank is in double quotes.

    Examples
    --------
    >>> print(for_windows([r"C:\\My Tools\\gcodejerk.exe", "process"]))
    "C:\\My Tools\\gcodejerk.exe" process
    """
    return subprocess.list2cmdline(words)


def one_line(word: str, what: str) -> str:
    """A word that goes into a line of a file.

    Raises
    ------
    EmitError
        It has a line end or another character that no such line can hold.
    """
    if any(ord(c) < 32 or ord(c) == 127 for c in word):
        raise EmitError(
            f"{what} {word!r} has characters that no line can hold", "rename that file or folder"
        )
    return word


def on_windows() -> bool:
    """Whether this is Windows."""
    return os.name == "nt"
