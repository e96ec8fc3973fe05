r"""What settings of a control leave of its rapids' vibration, and how long they take.

This module owns the residual and the time of many moves at many settings at once. A straight rapid
has one profile from the control's family; what stands behind the interpolation, an average or a
shaper, acts on each axis by itself and multiplies the response of a mode by its transfer function:

.. math:: R(\lambda) = \sum_a p_a d_a F_a(\lambda)\, B(\lambda)\, e^{\lambda (T - T_a)}

with B the response of the unit profile, F of the filter of axis a, and T_a when that axis arrives.
Exact, damping too; nothing is sampled.

Within a band of frequencies the two ramps of a long move come in step and out of step: where the
cruise between them is long enough for that, the worst is the sum of what each leaves, and a few
frequencies show it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion import Objective, grouped
from gcodejerk.motion.families import filters, unit_quantities
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.residual import Complex, halves_response
from gcodejerk.motion.search.objective import JUDGED, JUDGED_FEWEST
from gcodejerk.parameters.moves import Moves
from gcodejerk.parameters.settings import Scheme
from gcodejerk.planning.plans import Modes, path_length

CHUNK = 1 << 18
"""Profiles that are judged at a time: what bounds the memory."""
PIECES = 8
"""Segments of a profile, about."""
FILTER, MADE_FOR, DAMPING = "filter", "filter_for", "filter_damping"
"""Quantities of an axis's filter: its kind, counted from 1 (0: none), and the frequency [Hz] or
time [s] and the damping ratio that it is made for."""
Transfer = Callable[[int], Complex]


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Moves as rows of profiles, and the frequencies that they are judged at.

    Attributes
    ----------
    moves : Moves
        n of them.
    objective : Objective
        Every mode at many frequencies within the band; its `weights` are the participations of the
        axes, shape (9, m).
    share : ndarray, shape (l, 9)
        Displacement of each profile: a row for each move, or for each axis that runs on its own.
    owner : ndarray of int, shape (l,)
        The move of each row, ascending.
    length : ndarray, shape (l,)
        Along the path. [mm]
    straight : bool
        One row for each move.
    band : float
        That the frequencies of the objective are within; 0: its modes' own.
    """

    moves: Moves
    objective: Objective
    share: Array
    owner: NDArray[np.int64]
    length: Array
    straight: bool
    band: float = 0.0

    @classmethod
    def of(cls, moves: Moves, machine: Machine) -> Rows:
        """The moves on a machine, at the modes' own frequencies."""
        modes = Modes.of(machine)
        objective = Objective(modes.poles, modes.participation.T, modes.group)
        owner = np.arange(len(moves), dtype=np.int64)
        share = moves.displacement
        straight = machine.positioning == "linear"
        if not straight:
            owner, axis = np.nonzero(moves.displacement)
            share = np.zeros((len(owner), len(AXES)))
            share[np.arange(len(owner)), axis] = moves.displacement[owner, axis]
        return cls(moves, objective, share, owner, path_length(share, machine), straight)

    def in_band(self, band: float, longest: float) -> Rows:
        """The same, every mode at many frequencies; `longest` is what moves take at most [s]."""
        return replace(self, objective=self.objective.in_band(band, longest, JUDGED, JUDGED_FEWEST))

    def off_by(self, relative: float) -> Rows:
        """The same, all frequencies off by a share."""
        one = self.objective
        return replace(
            self, objective=Objective(one.poles * (1.0 + relative), one.weights, one.group)
        )

    def take(self, index: NDArray[np.intp]) -> Rows:
        """Some of the moves, in rising order."""
        rows = np.flatnonzero(np.isin(self.owner, index))
        return replace(
            self,
            moves=self.moves.take(index),
            share=self.share[rows],
            owner=np.searchsorted(index, self.owner[rows]),
            length=self.length[rows],
        )

    def at(self, groups: NDArray[np.integer]) -> Rows:
        """The same moves, judged at some of the frequencies: groups of the objective."""
        one = self.objective
        used = np.isin(one.group, groups)
        _, group = np.unique(one.group[used], return_inverse=True)
        objective = Objective(one.poles[used], one.weights[:, used], group.astype(np.int64))
        return replace(self, objective=objective)

    @property
    def stated(self) -> Array | None:
        """Speed of unit profiles that the program states, shape (l,) [1/s]; None: none at all."""
        if not np.isfinite(self.moves.speed).any():
            return None
        return np.asarray(self.moves.speed[self.owner] / self.length)

    def last(self, total: Array) -> Array:
        """When the last row of each move has ended, (k, l) -> (k, n)."""
        if self.straight:
            return total
        starts = np.flatnonzero(np.diff(self.owner, prepend=-1))
        return np.asarray(np.maximum.reduceat(total, starts, axis=1))

    def residuals(
        self, profiles: Profiles, length: Array | None = None, transfer: Transfer | None = None
    ) -> Array:
        """What moves leave after profiles of k settings, and filters behind them.

        Parameters
        ----------
        profiles : Profiles
            k l of them: all rows at the first setting, then all at the second.
        length : ndarray, shape (k, l, 9), optional
            By how much each axis arrives later than its profile ends. [s]
        transfer : callable, optional
            Column of an axis -> its filter's factors, (k, m).

        Returns
        -------
        ndarray, shape (k, n, g)
            Of each mode at each frequency. [mm]
        """
        rows, poles = len(self.share), self.objective.poles
        before, after, cruise = halves_response(profiles, poles)
        total = profiles.total.reshape(-1, rows)
        weight = self._weights(total, length, transfer)
        left = np.empty((len(total), len(self.moves), len(poles)))
        # Where the phase between both ramps turns once within the band, they add up somewhere.
        turns = cruise.reshape(-1, rows)[..., np.newaxis] * np.abs(poles) * self.band >= np.pi
        parts = [part.reshape(-1, rows, len(poles)) * weight for part in (before, after)]
        if self.straight:
            left = np.where(turns, np.abs(parts[0]) + np.abs(parts[1]), np.abs(parts[0] + parts[1]))
        else:
            starts = np.flatnonzero(np.diff(self.owner, prepend=-1))
            most = np.where(turns, np.abs(parts[0]) + np.abs(parts[1]), 0.0)
            fixed = np.where(turns, 0.0, parts[0] + parts[1])
            left = np.abs(np.add.reduceat(fixed, starts, axis=1))
            left += np.add.reduceat(most, starts, axis=1)
        return grouped(left / poles.imag, self.objective.group)

    def _weights(
        self, total: Array, length: Array | None, transfer: Transfer | None
    ) -> Complex | Array:
        """By what the responses of unit profiles are multiplied, shape (l, m) or (k, l, m)."""
        poles, participation = self.objective.poles, self.objective.weights
        if self.straight and length is None:
            return self.share @ participation
        if length is None:
            length = np.zeros((len(total), len(self.share), len(AXES)))
        ends = self.last(total + length.max(axis=-1))[:, self.owner]
        weight = np.zeros((*total.shape, len(poles)), dtype=np.complex128)
        for a in np.flatnonzero(self.share.any(axis=0)).tolist():
            own = np.exp((ends - total - length[:, :, a])[..., np.newaxis] * poles)
            own *= self.share[:, a, np.newaxis] * participation[a]
            weight += own if transfer is None else own * transfer(a)[:, np.newaxis, :]
        return weight


@dataclass(frozen=True, slots=True, eq=False)
class Judge:
    """Moves as the settings of a scheme make them."""

    scheme: Scheme
    rows: Rows

    @property
    def moves(self) -> Moves:
        """The moves that are judged."""
        return self.rows.moves

    def take(self, index: NDArray[np.intp]) -> Judge:
        """Some of the moves, in rising order."""
        return Judge(self.scheme, self.rows.take(index))

    def at(self, groups: NDArray[np.integer]) -> Judge:
        """Judged at some of the frequencies only."""
        return Judge(self.scheme, self.rows.at(groups))

    def times(self, written: Array) -> Array:
        """Duration of every move at k settings, (k, s) -> (k, n) [s]."""
        out = np.empty((len(written), len(self.moves)))
        for part in self._chunks(len(written), 1):
            axes, path = self.scheme.values(written[part])
            total = self.scheme.family.durations(self._unit(axes, path))
            total = total.reshape(-1, len(self.rows.share))
            length = self._lengths(axes)
            out[part] = self.rows.last(total if length is None else total + length.max(axis=-1))
        return out

    def residuals(self, written: Array) -> Array:
        """What every move leaves at each frequency at k settings, (k, s) -> (k, n, g) [mm]."""
        poles = len(self.rows.objective.poles)
        parts = []
        for part in self._chunks(len(written), poles):
            axes, path = self.scheme.values(written[part])
            profiles, length = self._profiles(axes, path), self._lengths(axes)
            transfer = None if length is None else partial(self._transfer, axes)
            parts.append(self.rows.residuals(profiles, length, transfer))
        return np.concatenate(parts)

    def worst(self, written: Array) -> Array:
        """The largest of these over the frequencies, (k, s) -> (k, n) [mm]."""
        return np.asarray(self.residuals(written).max(axis=-1, initial=0.0))

    def peaks(self, written: Array) -> tuple[Array, Array]:
        """Peak acceleration and jerk of the unit profiles before any filter, (k, s) -> (k, l).

        [1/s^2], [1/s^3]; where the acceleration steps, that is no jerk here.
        """
        out = np.empty((2, len(written), len(self.rows.share)))
        for part in self._chunks(len(written), PIECES):
            profiles = self._profiles(*self.scheme.values(written[part]))
            for k, peak in enumerate((profiles.peak_acceleration, profiles.greatest_jerk)):
                out[k, part] = peak.reshape(-1, len(self.rows.share))
        return out[0], out[1]

    def _chunks(self, count: int, poles: int) -> list[slice]:
        """Settings in parts of bounded size."""
        each = max(1, CHUNK // (len(self.rows.share) * max(poles, 1)))
        return [slice(k, min(k + each, count)) for k in range(0, count, each)]

    def _profiles(self, axes: dict[str, Array], path: dict[str, Array]) -> Profiles:
        """Profiles, k times l: all rows at the first setting, then all at the second."""
        return self.scheme.family.build(**self._unit(axes, path))

    def _unit(self, axes: dict[str, Array], path: dict[str, Array]) -> dict[str, Array]:
        """Quantities of these unit profiles."""
        unit = unit_quantities(self.scheme.family, axes, self.rows.share)
        for name, limit in path.items():
            along = (limit[:, np.newaxis] / self.rows.length).ravel()
            unit[name] = np.minimum(unit[name], along)
        stated = self.rows.stated
        if stated is not None:
            k = len(unit["velocity"]) // len(stated)
            unit["velocity"] = np.minimum(unit["velocity"], np.tile(stated, k))
        return unit

    def _lengths(self, axes: dict[str, Array]) -> Array | None:
        """By how much each axis arrives later than its profile, shape (k, l, 9) [s]."""
        if not self.scheme.shaped:
            return None
        length = np.zeros_like(axes[FILTER])
        for kind, name in enumerate(self.scheme.shaped, 1):
            used = axes[FILTER] == kind
            length[used] = filters.length(name, axes[MADE_FOR][used], axes[DAMPING][used])
        return np.asarray(np.where(self.rows.share != 0.0, length[:, np.newaxis, :], 0.0))

    def _transfer(self, axes: dict[str, Array], axis: int) -> Complex:
        """What the filter of an axis makes of responses, shape (k, m)."""
        poles = self.rows.objective.poles
        factor = np.ones((len(axes[FILTER]), len(poles)), dtype=np.complex128)
        for kind, name in enumerate(self.scheme.shaped, 1):
            used = axes[FILTER][:, axis] == kind
            made_for = (axes[MADE_FOR][used, axis], axes[DAMPING][used, axis])
            factor[used] = filters.transfer(name, *made_for, poles)
        return factor
