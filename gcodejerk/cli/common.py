"""What several commands share: options, finding the machine, the console, the progress bar."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from gcodejerk.machine import Machine

MachineOption = Annotated[
    str,
    typer.Option(
        "--machine", "-m", metavar="M", help="machine file, or the name of a shipped machine"
    ),
]
ProfileOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="condition3 (default), symmetric, cascade, optimal, shortest, conventional, "
        "condition1 or 2",
    ),
]


def load_machine(name: str, program: str | None) -> Machine:
    """The machine that the user named: a shipped one, or a file, also beside the program."""
    from gcodejerk.machine import Machine, find_machine

    beside = None
    if program is not None and program != "-":
        beside = (Path(program) if Path(program).is_dir() else Path(program).parent) / name
    if beside is not None and not Path(name).exists() and beside.is_file():
        return Machine.load(beside)
    found = find_machine(name)
    described = Machine.load(found)
    # A shipped machine is called by its file's name, wherever it is installed.
    return described if str(found) == name else replace(described, source=found.name)


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
