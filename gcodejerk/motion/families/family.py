"""A family of rapids: how a control makes a profile of what is set in it.

This module owns what every family is: its name, the quantities that it is set by, and the pure
function from these quantities to profiles. A quantity is set for each axis; a straight rapid has
one value of each, found by the rule of the quantity's kind.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np

from gcodejerk.motion.profiles.profile import Array, Profiles


class Kind(Enum):
    """How the values of the axes become that of a straight rapid."""

    LIMIT = "limit"
    """No axis may exceed its own: the smallest of value over displacement."""
    TIME = "time"
    """That of the axis whose acceleration is the limit (Fanuc, A-78962EN p. 16); where the family
    has no acceleration, the longest of the axes that move."""
    SHARED = "shared"
    """One number of the control, the same for all axes."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """Something that a family is set by."""

    name: str
    """As a keyword of the family's function, and a key of `rapid` in machine files."""
    unit: str
    """Of an axis; of a unit profile without the length. For example mm/s^2."""
    kind: Kind
    meaning: str


VELOCITY = Quantity("velocity", "mm/s", Kind.LIMIT, "speed of the rapid")
ACCELERATION = Quantity("acceleration", "mm/s^2", Kind.LIMIT, "acceleration of the rapid")
JERK = Quantity("jerk", "mm/s^3", Kind.LIMIT, "jerk of the rapid")


@dataclass(frozen=True, slots=True)
class Family:
    """One law by which controls move.

    Attributes
    ----------
    name : str
        As machine files (`rapid.planner`) and reports call it.
    title : str
        What it is, in a few words.
    quantities : tuple of Quantity
        What it is set by, in the order of the function's keywords.
    build : callable
        Unit quantities as keyword arrays of shape (n,) -> n `Profiles`.
    source : str
        Where the law is described.
    exact : bool
        Its profiles are those of the control; otherwise pieces of constant jerk stand for a law
        that has none, and `build` says how far they are off.
    duration : callable, optional
        The same columns -> how long the profiles take, shape (n,) [s], where that has a form of
        its own.
    """

    name: str
    title: str
    quantities: tuple[Quantity, ...]
    build: Callable[..., Profiles]
    source: str
    exact: bool = True
    duration: Callable[..., Array] | None = None

    def durations(self, unit: Mapping[str, Array]) -> Array:
        """How long the profiles of unit quantities take, shape (n,) [s]."""
        if self.duration is None:
            return self.build(**unit).total
        return np.asarray(self.duration(**unit))

    def profiles(self, values: Mapping[str, Array], share: Array) -> Profiles:
        """Profiles of straight rapids.

        Parameters
        ----------
        values : mapping of str to ndarray, shape (9,) or (k, 9)
            Each quantity of each axis of `AXES`, infinite (a time: 0) for axes that have none;
            with k rows, k settings.
        share : ndarray, shape (n, 9)
            Displacement of each axis. [mm] or [deg]

        Returns
        -------
        Profiles
            n, or k times n: all moves at the first setting, then all at the second.
        """
        return self.build(**unit_quantities(self, values, share))


def unit_quantities(family: Family, values: Mapping[str, Array], share: Array) -> dict[str, Array]:
    """The quantities of unit profiles; parameters as for `Family.profiles`.

    Returns
    -------
    dict of str to ndarray, shape (n,) or (k n,)
        Limits in 1/s, 1/s^2, 1/s^3; times in s.
    """
    used = np.flatnonzero(share.any(axis=0)) if share.any() else np.arange(share.shape[1])
    values = {name: np.asarray(value)[..., used] for name, value in values.items()}
    size = np.abs(share[:, used])
    moving = size > 0.0
    with np.errstate(divide="ignore"):
        inverse = np.where(moving, 1.0 / size, np.inf)

    def over_axes(name: str) -> Array:
        per_axis = np.atleast_2d(values[name])[:, np.newaxis, :]
        with np.errstate(invalid="ignore"):
            unit = np.where(moving, per_axis * inverse, np.inf)
        return np.asarray(unit, dtype=np.float64)

    binding = None
    if any(q.name == ACCELERATION.name for q in family.quantities):
        binding = over_axes(ACCELERATION.name).argmin(axis=-1)
    out = {}
    for quantity in family.quantities:
        if quantity.kind is Kind.LIMIT:
            unit = over_axes(quantity.name).min(axis=-1)
        else:
            per_axis = np.atleast_2d(values[quantity.name])[:, np.newaxis, :]
            each = np.where(moving, per_axis, 0.0)
            if binding is None or quantity.kind is Kind.SHARED:
                unit = each.max(axis=-1)
            else:
                each, at = np.broadcast_arrays(each, binding[..., np.newaxis])
                unit = np.take_along_axis(each, at[..., :1], axis=-1)[..., 0]
        out[quantity.name] = unit.ravel()
    sizes = {len(column) for column in out.values()}
    longest = max(sizes)
    return {
        name: column if len(column) == longest else np.tile(column, longest // len(column))
        for name, column in out.items()
    }
