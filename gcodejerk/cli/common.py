"""What several commands share: options, finding the machine, the console, the progress bar."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer
from typer.core import TyperCommand

if TYPE_CHECKING:
    from gcodejerk.machine import Machine


def _machines() -> list[str]:
    """Names that a shell may complete."""
    from gcodejerk.machine.find import shipped_machines

    return list(shipped_machines())


def _controllers() -> list[str]:
    from gcodejerk.emit import controllers

    return sorted(controllers())


def _profiles() -> list[str]:
    from gcodejerk.machine.file.table import PROFILES

    return list(PROFILES)


def known_controller(name: str | None) -> str | None:
    """The name of a controller; a name that none has is wrong usage."""
    from gcodejerk.emit import controllers, load_controller

    return _known(name, load_controller, controllers())


def known_dialect(name: str | None) -> str | None:
    """The name of a dialect; a name that none has is wrong usage."""
    from gcodejerk.nc import AUTO, DIALECTS, find_dialect

    return _known(name, find_dialect, (AUTO, *DIALECTS))


def known_profile(name: str | None) -> str | None:
    """The name of a profile; a name that none has is wrong usage."""
    if name is not None and name not in (choices := _profiles()):
        raise typer.BadParameter(
            f"there is no profile {name!r}: choose one of {', '.join(choices)}"
        )
    return name


def _known(name: str | None, find: Callable[[str], object], known: Collection[str]) -> str | None:
    """A name, which may be that of an installed package's; what cannot be found is wrong usage."""
    from gcodejerk.errors import GcodejerkError

    if name is not None and name not in known:
        try:
            find(name)
        except GcodejerkError as error:
            raise typer.BadParameter(str(error)) from None
    return name


def positive(value: float | None) -> float | None:
    """A time; one that is not above zero is wrong usage."""
    if value is not None and not 0.0 < value < float("inf"):
        raise typer.BadParameter(f"it is {value:g} s, expected more than zero")
    return value


ControllerOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME", help="see `gcodejerk controllers`", autocompletion=_controllers,
        callback=known_controller,
    ),
]  # fmt: skip
DialectOption = Annotated[
    str | None, typer.Option(help="how the program is read", callback=known_dialect)
]
MachineOption = Annotated[
    str | None,
    typer.Option(
        "--machine",
        "-m",
        metavar="M",
        envvar="GCODEJERK_MACHINE",
        autocompletion=_machines,
        help="machine file, or the name of a shipped machine; by default the gcodejerk.yaml in "
        "the program's folder or above it",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="print JSON, for other programs")]
ProfileOption = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        autocompletion=_profiles,
        callback=known_profile,
        help="condition3 (default), symmetric, cascade, optimal, shortest, conventional, "
        "condition1 or 2",
    ),
]


OUTPUTS = ("output", "report", "plot", "as_json")
"""Parameters that name a file to be written."""


class Once(TyperCommand):
    """A command that writes every file it is told to: of two by one option, one would be missing.

    Of other options the last one counts, as everywhere: so who has the usual ones in an alias, or
    in a host's settings, can say another.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The same, where no option that names an output stands twice."""
        if not ctx.resilient_parsing:
            _, _, order = self.make_parser(ctx).parse_args(args=list(args))
            named = [
                one for one in order if one.name in OUTPUTS and not getattr(one, "is_flag", False)
            ]
            for one in set(named):
                if named.count(one) > 1:
                    word = max(one.opts, key=len)
                    ctx.fail(f"{word} stands twice, and only one of the two would be written")
        rest: list[str] = super().parse_args(ctx, args)
        return rest


def refuse(*cases: tuple[object, str]) -> None:
    """Refuse, as wrong usage, the first of some cases that is so."""
    for so, why in cases:
        if so:
            raise typer.BadParameter(why)


def said(ctx: typer.Context, name: str) -> bool:
    """Whether an option stands on the command line: the environment may have it by itself."""
    source = ctx.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


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
    shown = os.path.relpath(paths[0])
    print(f"machine: {paths[0] if shown.startswith('..') else shown}", file=sys.stderr)
    return paths[0]


def console() -> Any:
    """A rich console for tables; wide where nobody's screen sets the width."""
    from rich.console import Console

    if sys.stdout.isatty() or "COLUMNS" in os.environ:
        return Console(highlight=False, soft_wrap=False)
    return Console(highlight=False, width=120)


class Bar:
    """A progress bar on standard error: called by whoever works, cleared by whoever prints."""

    def __init__(self) -> None:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            Progress,
            TaskProgressColumn,
            TextColumn,
            TimeRemainingColumn,
        )

        # Results are ours to print: rich would send them to standard error, with the bar.
        self.live = Progress(
            TextColumn("{task.description:>10}"),
            BarColumn(),
            TaskProgressColumn(),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
            redirect_stdout=False,
            redirect_stderr=False,
        )
        self.task = self.live.add_task("", total=None)

    def __call__(self, step: str, done: int, total: int) -> None:
        """Show how far a step is."""
        self.live.update(self.task, description=step, completed=done, total=max(total, 1))
        self._show()

    def wait(self, step: str) -> None:
        """Show that a step is at work that does not know how far it is."""
        self.live.remove_task(self.task)
        self.task = self.live.add_task(step, total=None)
        self._show()

    def _show(self) -> None:
        if not self.live.live.is_started:
            self.live.start()

    def clear(self) -> None:
        """Take it from the screen until it is called again."""
        if self.live.live.is_started:
            self.live.stop()


@contextmanager
def waiting(step: str, silent: bool = False) -> Iterator[None]:
    """The same for one step that does not know how far it is."""
    with progress(silent) as show:
        if show is not None:
            show.wait(step)
        yield


@contextmanager
def progress(silent: bool) -> Iterator[Bar | None]:
    """A progress bar on standard error, if that is a terminal."""
    if silent or not sys.stderr.isatty():
        yield None
        return
    bar = Bar()
    try:
        yield bar
    finally:
        bar.clear()


def say(text: str, file: TextIO | None = None) -> None:
    """Print a line; to a terminal, broken between words, what follows indented."""
    out = file or sys.stdout
    if not out.isatty():
        print(text, file=out)
        return
    width = shutil.get_terminal_size().columns
    indent = text[: len(text) - len(text.lstrip())]
    print(
        textwrap.fill(
            text.strip(), width, initial_indent=indent, subsequent_indent=f"{indent}  ",
            break_long_words=False, break_on_hyphens=False,
        ),
        file=out,
    )  # fmt: skip
