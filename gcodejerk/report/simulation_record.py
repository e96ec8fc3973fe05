"""What `simulate` gives to other programs: JSON records and CSV files.

Rule: lengths are mm and times s, as in every report.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from gcodejerk.machine import Machine
from gcodejerk.nc import Program
from gcodejerk.simulation.moves import Outcome
from gcodejerk.simulation.programs import Rapids, Simulation
from gcodejerk.simulation.reduction import ReducedMode
from gcodejerk.simulation.single import WAYS, MoveSimulation

Record = dict[str, Any]


def move_simulation_record(found: MoveSimulation) -> Record:
    """A move as JSON has it.

    Parameters
    ----------
    found : MoveSimulation

    Returns
    -------
    dict
    """
    axes = found.watch.equations.axes
    return {
        "machine": found.machine.name,
        "move": found.plan.displacement,
        "profile": found.plan.profile,
        "tolerance": found.machine.design.tolerance,
        "states": len(found.watch.equations.A),
        **{way: _outcome(found.outcomes[way], axes) for way in WAYS},
        "modes": [
            {"frequency": pole.frequency, "damping": pole.damping}
            | {way: pole.left[way] for way in WAYS}
            for pole in found.poles()
        ],
    }


def _outcome(outcome: Outcome, axes: tuple[str, ...]) -> Record:
    def named(values: Any) -> dict[str, float]:
        return {axis: float(x) for axis, x in zip(axes, values, strict=True)}

    return {
        "time": outcome.time,
        "lag": named(outcome.lag),
        "lag_rms": named(outcome.lag_rms),
        "lag_at_end": named(outcome.lag_at_end),
        "deviation_at_end": named(outcome.deviation_at_end),
        "residual": outcome.residual,
        "vibration": outcome.vibration,
        "settling": outcome.settling,
        "waiting": outcome.waiting,
    }


def program_simulation_record(found: Simulation, program: Program, machine: Machine) -> Record:
    """A program's rapids as JSON has them.

    Parameters
    ----------
    found : Simulation
    program : Program
        Whose rapids they are.
    machine : Machine

    Returns
    -------
    dict
    """
    lines = program.rapids.line[found.move]
    return {
        "machine": machine.name,
        "program": program.name,
        "tolerance": machine.design.tolerance,
        "summary": {
            "rapids": len(program.rapids),
            "simulated": len(found),
            "distinct": found.distinct,
            "left_alone": len(program.rapids) - len(found),
            **{way: _summary(getattr(found, way)) for way in WAYS},
            "time_saved": found.saved,
        },
        "rapids": [
            {"line": int(line)} | {way: _row(getattr(found, way), k) for way in WAYS}
            for k, line in enumerate(lines)
        ],
    }


def _summary(rapids: Rapids) -> Record:
    settled = np.isfinite(rapids.settling)
    return {
        "time": float(rapids.time.sum()),
        "waiting": float(rapids.waiting[settled].sum()),
        "not_settled": int(np.count_nonzero(~settled)),
        "residual_median": float(np.median(rapids.residual)),
        "residual_largest": float(rapids.residual.max()),
        "vibration_median": float(np.median(rapids.vibration)),
        "vibration_largest": float(rapids.vibration.max()),
        "lag_largest": float(rapids.lag.max()),
    }


def _row(rapids: Rapids, k: int) -> Record:
    settling = float(rapids.settling[k])
    return {
        "time": float(rapids.time[k]),
        "lag": float(rapids.lag[k]),
        "lag_at_end": float(rapids.lag_at_end[k]),
        "lag_rms": float(rapids.lag_rms[k]),
        "residual": float(rapids.residual[k]),
        "vibration": float(rapids.vibration[k]),
        "settling": settling if math.isfinite(settling) else None,
        "waiting": float(rapids.waiting[k]) if math.isfinite(settling) else None,
    }


def program_simulation_csv(found: Simulation, program: Program) -> Iterator[bytes]:
    """One row a rapid: its line, then today's and the planned figures.

    Parameters
    ----------
    found : Simulation
    program : Program

    Yields
    ------
    bytes
    """
    columns = ("time", "lag", "lag_at_end", "lag_rms", "residual", "vibration", "settling")
    names = [f"{way}_{name}" for way in WAYS for name in columns]
    yield ",".join(["line", *names]).encode() + b"\n"
    values = [getattr(getattr(found, way), name) for way in WAYS for name in columns]
    for k, move in enumerate(found.move):
        numbers = ("" if np.isinf(column[k]) else f"{column[k]:.9g}" for column in values)
        yield ",".join([str(int(program.rapids.line[move])), *numbers]).encode() + b"\n"


def move_simulation_csv(found: MoveSimulation) -> Iterator[bytes]:
    """One row a moment: for today's and the planned move command, lag and deviation of each axis.

    Parameters
    ----------
    found : MoveSimulation

    Yields
    ------
    bytes
    """
    axes, times = found.watch.equations.axes, found.times()
    names, columns = ["t"], [times]
    for way in WAYS:
        command = found.command(way, times)[0]
        lag, off = found.lag(way, times), found.deviation(way, times)
        for u, axis in enumerate(axes):
            names += [f"{way}_{axis}_{what}" for what in ("command", "lag", "deviation")]
            columns += [command[:, u], lag[u], off[u]]
        if len(off) > len(axes):
            names.append(f"{way}_structure")
            columns.append(off[-1])
    yield ",".join(names).encode() + b"\n"
    for row in zip(*(column.tolist() for column in columns), strict=True):
        yield ",".join(f"{x:.9g}" for x in row).encode() + b"\n"


def reduction_record(found: list[ReducedMode]) -> list[Record]:
    """Reduced modes as JSON has them."""
    return [
        {
            "name": one.mode.name,
            "frequency": one.mode.frequency,
            "damping": one.mode.damping,
            "participation": dict(one.mode.participation),
            "direction": one.direction,
            "phase": one.phase,
        }
        for one in found
    ]
