"""Texts for hosts that run a script of ours, with the command and the machine file written in.

Rule: each says of itself whether it was tried in the host. A template's marks are @NAME@; what
stands for one is quoted for the language around it.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from gcodejerk.hosts.command import for_shell, for_windows, one_line

_HERE = Path(__file__).resolve().parent
_MARK = re.compile(r"@([A-Z_]+)@")


def fill(template: str, command: tuple[str, ...], machine: str) -> str:
    """A template with the command and the machine file in it.

    Parameters
    ----------
    template : str
        Name of the file, without `.template`.
    command : tuple of str
        The words that start gcodejerk.
    machine : str
        What stands behind --machine.

    Returns
    -------
    str
    """
    words = [one_line(word, "the path") for word in command]
    one_line(machine, "the machine file")
    # In JavaScript's text the further words are quoted for Windows.
    more = "".join(f"{for_windows([word])} " for word in words[1:])
    values = {
        "COMMAND": repr(words),
        "MACHINE": repr(machine),
        "EXE_JS": json.dumps(words[0]),
        "MACHINE_JS": json.dumps(machine),
        "ARGUMENTS": json.dumps(more)[1:-1],
        # In a batch file % begins a variable.
        "COMMAND_BAT": for_windows(words).replace("%", "%%"),
        "MACHINE_BAT": for_windows([machine]).replace("%", "%%"),
        "COMMAND_SH": for_shell(words),
        "MACHINE_SH": for_shell([machine]),
    }
    text = (_HERE / f"{template}.template").read_text(encoding="utf-8")
    return _MARK.sub(lambda mark: values[mark[1]], text)
