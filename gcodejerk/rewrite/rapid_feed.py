"""Where feed moves may count as rapids (`start.RapidFeed`), and where that is refused.

Rule: it is one run's choice, said in the stamp; behind each such stream G1 and its F are in force,
as they were.
"""

from __future__ import annotations

from gcodejerk.emit import Controller
from gcodejerk.errors import EmitError, Place
from gcodejerk.machine import Machine
from gcodejerk.nc import Program, find_dialect


def check_rapid_feed(machine: Machine, emitter: Controller, *, form: str, cycles: bool) -> None:
    """Refuse to count feed moves as rapids where the form has no place for what is behind them.

    Raises
    ------
    EmitError
        Another form, or an option that knows G0 alone, is asked for beside it.
    """
    if machine.rapid_feed is None:
        return
    for wanted, what in (
        (form == "parameters", "--as parameters: no block is rewritten"),
        (cycles, "--expand-cycles"),
        (bool(emitter.beside), f"controller {emitter.name}, whose G0 the control runs unseen"),
        (machine.controller_options.override_guard, "override_guard, whose other branch is a G0"),
    ):
        if wanted:
            raise EmitError(
                f"--rapid-feed does not go together with {what}", "leave one of the two out"
            )


def check_dialect(machine: Machine, program: Program) -> None:
    """Refuse it in a language whose lines each state their own motion."""
    if machine.rapid_feed is not None and not find_dialect(program.dialect).modal_motion:
        raise EmitError(
            f"--rapid-feed is for mills: {program.dialect} runs G0 and G1 alike",
            "leave it out",
            Place(program.name),
        )
