"""What several commands share: options, finding the machine, the console, the progress bar."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from gcodejerk.machine import Machine

MachineOption = Annotated[
    str | None,
    typer.Option(
        "--machine",
        "-m",
        metavar="M",
        envvar="GCODEJERK_MACHINE",
        help="machine file, or the name of a shipped machine; by default the gcodejerk.yaml in "
        "the program's folder or above it",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON, for other programs")]
ProfileOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="condition3 (default), symmetric, cascade, optimal, shortest, conventional, "
        "condition1 or 2",
    ),
]


def load_machine(name: str | None, programs: Sequence[str] = ()) -> Machine:
    """The machine that the user named, or the one that stands for the programs' folders.

    A name is that of a shipped machine, or of a file, also beside the first program.
    """
    from gcodejerk.machine import Machine, find_machine

    if name is None:
        return Machine.load(_found(programs))
    first = programs[0] if programs else "-"
    if first != "-":
        beside = (Path(first) if Path(first).is_dir() else Path(first).parent) / name
        if not Path(name).exists() and beside.is_file():
            return Machine.load(beside)
    found = find_machine(name)
    described = Machine.load(found)
    # A shipped machine is called by its file's name, wherever it is installed.
    return described if str(found) == name else replace(described, source=found.name)


def _found(programs: Sequence[str]) -> Path:
    """The one machine file that stands for all programs; said on standard error."""
    from gcodejerk.machine.find import BESIDE, machine_above

    folders = [
        "." if one == "-" else one if Path(one).is_dir() else os.path.dirname(one) or "."
        for one in programs
    ] or ["."]
    found = {folder: machine_above(folder) for folder in dict.fromkeys(folders)}
    missing = [folder for folder, path in found.items() if path is None]
    if missing:
        raise typer.BadParameter(
            f"no machine: state --machine M or GCODEJERK_MACHINE, or put a {BESIDE} into "
            f"{missing[0]} or a folder above it; `gcodejerk machine new` makes one of what your "
            "control has, `gcodejerk machine list` shows those that are shipped"
        )
    paths = list(dict.fromkeys(path for path in found.values() if path is not None))
    if len(paths) > 1:
        raise typer.BadParameter(
            f"these programs belong to different machines, {paths[0]} and {paths[1]}: state "
            "--machine M, or process them one after the other"
        )
    print(f"machine: {paths[0]}", file=sys.stderr)
    return paths[0]


def console() -> Any:
    """A rich console for tables; wide where nobody's screen sets the width."""
    from rich.console import Console

    if sys.stdout.isatty() or "COLUMNS" in os.environ:
        return Console(highlight=False, soft_wrap=False)
    return Console(highlight=False, width=120)


@contextmanager
def progress(silent: bool) -> Iterator[Callable[[str, int, int], None] | None]:
    """A progress bar on standard error, if that is a terminal."""
    if silent or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description:>10}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def show(step: str, done: int, total: int) -> None:
            bar.update(task, description=step, completed=done, total=max(total, 1))

        yield show
