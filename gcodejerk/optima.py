"""Optimal laws of many moves: each distinct problem once, on all cores, remembered on disk.

This module owns what makes optima affordable. A problem does not depend on the length of its move,
only on the number of intervals, on the limits relative to the length, on the poles and on the
weights relative to each other; so moves that differ in nothing else share a solution, and so do
programs.

Rule: a solution is used only after it has been checked (arrival, limits, no way back), whether it
comes from the solver or from the disk.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk import __version__
from gcodejerk.motion import Laws, joined
from gcodejerk.motion.laws import Array
from gcodejerk.motion.optimal import Move, Optimum, least_residual, smoothest_within
from gcodejerk.motion.programme import require_solver
from gcodejerk.solutions import cache_file, read_solutions, write_solutions

HELD = 1e-6
"""Relative tolerance on limits of a solution that is used."""
ARRIVED = 1e-9
"""Error of the end, for the unit length."""
BATCH = 64
"""Solutions are written to the disk so many at a time: a run that is cut keeps what it has."""


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What is asked about a move.

    Attributes
    ----------
    move : Move
        The move.
    reference : float
        Residual of the controller's own law: the measure for what is small. [mm]
    allowed : float or None
        None: the least residual. A number: the least peak jerk that leaves no more. [mm]
    """

    move: Move
    reference: float
    allowed: float | None = None

    def key(self) -> tuple[bytes, float]:
        """A digest that equal problems share, and the weight [mm] that solutions are scaled by."""
        move = self.move
        scale = float(move.weights.max(initial=0.0)) or 1.0
        T = move.count * move.interval
        limits = (move.velocity * T, move.acceleration * T**2, move.jerk * T**3)
        allowed = -1.0 if self.allowed is None else self.allowed / scale
        numbers = np.concatenate(
            [
                [move.count, *limits, self.reference / scale, allowed, move.band, move.interval],
                move.poles.real * T, move.poles.imag * T, move.weights / scale, move.group,
            ]
        )  # fmt: skip
        # Rounded: the same move computed in another order is the same problem.
        text = ",".join([__version__, *(f"{x:.10g}" for x in numbers)])
        return hashlib.blake2b(text.encode(), digest_size=16).digest(), scale


Progress = Callable[[int, int], None]
"""Called with the number of problems that are solved, and of all."""


def answers(questions: list[Question], progress: Progress | None = None) -> list[Optimum | None]:
    """Solve problems, each distinct one once.

    Parameters
    ----------
    questions : list of Question
        n of them.
    progress : callable, optional
        See `Progress`.

    Returns
    -------
    list of Optimum or None
        n answers; None where no law keeps the limits.

    Raises
    ------
    PlanError
        scipy or clarabel is not installed.
    """
    require_solver()
    keys = [question.key() for question in questions]
    distinct = {key: question for (key, _), question in zip(keys, questions, strict=True)}
    file = cache_file()
    found: dict[bytes, Optimum | None] = {}
    for key, value in read_solutions(list(distinct), file).items():
        known = _decoded(value)
        if _holds(known, distinct[key].move):
            found[key] = known
    missing = [key for key in distinct if key not in found]
    done = len(found)
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        for begin in range(0, len(missing), BATCH):
            part = missing[begin : begin + BATCH]
            solved = dict(zip(part, pool.map(_answer, (distinct[k] for k in part)), strict=True))
            write_solutions({key: _encoded(x) for key, x in solved.items() if x is not None}, file)
            found.update(solved)
            done += len(part)
            if progress is not None:
                progress(done, len(distinct))
    out: list[Optimum | None] = []
    for key, scale in keys:
        own = found[key]
        out.append(None if own is None else replace(own, worst=own.worst * scale))
    return out


def optimum_laws(optima: list[Optimum], interval: float) -> Laws:
    """The laws of optima, in their order."""
    return joined([optimum.laws(interval) for optimum in optima])


def _answer(question: Question) -> Optimum | None:
    """Solve one problem, for a largest weight of 1."""
    move = question.move
    scale = float(move.weights.max(initial=0.0)) or 1.0
    unit = replace(move, weights=move.weights / scale)
    if question.allowed is None:
        found = least_residual(unit, question.reference / scale)
    else:
        found = smoothest_within(unit, question.allowed / scale, question.reference / scale)
    return found if found is None or _holds(found, move) else None


def _holds(optimum: Optimum, move: Move) -> bool:
    """Whether a solution is a law of this move: its grid, its end, its limits, no way back."""
    knots, jerk = optimum.knots, optimum.jerk
    if (
        len(knots) != len(jerk) + 1
        or knots[0] != 0
        or knots[-1] != move.count
        or np.any(np.diff(knots) <= 0)
        or not np.isfinite(jerk).all()
        or not np.isfinite(optimum.worst)
    ):
        return False
    law = optimum.laws(move.interval)
    d = law.duration[-1]
    a, v, s = law.acceleration[-1], law.velocity[-1], law.position[-1]
    end = s + (v + (0.5 * a + law.jerk[-1] * d / 6.0) * d) * d
    speed = v + (a + 0.5 * law.jerk[-1] * d) * d
    peak = float(law.peak_velocity[0])
    steepest = move.jerk if np.isfinite(move.jerk) else move.acceleration / move.interval
    return bool(
        abs(end - 1.0) <= ARRIVED
        and abs(speed) <= ARRIVED * peak
        and abs(a + law.jerk[-1] * d) <= ARRIVED * float(law.peak_acceleration[0])
        and peak <= move.velocity * (1.0 + HELD)
        and law.least_velocity[0] >= -HELD * peak
        and law.peak_acceleration[0] <= move.acceleration * (1.0 + HELD)
        and np.abs(jerk).max() / move.interval**3 <= steepest * (1.0 + HELD)
    )


def _encoded(optimum: Optimum) -> bytes:
    """A solution as bytes."""
    numbers: Array = np.concatenate([[optimum.worst], optimum.knots, optimum.jerk])
    return numbers.astype("<f8").tobytes()


def _decoded(value: bytes) -> Optimum:
    """A solution from bytes; where they are something else it does not hold."""
    numbers: NDArray[np.float64] = np.frombuffer(value[: len(value) // 8 * 8], "<f8")
    middle = len(numbers) // 2 + 1
    with np.errstate(invalid="ignore"):
        knots = numbers[1:middle].astype(np.int64)
    return Optimum(knots, numbers[middle:], float(numbers[0]) if len(numbers) else np.nan)
