"""Hosts for which a text is all that can be installed: a file, or lines to put somewhere by hand.

With a folder the file is written there, and `--remove` takes it away again; without one it is
shown. Nothing here was run in its host: each text says so.
"""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

from gcodejerk.errors import EmitError
from gcodejerk.hosts.command import for_shell, for_windows, on_windows
from gcodejerk.hosts.files import put, signed, take
from gcodejerk.hosts.snippets import fill


@dataclass(frozen=True, slots=True)
class Text:
    """What one host needs."""

    template: str
    file: str
    """Name of the file, where a folder is given."""
    comment: str
    """Begins a comment in the language of the file."""
    steps: tuple[str, ...]
    """What to do with it."""
    former: str = ""
    """A name that the file had before, and that is another host's now."""


_BATCH = (
    "run this on the computer that runs the CAM system: the paths above are of this one",
    "drop posted programs onto the file; or name it where the post may start a program afterwards "
    "(no public document says how, so that is not tried)",
)
TEXTS = {
    "fusion360": Text(
        "fusion360.cps", "gcodejerk.cps.txt", "//",
        (
            "copy your post, put this at the end of the copy, choose the copy when you post",
            "proof that it ran is the comment `gcodejerk stamp` near the top of the program",
            "a Personal licence writes rapids as feed moves, which stay as they are unless you say "
            "otherwise: docs/cam.md",
        ),
    ),
    "mastercam": Text("drop.bat", "gcodejerk.bat", "@rem", _BATCH),
    "solidcam": Text("drop.bat", "gcodejerk_solidcam.bat", "@rem", _BATCH, "gcodejerk.bat"),
    "vectric": Text(
        "in_place.bat", "gcodejerk_run.bat", "@rem",
        (
            "in a copy of your post, beside its other lines: "
            'DIRECT_OUTPUT = "gcodejerk|gcodejerk_run.ini"',
            "in the folder PostP a file gcodejerk_run.ini: the full path of gcodejerk_run.bat, "
            "then %s",
        ),
    ),
    "cura": Text(
        "cura.py", "Gcodejerk.py", "#",
        (
            "the folder is `scripts` in Cura's configuration (Help > Show Configuration Folder)",
            "then Extensions > Post Processing > Modify G-Code > Add a script > gcodejerk",
            "Cura shows an error, and gives the program as it sliced it, where gcodejerk refuses",
        ),
    ),
    "octoprint": Text(
        "octoprint.py", "gcodejerk.py", "#",
        (
            "the folder is ~/.octoprint/plugins; then start OctoPrint anew",
            "each upload goes through gcodejerk; octoprint.log has what it said",
        ),
    ),
    "bcnc": Text(
        "bcnc.py", "gcodejerk_bcnc.py", "#",
        ("the folder is `plugins` in bCNC's; the button is then on the CAM ribbon",),
        "gcodejerk.py",
    ),
}  # fmt: skip


def text_lines(host: str, where: str | None, command: tuple[str, ...], machine: str) -> list[str]:
    """Write the file of a host, or show it.

    Parameters
    ----------
    host : str
        One of TEXTS.
    where : str or None
        The folder; None to show the text.
    command : tuple of str
        The words that start gcodejerk.
    machine : str
        What stands behind --machine.

    Returns
    -------
    list of str
    """
    text = TEXTS[host]
    body = fill(text.template, command, machine)
    steps = [f"- {step}" for step in text.steps]
    if where is None:
        return [*body.rstrip("\n").split("\n"), "", f"file: {text.file}; what to do:", *steps]
    folder = _folder(where)
    done = put(folder / text.file, signed(host, body, text.comment))
    return [
        done,
        *_former(host, folder),
        *steps,
        f"`gcodejerk install {host} {shlex.quote(where)} --remove` takes it out again",
    ]


def remove_text(host: str, where: str) -> list[str]:
    """Take the file of a host away."""
    folder = _folder(where)
    place = folder / TEXTS[host].file
    done = [take(place, host), *_former(host, folder)]
    said = [line for line in done if line is not None]
    return said or [f"{place}: nothing of gcodejerk is installed"]


def _former(host: str, folder: Path) -> list[str]:
    """Take away what an earlier version has put there under another name."""
    former = TEXTS[host].former
    done = take(folder / former, host) if former else None
    return [] if done is None else [done]


def _folder(where: str) -> Path:
    folder = Path(where).expanduser()
    if not folder.is_dir():
        raise EmitError(f"{where} is no folder", "name the folder that the host looks into")
    return folder


WATCHED = {
    "ugs": "Universal G-code Sender has no way to call another program",
    "cncjs": "CNCjs shows what is in the folder of `cncjs --watch-directory DIR`",
    "gsender": "gSender has no way to call another program",
    "iosender": "ioSender has no way to call another program",
    "candle": "Candle has no way to call another program",
    "moonraker": "Mainsail and Fluidd show what is in the folder of G-code files",
}
"""Hosts that only open what was processed before, and what is known of each."""


def folder_lines(host: str, command: tuple[str, ...], machine: str) -> list[str]:
    """What to do for a host that cannot call us."""
    words = [*command, "process", "PROGRAMS", "--output-dir", "DIR", "--machine", machine]
    line = for_windows(words) if on_windows() else for_shell(words)
    return [
        f"{WATCHED[host]}: process programs into the folder that you open from:",
        line,
        "PROGRAMS are files or folders, whose tree is kept below DIR",
    ]
