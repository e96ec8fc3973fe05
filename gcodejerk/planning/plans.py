"""Plans: what was decided for many moves at once, as columns of moves and of profiles.

A move along a straight line has one profile, which every axis follows in proportion to its
displacement. Under `positioning: independent` each axis has a profile of its own. Both are the same
thing here: a profile has a *share*, the displacement of every axis that it carries.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, Mode
from gcodejerk.motion import Profiles, grouped, mode_poles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.profiles.repeated import RepeatedProfiles
from gcodejerk.motion.residual import Complex
from gcodejerk.reasons import CERTAIN
from gcodejerk.storage import gathered, kept, windows

STANDSTILL = 1e-9
"""An axis that moves less than this does not move [mm] or [deg]."""
MIXING = np.uint64(0x9E3779B97F4A7C15)
"""An odd number, 2^64 over the golden ratio: multiplied by it, all bits change many others."""


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """A machine's modes as columns: g of them, and the m oscillators that they stand for.

    A mode is one oscillator. A measured spectrum is one entry here too, but many oscillators, which
    count together.

    Attributes
    ----------
    labels : tuple of str, length g
        The axes that excite each: `Z`, or `Y+Z`.
    modes : tuple of Mode, length g
        The modes themselves; a spectrum's stands for the frequency of its peak.
    poles : ndarray of complex, shape (m,)
        [rad/s]
    participation : ndarray, shape (m, 9)
        Of each axis of `AXES`. [-]
    group : ndarray of int, shape (m,)
        The entry that each oscillator belongs to.
    """

    labels: tuple[str, ...]
    modes: tuple[Mode, ...]
    poles: Complex
    participation: Array
    group: NDArray[np.int64]

    @classmethod
    def of(cls, machine: Machine) -> Modes:
        """The modes of a machine."""
        labels: list[str] = []
        modes: list[Mode] = []
        poles: list[complex] = []
        rows: list[Array] = []
        group: list[int] = []
        for label, mode in machine.all_modes():
            group.append(len(modes))
            labels.append(label)
            modes.append(mode)
            poles.append(complex(mode_poles(mode.frequency, mode.damping)))
            rows.append(np.array([mode.participation_of(axis) for axis in AXES], dtype=float))
        for axis in machine.axes:
            if axis.spectrum is None:
                continue
            spectrum = axis.spectrum
            own = np.array([spectrum.participation * (a == axis.name) for a in AXES], dtype=float)
            for frequency, damping, weight in spectrum.oscillators():
                group.append(len(modes))
                poles.append(complex(mode_poles(frequency, damping)))
                # Accelerations are weighted, and stated as displacements at the peak.
                rows.append(own * np.sqrt(weight) * (frequency / spectrum.peak) ** 2)
            labels.append(axis.name)
            excited = ((axis.name, spectrum.participation),)
            modes.append(Mode(f"spectrum {spectrum.source}", spectrum.peak, 0.0, excited))
        participation = np.array(rows).reshape(len(rows), len(AXES))
        order = np.array(poles, dtype=np.complex128)
        return cls(
            tuple(labels), tuple(modes), order, participation, np.array(group, dtype=np.int64)
        )

    def excited(self, share: Array) -> NDArray[np.bool_]:
        """Which modes displacements (n, 9) excite, (n, m); parts that cancel excite them, too."""
        out: NDArray[np.bool_] = np.abs(share) @ np.abs(self.participation).T > 0.0
        return out

    def grouped(self, amplitude: Array) -> Array:
        """Amplitudes of the entries from those of the oscillators, (..., m) -> (..., g)."""
        return grouped(amplitude, self.group)

    def accelerations(self, displacement: Array) -> Array:
        """Acceleration amplitudes of the entries, (..., m) -> (..., g) [mm/s^2]."""
        frequency = np.array([mode.frequency for mode in self.modes])
        return self.grouped(displacement) * (2.0 * np.pi * frequency) ** 2


@dataclass(frozen=True, slots=True, eq=False)
class Plans:
    """Planned moves: columns of n moves, and of the l profiles that they follow.

    Attributes
    ----------
    machine : Machine
        What they were planned for.
    modes : Modes
        Its modes.
    reason : ndarray of uint8, shape (n,)
        CERTAIN, or the index in `REASONS` of why the move is not planned; it then has no profile.
    displacement : ndarray, shape (n, 9)
        Of each axis. [mm] or [deg]
    length : ndarray, shape (n,)
        Along the path. [mm], or [deg] where only rotary axes move
    conventional_time : ndarray, shape (n,)
        What the controller's own G0 takes. [s]
    counts : ndarray of int, shape (n,)
        T_SUM; 0 where the move is not planned. [intervals]
    move : ndarray of int, shape (l,)
        The move of each profile, ascending.
    share : ndarray, shape (l, 9)
        Displacement of each axis that the profile carries. [mm] or [deg]
    profiles, conventional : Profiles
        The designed profiles, and those of the controller's own G0.
    profile_counts : ndarray of int, shape (l,)
        T_SUM of each profile. [intervals]
    designed : str
        Name of the profiles. Of axes that run on their own, one that gains nothing by it keeps the
        conventional profile.
    worst_in_band : ndarray, shape (n,)
        Largest residual displacement of the designed profiles with every frequency anywhere within
        `design.band`; NaN where it was not computed. [mm]
    most_in_band : ndarray, shape (n,)
        What a stream may leave there at most to be written: what the control's own rapid does, or
        of `shortest` hardly more than the tolerance; NaN: anything. [mm]
    has_to_gain : bool
        It is the control's own rapid.
    lasting : ndarray, shape (n,), or None
        What is written lasts so long, where that is not whole intervals. [s]
    """

    machine: Machine
    modes: Modes
    reason: NDArray[np.uint8]
    displacement: Array
    length: Array
    conventional_time: Array
    counts: NDArray[np.int64]
    move: NDArray[np.int64]
    share: Array
    profiles: Profiles
    conventional: Profiles
    profile_counts: NDArray[np.int64]
    designed: str
    worst_in_band: Array
    most_in_band: Array
    has_to_gain: bool
    lasting: Array | None = None

    def __len__(self) -> int:
        return len(self.reason)

    def __repr__(self) -> str:
        planned = int(np.count_nonzero(self.planned))
        return f"<Plans: {planned} of {len(self)} moves, {self.designed}>"

    @property
    def planned(self) -> NDArray[np.bool_]:
        """Which moves are planned, shape (n,)."""
        planned: NDArray[np.bool_] = self.reason == CERTAIN
        return planned

    @property
    def times(self) -> Array:
        """How long each move lasts as written, 0 where it is not planned, shape (n,) [s]."""
        if self.lasting is not None:
            return np.where(self.planned, self.lasting, 0.0)
        return np.asarray(self.counts * self.machine.interval, dtype=np.float64)

    @property
    def profile_times(self) -> Array:
        """How long each profile lasts, shape (l,) [s]."""
        if self.lasting is not None:
            return self.profiles.total
        return np.asarray(self.profile_counts * self.machine.interval, dtype=np.float64)

    def excited(self, move: int) -> list[int]:
        """The entries of the modes that a move excites."""
        moving = self.displacement[move] != 0.0
        used = ((self.modes.participation != 0.0) & moving).any(axis=1)
        return sorted(set(self.modes.group[used].tolist()))

    def profiles_of(self, move: int) -> range:
        """The profiles of a move."""
        begin, end = np.searchsorted(self.move, [move, move + 1])
        return range(int(begin), int(end))

    def repeated(self, index: NDArray[np.int64]) -> Plans:
        """These moves in another order, any of them more than once, or not at all."""
        begin, end = (np.searchsorted(self.move, index, side=side) for side in ("left", "right"))
        count = end - begin
        move = kept(np.repeat(np.arange(len(index)), count))
        rows = kept(np.repeat(begin - np.cumsum(count) + count, count) + np.arange(len(move)))
        columns = (
            *("reason", "displacement", "length", "conventional_time", "counts"),
            *("worst_in_band", "most_in_band"),
        )
        taken: dict[str, Any] = {name: gathered(getattr(self, name), index) for name in columns}
        return replace(
            self,
            **taken,
            move=move,
            share=_same_or(self.share, rows, taken["displacement"], move),
            profiles=RepeatedProfiles(self.profiles, rows),
            conventional=RepeatedProfiles(self.conventional, rows),
            profile_counts=gathered(self.profile_counts, rows),
            lasting=None if self.lasting is None else gathered(self.lasting, index),
        )

    def part(self, rows: NDArray[np.int64], own: NDArray[np.bool_]) -> Plans:
        """Some of the moves, rising, as a window by itself, with the profiles of `own` alone."""
        begin, end = (np.searchsorted(self.move, rows, side=side) for side in ("left", "right"))
        count = np.where(own, end - begin, 0)
        move = np.repeat(np.arange(len(rows)), count)
        chosen = np.repeat(begin - np.cumsum(count) + count, count) + np.arange(len(move))
        columns = (
            *("reason", "displacement", "length", "conventional_time", "counts"),
            *("worst_in_band", "most_in_band"),
        )
        taken: dict[str, Any] = {name: getattr(self, name)[rows] for name in columns}
        return replace(
            self,
            **taken,
            move=move,
            share=self.share[chosen],
            profiles=self.profiles.take(chosen),
            conventional=self.conventional.take(chosen),
            profile_counts=self.profile_counts[chosen],
            lasting=None if self.lasting is None else self.lasting[rows],
        )


def _same_or(
    share: Array, rows: NDArray[np.int64], displacement: Array, move: NDArray[np.int64]
) -> Array:
    """Some rows of the shares: a part of the displacements, where they are just that."""
    if len(move) and move[-1] - move[0] + 1 == len(move):
        part = displacement[move[0] : move[-1] + 1]
        if all((share[rows[w]] == part[w]).all() for w in windows(len(rows))):
            return part
    return gathered(share, rows)


def same_rows(*columns: NDArray[np.generic]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The first of each sort of rows that agree in every bit, and the sort of each row.

    Parameters
    ----------
    columns : ndarray, shape (n,) or (n, k)
        What the rows consist of.

    Returns
    -------
    first : ndarray of int, shape (s,)
    like : ndarray of int, shape (n,)

    Examples
    --------
    >>> first, like = same_rows(np.array([3.0, 5.0, 3.0, 3.0]), np.array([1, 1, 1, 2]))
    >>> first.tolist(), like.tolist()
    ([0, 1, 3], [0, 1, 0, 2])
    """
    return sorted_rows(lambda: columns, len(columns[0]))


def sorted_rows(
    columns: Callable[[], Iterable[NDArray[np.generic]]], count: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The same of columns that are made one by one, each of `count` rows, as often as asked."""
    if not count:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    like, first = _sorts(_mixed(columns(), count))
    # What is mixed may agree by chance: what is told apart here, each column has to confirm.
    for column in columns():
        for values in _words(column):
            if (values == values[first][like]).all():
                continue
            found, own = np.unique(values, return_inverse=True)
            # Two counts below 2^31 each: their product is exact.
            like, first = _sorts(like * len(found) + own.reshape(-1))
    order = np.argsort(first)
    rank = np.empty(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    return first[order], rank[like]


def _mixed(columns: Iterable[NDArray[np.generic]], count: int) -> NDArray[np.uint64]:
    """A number for each row that is the same where all columns are, and hardly elsewhere."""
    out = np.zeros(count, dtype=np.uint64)
    for column in columns:
        for values in _words(column):
            if (values != values[0]).any():
                out ^= values
                out *= MIXING
                out ^= out >> np.uint64(32)
    return out


def _sorts(values: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The sort of each value, and where the first of each sort stands."""
    found, like = np.unique(values, return_inverse=True)
    like = like.reshape(-1)
    first = np.empty(len(found), dtype=np.int64)
    first[like[::-1]] = np.arange(len(like))[::-1]
    return like, first


def _words(column: NDArray[np.generic]) -> Iterator[NDArray[np.unsignedinteger[Any]]]:
    """The bits of rows, as whole numbers of up to 64 of them, one column at a time."""
    if not any(column.strides):
        return
    flat = column.reshape(len(column), -1)
    kind = np.dtype(f"u{flat.dtype.itemsize}")
    for k in range(flat.shape[1]):
        values = np.empty(len(flat), dtype=flat.dtype)
        for part in windows(len(flat)):
            values[part] = flat[part, k]
        yield values.view(kind)


def path_length(displacement: Array, machine: Machine) -> Array:
    """Length of straight moves: of the linear axes, or of the rotary ones where only they move.

    Parameters
    ----------
    displacement : ndarray, shape (n, 9)
        Of each axis. [mm] or [deg]
    machine : Machine
        Tells which axes are rotary.

    Returns
    -------
    ndarray, shape (n,)
        [mm] or [deg]
    """
    rotary = np.array([machine.turns(axis) for axis in AXES])
    with np.errstate(over="ignore"):  # what is too long for a square is for a stream
        linear = np.sqrt((displacement[:, ~rotary] ** 2).sum(axis=1))
        turning = np.sqrt((displacement[:, rotary] ** 2).sum(axis=1))
    length: Array = np.where(linear > STANDSTILL, linear, turning)
    return length
