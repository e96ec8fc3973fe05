r"""Cascades of moving averages: a step of position smoothed by three boxes.

This module owns the design of the profile `cascade`. A velocity pulse that lasts w1, averaged over
w2 and then over w3, has 8 steps of the jerk, and with w1 >= w2 + w3 it is the symmetric profile of
seven segments that many controllers make (T1 = T2 = w3, Ta = w2 - w3, Tv = w1 - w2 - w3). It ends
after w1 + w2 + w3 = T_SUM, and a mode keeps of the length L the displacement

.. math:: D = L \left|\prod_i \mathrm{sinc}\frac{\omega w_i}{2}\right|, \qquad
          \mathrm{sinc}\,x = \frac{\sin x}{x},

nothing where a box is as wide as a period of the mode, or several: three modes can be silenced at
once. With damping each factor is :math:`(e^{\lambda w} - 1)/(\lambda w)`, exactly.

Rule: w1 >= w2 >= w3 >= one interval, which loses nothing: boxes may be applied in any order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.boxes import box_profiles
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.search.candidates import cascade_worst
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING, best_in_rows, parts

GRID = 16
"""Values of w2 and of w3 each on the map."""
PERIODS = 3
"""A box may be as wide as up to so many periods of a mode."""
MODES = 8
"""Modes whose periods are tried, those that count most."""
REFINEMENTS = 14
"""Halvings of the step around the best of the map."""
STEPS = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, -1], [-1, 1]], float)
"""Steps of the refinement, in w2 and w3."""


def design_cascade(
    total: Array, velocity: Array, acceleration: Array, jerk: Array,
    objective: Objective, interval: float, periods: Array,
) -> tuple[Profiles, NDArray[np.bool_]]:  # fmt: skip
    """The cascade of three boxes in the given time with the least worst residual.

    Parameters
    ----------
    total : ndarray, shape (n,)
        T_SUM. [s]
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of the unit profile. [1/s], [1/s^2], [1/s^3]
    objective : Objective
        Of n moves.
    interval : float
        The least width of a box. [s]
    periods : ndarray, shape (p,)
        Of modes: boxes as wide as these are tried. [s]

    Returns
    -------
    profiles : Profiles
        n profiles; meaningless where `feasible` is False.
    feasible : ndarray of bool, shape (n,)
        Whether any cascade keeps the limits.
    """
    n = len(total)
    w2, w3, worst = (np.empty(n) for _ in range(3))
    boxes = np.concatenate([k * periods for k in range(1, PERIODS + 1)])
    width = GRID * GRID + len(boxes) ** 2 + GRID * len(boxes)
    for part in parts(n, width):
        search = _Search(
            total[part], velocity[part], acceleration[part], jerk[part],
            objective.take(part), interval,
        )  # fmt: skip
        w2[part], w3[part], worst[part] = search.run(boxes)
    feasible = np.isfinite(worst)
    w2, w3 = np.where(feasible, w2, total / 3.0), np.where(feasible, w3, total / 6.0)
    return box_profiles(total - w2 - w3, w2, w3), feasible


def leading_periods(objective: Objective) -> Array:
    """Periods of the pole with the largest weight of each group, of the `MODES` largest [s]."""
    size = objective.weights.max(axis=0, initial=0.0)
    # In order of the group, the largest first: the first of each group leads it.
    order = np.lexsort((-size, objective.group))
    first = np.flatnonzero(np.diff(objective.group[order], prepend=-1))
    leading = order[first]
    leading = leading[np.argsort(-size[leading], kind="stable")]
    periods: Array = 2.0 * np.pi / objective.poles.imag[leading[:MODES]]
    return periods


class _Search:
    """The search for some moves: a map over w2 and w3, then smaller and smaller steps."""

    def __init__(
        self, total: Array, V: Array, A: Array, J: Array, objective: Objective, interval: float
    ) -> None:
        slack = 1.0 + ROUNDING
        self.total = total[:, np.newaxis]
        self.V, self.A, self.J = ((x * slack)[:, np.newaxis] for x in (V, A, J))
        self.objective, self.interval = objective, interval

    def run(self, boxes: Array) -> tuple[Array, Array, Array]:
        """The best w2 and w3 and what they leave; `boxes` are widths worth trying."""
        n = len(self.total)
        share = np.linspace(0.0, 1.0, GRID)
        # w3 up to a third of the time, w2 between it and half of the rest.
        w3 = self.interval + share[:, np.newaxis] * (
            self.total[..., np.newaxis] / 3 - self.interval
        )
        w2 = w3 + share * (0.5 * (self.total[..., np.newaxis] - w3) - w3)
        w3, w2 = (np.broadcast_to(x, (n, GRID, GRID)).reshape(n, -1) for x in (w3, w2))
        free = np.repeat(w3[:, ::GRID], len(boxes), axis=1)
        box = np.tile(boxes, (n, free.shape[1] // max(len(boxes), 1)))
        first, second = (x.ravel() for x in np.meshgrid(boxes, boxes))
        w3 = np.concatenate(
            [w3, np.minimum(free, box), np.tile(np.minimum(first, second), (n, 1))], 1
        )
        w2 = np.concatenate(
            [w2, np.maximum(free, box), np.tile(np.maximum(first, second), (n, 1))], 1
        )
        # Boxes may be applied in any order: the widest is w1, whichever was chosen first.
        w3, w2, _ = np.sort(np.stack([self.total - w2 - w3, w2, w3]), axis=0)
        w2, w3, worst = self._best(w2, w3)
        step = self.total[:, 0] / (3.0 * GRID)
        for _ in range(REFINEMENTS):
            near2 = np.column_stack([w2, w2[:, np.newaxis] + step[:, np.newaxis] * STEPS[:, 0]])
            near3 = np.column_stack([w3, w3[:, np.newaxis] + step[:, np.newaxis] * STEPS[:, 1]])
            w2, w3, least = self._best(near2, near3)
            step = np.where(least < worst, step, 0.5 * step)
            worst = least
        return w2, w3, worst

    def _best(self, w2: Array, w3: Array) -> tuple[Array, Array, Array]:
        """The best of the candidates in each row, the first among equals."""
        value = self._value(w2, w3)
        w2, w3, least = best_in_rows(value, w2, w3, value)
        return w2, w3, least

    def _value(self, w2: Array, w3: Array) -> Array:
        """Worst residual of candidates, shape (n, k); infinite where limits are broken."""
        w1 = self.total - w2 - w3
        edge = 1.0 - 1e-12
        with np.errstate(all="ignore"):
            overlap = np.maximum(0.5 * (w2 + w3 - w1), 0.0)
            V = (1.0 - overlap**2 / (w2 * w3)) / w1
            J = np.where(overlap > 1e-12, 2.0, 1.0) / (w1 * w2 * w3)
            legal = (w1 >= w2 * edge) & (w2 >= w3 * edge) & (w3 >= self.interval * edge)
            legal &= (V <= self.V) & (1.0 / (w1 * w2) <= self.A) & (J <= self.J)
            # What is not legal is evaluated as something harmless.
            worst = cascade_worst(
                tuple(np.where(legal, width, 1.0).T for width in (w1, w2, w3)), self.objective
            ).T
        return np.where(legal, worst, np.inf)
