"""What each control's own settings can do, beside a stream: one program on one machine.

    python tests/bench/bench_controls.py [PROGRAM MACHINE DIALECT]

For each control and each way to set it: the residual of its law as today's rapids are set, of the
best setting in no more time, and below them what streams leave and what no profile can go below.
The tables in docs/settings.md and in the README are made by this, and a test holds them to it.
"""

import sys
from pathlib import Path

import numpy as np

from gcodejerk.emit import controllers, load_controller
from gcodejerk.emit.sheets import Sheets
from gcodejerk.errors import GcodejerkError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import read_program
from gcodejerk.parameters import joined_moves, program_moves, tune
from gcodejerk.parameters.search import needs
from gcodejerk.planning.bounds import known_limits
from gcodejerk.planning.plan import plan_moves

ROOT = Path(__file__).parents[2]
UM = 1e3
NULL = 1e-6
"""What is nothing [um]."""
HEAD = (
    "| control (settings) | law | set as today [s] | [um] | best [s] | [um] |",
    "|---|---|---|---|---|---|",
)


def moves_of(path, machine, dialect):
    """The distinct rapids of a program."""
    with path.open("rb") as source:
        program = read_program(
            source, name=path.name, dialect=dialect, start=machine.program_start()
        )
        return joined_moves([program_moves(program.rapids, source, machine)], machine)


def stream_row(name, profile, moves, machine):
    """What a profile leaves, in today's time: worst in the band over the rapids before a cut."""
    plans = plan_moves(moves.displacement, machine, profile)
    value = UM * float(plans.worst_in_band[needs(moves) > 0.0].max())
    total = float(plans.counts * machine.interval @ moves.count)
    return f"| {name} | | | | {total:.2f} | {value:.3g} |", plans


def control_rows(control, moves, machine):
    """One control's rows, one for each way to set it; none where it has nothing to set."""
    emitter = load_controller(control)
    if not isinstance(emitter, Sheets):
        return []
    try:
        schemes = emitter.schemes(machine)
    except GcodejerkError:
        return [
            f"| `{control}` | sets a share of today's jerk, and this machine has none | | | | |"
        ]
    rows = []
    for way, scheme in schemes.items():
        found = tune(scheme, moves, machine, curve=False)
        best = f"{found.chosen.total:.2f} | {UM * found.chosen.value:.3g}"
        rows.append(
            f"| `{control}` ({way}) | {scheme.family.title} | {found.as_set.total:.2f} | "
            f"{UM * found.as_set.value:.3g} | {best if found.gains else '- | no gain'} |"
        )
    return rows


def last_rows(moves, machine):
    """Today's rapids, what streams leave, and what no profile can go below."""
    today = tune(load_controller("grbl").scheme(machine), moves, machine, curve=False).today
    rows = [f"| **today** | {machine.planner} | {today.total:.2f} | {UM * today.value:.3g} | | |"]
    for profile in ("condition3", "optimal"):
        row, plans = stream_row(f"**stream**, {profile}", profile, moves, machine)
        rows.append(row)
    limits = known_limits(plans, None)
    if limits is not None and np.isfinite(limits).any():
        least = UM * np.nanmax(limits)
        least = least if least > NULL else 0.0
        rows.append(f"| **limit** of any profile, exact frequencies | | | | | {least:.2g} |")
    return rows


def main():
    """Print the table."""
    program, name, dialect = (
        sys.argv[1:] if len(sys.argv) > 1 else ("samples/plate.ngc", "centre", "linuxcnc")
    )
    machine = Machine.load(find_machine(name))
    moves = moves_of(ROOT / program, machine, dialect)
    print(f"{program} on {name}: {moves.count.sum():.0f} rapids, {len(moves)} distinct\n")
    print(*HEAD, sep="\n")
    for control in sorted(controllers()):
        for row in control_rows(control, moves, machine):
            print(row, flush=True)
    print(*last_rows(moves, machine), sep="\n")


if __name__ == "__main__":
    main()
