"""What many candidates leave, fast: symmetric profiles and cascades by the thousand.

This module owns the evaluation that searches are made of: hundreds of candidates a move, at many
frequencies within a band each. It computes in single precision, which costs a fiftieth of double
precision and errs by some 1e-5 of what a candidate does to a mode; what a search has chosen is
judged again in double precision, and nothing that is reported comes from here.

Rule: only magnitudes are computed, squared, and no complex number is built.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.objective import Objective

Single = NDArray[np.float32]

BLOCK = 1 << 14
"""Numbers in an array at a time, about: a dozen of them stay in the processor's cache."""

BEYOND = 1.0 + 1e-5
"""A candidate beyond a bound by this factor is given up: more than single precision errs."""
WORTHWHILE = 0.7
"""Share of the candidates that are left, up to which the others are taken out."""
AT_ONCE = 3
"""Poles after which candidates are compared with their bounds."""
SMALL = 1 << 12
"""More poles, where they and the candidates are no more numbers than this: calls would cost more
than what is given up."""


def symmetric_worst(
    T1: Array,
    Ta: Array,
    T2: Array,
    total: Array,
    objective: Objective,
    bound: Array | None = None,
) -> Single:
    r"""Largest residual displacement of symmetric profiles.

    Parameters
    ----------
    T1, Ta, T2 : ndarray, shape (n, k)
        Of the ramps of k profiles for each of n moves; T1 and T2 above zero. [s]
    total : ndarray, shape (n,)
        T_SUM. [s]
    objective : Objective
        Of the n moves.
    bound : ndarray, shape (n, k), optional
        What leaves more is infinite: it is given up as soon as some of the modes show that. What
        leaves less is as without a bound, to the last bit; below zero everything is infinite. Where
        poles share a group, nothing is given up. [mm]

    Returns
    -------
    ndarray of float32, shape (n, k)
        [mm]

    Notes
    -----
    The jerk is even about the middle, so its steps come in pairs of opposite sign, at t and T - t.
    With y = T/2 - t a pair adds :math:`q e^{j\omega_d y} - p e^{-j\omega_d y}` times its step, seen
    from the middle, where :math:`p = e^{-\sigma t}` and :math:`q = e^{-\sigma (T - t)}` are what is
    left of the two at the end.
    """
    n, k = T1.shape
    T1, Ta, T2 = (x.ravel() for x in (T1, Ta, T2))
    whole = np.repeat(total, k)
    ramp, area = T1 + Ta + T2, Ta + 0.5 * (T1 + T2)
    moment = T1 * T1 / 3.0 + Ta * (T1 + 0.5 * Ta) + 0.5 * T2 * (T1 + Ta + T2 / 3.0)
    acceleration = 1.0 / (area * whole - 2.0 * moment)
    up, down = (acceleration / T1).astype(np.float32), (acceleration / T2).astype(np.float32)
    pairs = [
        (t.astype(np.float32), (whole - t).astype(np.float32), jerk)
        for t, jerk in ((T1, -up), (T1 + Ta, -down), (ramp, down))
    ]
    middle = (0.5 * total).astype(np.float32)
    found = _Worst(objective, n, k, bound)
    for block, sigma, omega, scale in found.blocks():
        if (kept := found.kept()) is not None:
            up = up[kept]
            pairs = [(t[kept], rest[kept], jerk[kept]) for t, rest, jerk in pairs]
            if not len(up):
                break
        # The first pair, at the beginning and the end, depends on the move alone.
        phase, late = middle * omega, np.exp(-sigma * (2.0 * middle))
        real = found.spread((late - 1.0) * np.cos(phase)) * up
        imaginary = found.spread((late + 1.0) * np.sin(phase)) * up
        for t, rest, jerk in pairs:
            even, odd = from_middle(t, rest, sigma, omega)
            if even is not None:
                real += even * jerk
            imaginary += odd * jerk
        found.add(block, real * real + imaginary * imaginary, scale**2 * omega)
    return found.displacement()


def from_middle(
    t: Single, rest: Single, sigma: Single, omega: Single
) -> tuple[Single | None, Single]:
    """What a pair of unit steps of the jerk at t and at T - t does, seen from the middle of T.

    Parameters
    ----------
    t, rest : ndarray of float32
        The moment, and T less it. [s]
    sigma, omega : ndarray of float32
        Of the poles; shapes that broadcast with that of t. [1/s]

    Returns
    -------
    tuple of ndarray of float32
        Real part (None: without damping it is zero) and imaginary part, as in `symmetric_worst`.
    """
    phase = (rest - t) * (np.float32(0.5) * omega)
    if not sigma.any():
        return None, np.float32(2.0) * np.sin(phase)
    early, late = np.exp(t * -sigma), np.exp(rest * -sigma)
    return (late - early) * np.cos(phase), (late + early) * np.sin(phase)


def step_weights(objective: Objective) -> Single:
    """What turns responses to steps of the jerk into displacements, shape (p, n) [mm s^3]."""
    weight = objective.weights / (np.abs(objective.poles) ** 2 * objective.poles.imag)
    return np.ascontiguousarray(weight.T, dtype=np.float32)


def cascade_worst(widths: tuple[Array, ...], objective: Objective) -> Single:
    r"""Largest residual displacement of cascades of moving averages.

    Parameters
    ----------
    widths : tuple of ndarray, shape (n, k)
        Of the boxes, above zero. [s]
    objective : Objective
        Of n moves.

    Returns
    -------
    ndarray of float32, shape (n, k)
        [mm]

    Notes
    -----
    A box of width w leaves :math:`|1 - e^{\lambda w}| / |\lambda w|` of a mode, the square of whose
    numerator is :math:`(1 - e)^2 + 4 e \sin^2(\omega_d w/2)` with :math:`e = e^{-\sigma w}`: no
    difference of nearly equal numbers where a box is as wide as a period.
    """
    single = [w.ravel().astype(np.float32) for w in widths]
    found = _Worst(objective, *widths[0].shape)
    for block, sigma, omega, scale in found.blocks():
        square = np.ones(1, dtype=np.float32)
        for w in single:
            sine = np.sin(w * (np.float32(0.5) * omega))
            sine *= sine
            if sigma.any():
                rest = np.exp(w * -sigma)
                sine *= np.float32(4.0) * rest
                sine += (np.float32(1.0) - rest) ** 2
            else:
                sine *= np.float32(4.0)
            square = square * (sine / (w * scale) ** 2)
        found.add(block, square, omega / scale)
    return found.displacement()


class _Worst:
    """The largest of the groups of poles, of which a block at a time is evaluated.

    With a bound, candidates beyond it are given up on the way, or at the end.

    Rule: what comes of a candidate depends on none that is evaluated beside it.
    """

    def __init__(self, objective: Objective, n: int, k: int, bound: Array | None = None) -> None:
        self.poles, self.weights = objective.poles, objective.weights
        self.shape, self.each = (n, k), k
        self.starts = np.diff(objective.group, prepend=-1) != 0
        self.worst = np.zeros(n * k, dtype=np.float32)
        self.carried: Single = self.worst
        self.index: NDArray[np.intp] | None = None
        """Those that are left, where some were given up."""
        self.bound: Array | None = None
        # Of a group of several poles the sum alone tells.
        if bound is not None and self.starts.all():
            self.bound = np.where(bound < 0.0, -1.0, (bound * BEYOND) ** 2).ravel()

    def kept(self) -> NDArray[np.intp] | None:
        """Of the candidates at hand, those that go on; None where all do, or nearly all."""
        if self.bound is None:
            return None
        kept = np.flatnonzero(self.worst <= self.bound)
        if len(kept) > WORTHWHILE * len(self.worst):
            return None
        self.worst, self.bound = self.worst[kept], self.bound[kept]
        self.index = kept if self.index is None else self.index[kept]
        self.carried = self.worst
        return kept

    def spread(self, of_moves: Single) -> Single:
        """Numbers of moves, shape (p, n), as those of their candidates."""
        if self.index is None:
            return np.repeat(of_moves, self.each, axis=1)
        return of_moves[:, self.index // self.each]

    def blocks(self) -> Iterator[tuple[slice, Single, Single, Single]]:
        """Poles in blocks, with -Re, Im and modulus of each, shape (p, 1) [1/s]."""
        begin = 0
        while begin < len(self.poles):
            size = max(1, BLOCK // max(self.worst.size, 1))
            if self.bound is not None:
                size = min(size, max(AT_ONCE, SMALL // max(self.worst.size, 1)))
            block = slice(begin, begin + size)
            begin += size
            poles = self.poles[block, np.newaxis]
            sigma, omega, scale = (
                x.astype(np.float32) for x in (-poles.real, poles.imag, np.abs(poles))
            )
            yield block, sigma, omega, scale

    def add(self, block: slice, square: Single, scale: Single) -> None:
        """Take the squared responses of a block, shape (p, n k).

        Divided by the square of `scale`, shape (p, 1), they are squares of displacements.
        """
        weight = self.weights[:, block].T.astype(np.float32) / scale
        square = square * self.spread(weight * weight)
        for begins, own in zip(self.starts[block].tolist(), square, strict=True):
            if not begins:
                own += self.carried
            self.carried = own
            # A sum that goes on is no larger than the whole, so it may be compared.
            np.maximum(self.worst, own, out=self.worst)

    def displacement(self) -> Single:
        """The worst of each candidate, infinite where it was given up [mm]."""
        left = np.sqrt(self.worst)
        if self.bound is not None:
            left[self.worst > self.bound] = np.inf
        if self.index is None:
            return left.reshape(self.shape)
        out = np.full(self.shape[0] * self.shape[1], np.inf, dtype=np.float32)
        out[self.index] = left
        return out.reshape(self.shape)
