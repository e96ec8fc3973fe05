"""Slicers that run a post-processing script: the line for their settings, and what they tell.

PrusaSlicer and its kin call the script with the file last, to be changed in place, and with all
their settings as variables SLIC3R_*. The file has a name for the time being; SLIC3R_PP_OUTPUT_NAME
has the one that the user chose.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from gcodejerk.errors import EmitError
from gcodejerk.hosts.command import for_shell, for_windows, on_windows, one_line

SLICERS = {
    "prusaslicer": "Print Settings > Output options > Post-processing scripts (expert mode)",
    "orcaslicer": "Process > Others > Post-processing scripts (advanced mode)",
    "superslicer": "Print Settings > Output options > Post-processing scripts (expert mode)",
}
"""Where each has the field; the menus differ between versions."""
OUTPUT_NAME = "SLIC3R_PP_OUTPUT_NAME"


def output_name(environment: Mapping[str, str] = os.environ) -> str | None:
    """The name that a slicer will give the program; None where no slicer calls."""
    return environment.get(OUTPUT_NAME) or None


def paste_line(command: tuple[str, ...], machine: str, windows: bool | None = None) -> str:
    r"""The line to paste into a slicer's field of post-processing scripts.

    Parameters
    ----------
    command : tuple of str
        The words that start gcodejerk.
    machine : str
        What stands behind --machine.
    windows : bool, optional
        For Windows; for this system by default.

    Returns
    -------
    str
        The slicer appends the file.

    Raises
    ------
    EmitError
        A path cannot be written in such a line.

    Examples
    --------
    >>> paste_line(("/opt/my tools/gcodejerk",), "mill.yaml", windows=False)
    "'/opt/my tools/gcodejerk' process --in-place --machine mill.yaml"
    >>> print(paste_line((r"C:\My Tools\gcodejerk.exe",), r"C:\mill.yaml", windows=True))
    "C:\My Tools\gcodejerk.exe" process --in-place --machine C:\mill.yaml
    """
    words = [*command, "process", "--in-place", "--machine", machine]
    for word in words:
        one_line(word, "the path")
        if ";" in word:
            raise EmitError(
                f"slicers take ; for the end of a script, and there is one in {word}",
                "rename that file or folder",
            )
    return (
        for_windows(words) if (on_windows() if windows is None else windows) else for_shell(words)
    )


def slicer_lines(host: str, command: tuple[str, ...], machine: str) -> list[str]:
    """What to do in a slicer, the line to paste among it."""
    return [
        f"paste this line into {SLICERS[host]}:",
        paste_line(command, machine),
        "the slicer appends the file; what is refused stops the export, and the slicer shows why",
        "slicers write travel as G1, which stays as it is: see docs/slicers.md for what helps then",
    ]
