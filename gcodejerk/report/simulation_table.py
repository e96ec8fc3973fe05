"""What `simulate` and `machine reduce` print: tables and a sentence, for people.

Rule: a table says what the record says, in fewer digits: um and ms.
"""

from __future__ import annotations

import math

import numpy as np

from gcodejerk.nc import Program
from gcodejerk.report.screen import ScreenTable
from gcodejerk.simulation.moves import Outcome
from gcodejerk.simulation.programs import Rapids, Simulation
from gcodejerk.simulation.single import MoveSimulation

UM, MS = 1e3, 1e3
MOST_POLES = 8
SEEN = 0.02
"""Part of the tolerance that a mode has to keep to be shown."""
MOST_RAPIDS = 20
SAME = 1e-6
"""Times that differ by less are the same. [s]"""


def move_tables(found: MoveSimulation) -> list[ScreenTable]:
    """Tables of a move: what it does today and as planned, then pole by pole.

    Parameters
    ----------
    found : MoveSimulation

    Returns
    -------
    list of ScreenTable
    """
    table = ScreenTable(("", "left"), ("today", "right"), ("planned", "right"))
    today, planned = found.outcomes["today"], found.outcomes["planned"]

    def row(what: str, value: float | None, other: float | None, scale: float) -> None:
        texts = ("never" if x is None else digits(scale * x) for x in (value, other))
        table.add_row(what, *texts)

    row("time of the move [ms]", today.time, planned.time, MS)
    for k, axis in enumerate(found.watch.equations.axes):
        if axis in found.moving and axis in _driven(found):
            row(f"{axis}: largest lag [um]", today.lag[k], planned.lag[k], UM)
            row(f"{axis}: lag at its end [um]", today.lag_at_end[k], planned.lag_at_end[k], UM)
    row("the strongest mode keeps [um]", today.residual, planned.residual, UM)
    row("tool from its place, then [um]", today.vibration, planned.vibration, UM)
    tolerance = UM * found.machine.design.tolerance
    row(f"settled to {tolerance:g} um [ms]", today.settling, planned.settling, MS)
    row("of that, waiting [ms]", today.waiting, planned.waiting, MS)
    poles = found.poles()
    least = SEEN * found.machine.design.tolerance
    seen = [pole for pole in poles if max(pole.left.values()) >= least]
    shown = sorted(seen, key=lambda pole: -max(pole.left.values()))[:MOST_POLES]
    modes = ScreenTable(
        ("mode [Hz]", "right"), ("damping", "right"), ("today [um]", "right"),
        ("planned [um]", "right"), ("ratio", "right"),
    )  # fmt: skip
    for pole in sorted(shown, key=lambda pole: pole.frequency):
        before, after = pole.left["today"], pole.left["planned"]
        ratio = f"{after / before:.3g}" if before > 0.0 else ""
        modes.add_row(
            f"{pole.frequency:.2f}", f"{pole.damping:.4f}", digits(UM * before),
            digits(UM * after), ratio,
        )  # fmt: skip
    return [table, modes] if shown else [table]


def _driven(found: MoveSimulation) -> list[str]:
    """Axes with a servo: the others have no lag."""
    return [axis.name for axis in found.machine.axes if axis.servo is not None]


def move_sentence(found: MoveSimulation) -> str:
    """What the move gains, in a sentence."""
    today, planned = found.outcomes["today"], found.outcomes["planned"]
    return f"{_size(found)}; {_gain(today, planned)}"


def _size(found: MoveSimulation) -> str:
    states, axes = len(found.watch.equations.A), len(_driven(found))
    modelled = f"{axes} of {len(found.machine.axes)} axes with a servo"
    friction = ", dry friction (single modes are told without it)"
    friction = friction if found.watch.equations.rubs else ""
    return f"{found.machine.name}: {states} states, {modelled}{friction}"


def _gain(today: Outcome, planned: Outcome) -> str:
    if today.settling is None or planned.settling is None:
        return "nothing damps what is left, so it never settles"
    saved = today.settling - planned.settling
    if abs(saved) < SAME:
        return "planned, it settles as today"
    word = "sooner" if saved >= 0.0 else "later"
    return f"planned, it has settled {abs(saved) * MS:.3g} ms {word}"


def program_table(found: Simulation, program: Program) -> ScreenTable:
    """The rapids that shake most today, and as planned.

    Parameters
    ----------
    found : Simulation
    program : Program

    Returns
    -------
    ScreenTable
    """
    table = ScreenTable(
        ("line", "right"), ("time\n[ms]", "right"), ("largest lag [um]\nnow -> planned", "right"),
        ("strongest mode [um]\nnow -> planned", "right"),
        ("tool from its place [um]\nnow -> planned", "right"),
        ("waiting [ms]\nnow -> planned", "right"),
        drop=("largest lag [um]\nnow -> planned", "time\n[ms]"),
    )  # fmt: skip
    worst = np.argsort(-found.today.residual, kind="stable")[:MOST_RAPIDS]
    for k in np.sort(worst):
        today, planned = found.today, found.planned
        table.add_row(
            str(int(program.rapids.line[found.move[k]])),
            digits(MS * planned.time[k]),
            *(
                f"{digits(UM * before[k])} -> {digits(UM * after[k])}"
                for before, after in (
                    (today.lag, planned.lag),
                    (today.residual, planned.residual),
                    (today.vibration, planned.vibration),
                )
            ),
            f"{_ms(today.waiting[k])} -> {_ms(planned.waiting[k])}",
        )
    return table


def _ms(value: float) -> str:
    return digits(MS * value) if math.isfinite(value) else "never"


def digits(value: float) -> str:
    """Three digits and no exponent, down to a nanometre or a microsecond."""
    if value == 0.0 or abs(value) < 5e-4:
        return "0"
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{float(f'{value:.3g}'):g}"


def program_sentences(found: Simulation, program: Program, tolerance: float) -> list[str]:
    """What a program gains: lines below the table.

    Parameters
    ----------
    found : Simulation
    program : Program
    tolerance : float
        [mm]

    Returns
    -------
    list of str
    """
    left = len(program.rapids) - len(found)
    more = len(found) - MOST_RAPIDS
    lines = []
    if more > 0:
        lines.append(f"the {MOST_RAPIDS} that shake most today; {more} others: --csv, --json")
    simulated = f"{len(found)} of {len(program.rapids)} rapids simulated ({found.distinct} unlike)"
    lines.append(f"{program.name}: {simulated}" + (f", {left} stay as they are" if left else ""))
    lines.append(
        f"waiting until the tool is within {UM * tolerance:g} um: {_waits(found.today)} -> "
        f"{_waits(found.planned)}; {found.saved:.3g} s saved"
    )
    lines.append(
        f"the strongest mode keeps, median: {digits(UM * float(np.median(found.today.residual)))} "
        f"-> {digits(UM * float(np.median(found.planned.residual)))} um"
    )
    return lines


def _waits(rapids: Rapids) -> str:
    settled = np.isfinite(rapids.settling)
    never = int(np.count_nonzero(~settled))
    text = f"{rapids.waiting[settled].sum():.3g} s"
    return text + (f" and {never} that never settle" if never else "")
