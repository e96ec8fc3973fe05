"""Where the machines that come with the package are."""

from __future__ import annotations

from pathlib import Path, PurePath

from gcodejerk.errors import MachineError
from gcodejerk.machine.problems import nearest

SUFFIX = ".yaml"
BESIDE = "gcodejerk.yaml"
"""What a machine file is called that stands for all programs in its folder and below."""


def shipped_machines() -> dict[str, Path]:
    """Machines that come with the package.

    Returns
    -------
    dict of str to Path
        Name -> file, in alphabetical order.
    """
    package = Path(__file__).resolve().parent.parent
    # The build copies machines/ from the top of the source tree into the package.
    for folder in (package / "machines", package.parent / "machines"):
        if folder.is_dir():
            return {path.stem: path for path in sorted(folder.glob("*" + SUFFIX))}
    return {}


def find_machine(name_or_path: str | Path) -> Path:
    """File that a machine's name or path stands for.

    Parameters
    ----------
    name_or_path : str or Path
        A name without slash and suffix is that of a shipped machine; anything else is a path and
        returned as it is, whether or not there is such a file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    MachineError
        No machine of that name is shipped.

    Examples
    --------
    >>> find_machine("vmc").name
    'vmc.yaml'
    >>> find_machine("shop/mill.yaml").as_posix()
    'shop/mill.yaml'
    """
    text = str(name_or_path)
    if "/" in text or "\\" in text or PurePath(text).suffix or text in {".", ".."}:
        return Path(name_or_path)
    shipped = shipped_machines()
    if text in shipped:
        return shipped[text]
    close = nearest(text, shipped)
    hint = f"; did you mean {close!r}?" if close else ""
    known = f"shipped are {', '.join(shipped)}" if shipped else "none are shipped"
    raise MachineError(
        f"no machine is called {text!r}, {known}{hint}",
        f"for a file of your own give its path and suffix, for example ./{text or 'mill'}.yaml",
    )


def machine_above(folder: str | Path) -> Path | None:
    """The machine file that stands for a folder: `gcodejerk.yaml` in it, or in one above it.

    Parameters
    ----------
    folder : str or Path
        Where to begin; the folder of the program, not the one in which a command was started.

    Returns
    -------
    Path or None
        The nearest one.
    """
    begin = Path(folder).resolve()
    for one in (begin, *begin.parents):
        if (one / BESIDE).is_file():
            return one / BESIDE
    return None
