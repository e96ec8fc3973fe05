"""Put the post-processor into FreeCAD's macro directories, and take it out again."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from html import unescape
from pathlib import Path

from gcodejerk.errors import EmitError
from gcodejerk.hosts.command import one_line
from gcodejerk.hosts.files import put, signed, take

POST = "gcodejerk_post.py"
_HERE = Path(__file__).resolve().parent
_KNOWN = re.compile(r"(?s)# gcodejerk begin\n.*?# gcodejerk end\n")
_BASE = re.compile(r"\w+")
_MACRO_PATH = re.compile(r'<FCText Name="MacroPath">([^<]*)</FCText>')
_PROGRAMS = ("freecad", "FreeCAD", "freecadcmd", "FreeCADCmd")


def post_text(command: tuple[str, ...], machine: str, base: str) -> str:
    """The post-processor, with what the installation knows.

    Parameters
    ----------
    command : tuple of str
        The words that start gcodejerk.
    machine : str
        What stands behind --machine.
    base : str
        Name of the stock post-processor that posts in front.

    Returns
    -------
    str
        Python, without the line that signs it.
    """
    if not _BASE.fullmatch(base) or base == "gcodejerk":
        raise EmitError(
            f"--base {base} is no stock post-processor of FreeCAD",
            "name one of FreeCAD's, for example linuxcnc, grbl, fanuc or mach3_mach4",
        )
    words = [one_line(word, "the path") for word in command]
    known = (
        "# gcodejerk begin\n"
        f"COMMAND: list[str] = {words!r}\n"
        f"MACHINE = {one_line(machine, 'the machine file')!r}\n"
        f"BASE = {base!r}\n"
        "# gcodejerk end\n"
    )
    return _KNOWN.sub(lambda _: known, (_HERE / POST).read_text(encoding="utf-8"), count=1)


def install_post(
    where: str | None, command: tuple[str, ...], machine: str, base: str = "linuxcnc"
) -> list[str]:
    """Write the post-processor.

    Parameters
    ----------
    where : str or None
        A folder in which FreeCAD looks for post-processors; its macro directories by default.
    command, machine, base
        See `post_text`.

    Returns
    -------
    list of str
        What was done, and what to do next.
    """
    data = signed("freecad", post_text(command, machine, base))
    of = [] if where is None else [where]
    done = []
    for folder in macro_folders(where):
        if where is None:
            _make(folder)
        done.append(put(folder / POST, data))
    return [
        *done,
        f"in the job choose the post-processor `gcodejerk`: it posts with {base}, then rewrites "
        f"for {machine}; others: --base NAME, --machine FILE in the job's arguments",
        f"`{shlex.join(['gcodejerk', 'install', 'freecad', *of, '--remove'])}` takes it out again",
    ]


def remove_post(where: str | None) -> list[str]:
    """Take the post-processor out."""
    folders = macro_folders(where)
    done = [take(folder / POST, "freecad") for folder in folders]
    shown = ", ".join(map(str, folders))
    return [line for line in done if line] or [f"{shown}: nothing of gcodejerk is installed"]


def macro_folders(where: str | None) -> list[Path]:
    """Where FreeCAD looks for post-processors of the user's.

    Raises
    ------
    EmitError
        The folder that was named is none; or no FreeCAD was found.
    """
    if where is not None:
        folder = Path(where).expanduser()
        if not folder.is_dir():
            raise EmitError(
                f"{where} is no folder", "name FreeCAD's macro directory (Macro, Macros ...)"
            )
        return [folder.absolute()]
    home = os.environ.get("FREECAD_USER_HOME")
    if home:
        return [Path(home)]
    looked = _user_folders()
    found = [folder for folder in looked if folder.is_dir()]
    chosen = [path for path in map(_chosen, _settings()) if path is not None and path.is_dir()]
    folders = [*chosen, *(folder / "Macro" for folder in found)]
    folders += [sub / "Macro" for folder in found for sub in sorted(folder.glob("v[0-9]*"))]
    if not folders and any(shutil.which(name) for name in _PROGRAMS):
        folders = [looked[0] / "Macro"]
    if not folders:
        raise EmitError(
            f"no FreeCAD was found: there is none of {', '.join(map(str, looked))}",
            "start FreeCAD once, or name its macro directory: gcodejerk install freecad DIR (the "
            "menu Macro, Macros... shows it)",
        )
    return list(dict.fromkeys(folders))


def _user_folders() -> list[Path]:
    """Where FreeCAD may keep what is the user's, on this system."""
    home = Path.home()
    if sys.platform == "win32":
        return [Path(os.environ.get("APPDATA") or home / "AppData" / "Roaming") / "FreeCAD"]
    if sys.platform == "darwin":
        library = home / "Library"
        return [library / "Application Support" / "FreeCAD", library / "Preferences" / "FreeCAD"]
    data = Path(os.environ.get("XDG_DATA_HOME") or home / ".local" / "share")
    # A FreeCAD in a sandbox (flatpak, snap) starts no program outside it: its folders are left out.
    return [data / "FreeCAD", home / ".FreeCAD"]


def _settings() -> list[Path]:
    """FreeCAD's own settings, which may name another macro directory."""
    if sys.platform in ("win32", "darwin"):
        return [folder / "user.cfg" for folder in _user_folders()]
    config = Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config")
    return [config / "FreeCAD" / "user.cfg", Path.home() / ".FreeCAD" / "user.cfg"]


def _chosen(settings: Path) -> Path | None:
    """The macro directory that a user has chosen."""
    try:
        found = _MACRO_PATH.search(settings.read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return None
    return Path(unescape(found[1])) if found is not None and found[1] else None


def _make(folder: Path) -> None:
    """Make a macro directory that is not there yet."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EmitError(
            f"{folder} cannot be made: {error.strerror}", "name another folder"
        ) from error
