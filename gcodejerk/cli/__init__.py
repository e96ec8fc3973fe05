"""The command line: arguments, files, printing, exit codes. It decides nothing.

Exit status: 0 done, 1 refused or failed (with a message, and nothing half-written), 2 wrong usage,
3 from `process --check` where something would change.
Heavy modules are imported inside the commands, so that `--help` answers at once. The commands stand
in one module per group; this one puts them together and owns what becomes of an error.
"""

from __future__ import annotations

from gcodejerk.cli.interrupts import IMPORTING, Noted  # in front of all that takes its time

# isort: split
import io
import os
import signal
import sys
from typing import Annotated

import typer

from gcodejerk._version import __version__
from gcodejerk.batch.signals import exit_on
from gcodejerk.cli.common import Once
from gcodejerk.cli.controllers import controllers
from gcodejerk.cli.hosts import filter_program, install
from gcodejerk.cli.identification import identify
from gcodejerk.cli.machines import (
    machine_check,
    machine_list,
    machine_schema,
    machine_show,
    machine_test_program,
)
from gcodejerk.cli.moves import compare, map_amplitudes, plan
from gcodejerk.cli.new_machine import machine_new
from gcodejerk.cli.programs import inspect, process
from gcodejerk.cli.proving import verify
from gcodejerk.cli.simulation import machine_reduce, simulate
from gcodejerk.cli.tuning import parameters
from gcodejerk.errors import GcodejerkError

app = typer.Typer(
    help="Rapids that do not shake the machine: re-times the G0 moves of an NC program.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
machine_app = typer.Typer(
    help="Make, check and show machine files.", no_args_is_help=True, rich_markup_mode=None
)
app.add_typer(machine_app, name="machine")

app.command("process", cls=Once)(process)
app.command("inspect", cls=Once)(inspect)
app.command("verify", cls=Once)(verify)
app.command("plan", cls=Once)(plan)
app.command("map", cls=Once)(map_amplitudes)
app.command("compare", cls=Once)(compare)
app.command("parameters", cls=Once)(parameters)
app.command("simulate", cls=Once)(simulate)
app.command("identify", cls=Once)(identify)
app.command("controllers", cls=Once)(controllers)
app.command("filter", cls=Once)(filter_program)
app.command("install", cls=Once)(install)
machine_app.command("new", cls=Once)(machine_new)
machine_app.command("check", cls=Once)(machine_check)
machine_app.command("reduce", cls=Once)(machine_reduce)
machine_app.command("list", cls=Once)(machine_list)
machine_app.command("show", cls=Once)(machine_show)
machine_app.command("test-program", cls=Once)(machine_test_program)
machine_app.command("schema", cls=Once)(machine_schema)


IMPORTING.back()


def main() -> None:
    """Run the command line; every mistake of a user is a message, every other one a traceback."""
    interrupt = Noted()
    try:
        _run()
    except KeyboardInterrupt:  # before typer answers to it, or behind
        sys.exit(128 + signal.SIGINT)
    except Exception:
        if not interrupt.came:
            raise
        sys.exit(128 + signal.SIGINT)
    finally:
        interrupt.back()


def _run() -> None:
    _end_in_order()
    # Our matrices are small: threads would wait for each other, on a busy computer for longer than
    # all the rest takes. Read by the libraries as numpy is imported, here and in our processes.
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        os.environ.setdefault(name, "1")
    try:
        try:
            app(standalone_mode=True)
        finally:
            sys.stdout.flush()
    except GcodejerkError as error:
        print(error, file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:
        # Whoever read our output has enough. Nothing more can be printed, not even at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        # A full disk behind standard output, and what else no command could name.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        print(f"gcodejerk cannot go on: {error}", file=sys.stderr)
        sys.exit(1)


def _end_in_order() -> None:
    """Asked to end, put temporary files away first; show whatever name a file has."""
    # Services start programs with streams closed; the lowest one first, so that each gets its own.
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = open(os.devnull, mode, encoding="utf-8")  # noqa: SIM115 (until the end)
            setattr(sys, name, stream)
    for name in ("SIGTERM", "SIGHUP"):  # Windows has no SIGHUP, and nohup ignores it
        asked = getattr(signal, name, None)
        if asked is not None and signal.getsignal(asked) == signal.SIG_DFL:
            exit_on(asked)
    for shown in (sys.stdout, sys.stderr):
        if isinstance(shown, io.TextIOWrapper):
            shown.reconfigure(errors="backslashreplace")


def _version(value: bool) -> None:
    if value:
        print(f"gcodejerk {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="show the version")
    ] = False,
) -> None:
    """Options of all commands."""
