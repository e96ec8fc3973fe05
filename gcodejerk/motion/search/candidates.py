"""What many candidates leave, fast: symmetric profiles and cascades by the thousand.

This module owns the evaluation that searches are made of: hundreds of candidates a move, at many
frequencies within a band each. It computes in single precision, which costs a fiftieth of double
precision and errs by some 1e-5 of what a candidate does to a mode; what a search has chosen is
judged again in double precision, and nothing that is reported comes from here.

Rule: only magnitudes are computed, squared, and no complex number is built.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.objective import Objective

Single = NDArray[np.float32]

BLOCK = 1 << 14
"""Poles times candidates at a time, about: what comes of them stays in the processor's cache."""

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
    T1, Ta, T2 : ndarray, shape (..., n)
        Of the ramps of profiles for each of n moves; T1 and T2 above zero. [s]
    total : ndarray, shape (n,)
        T_SUM. [s]
    objective : Objective
        Of the n moves.
    bound : ndarray, shape (..., n), optional
        What leaves more is infinite: it is given up as soon as some of the modes show that. What
        leaves less is as without a bound, to the last bit; below zero everything is infinite. Where
        poles share a group, nothing is given up. [mm]

    Returns
    -------
    ndarray of float32, shape (..., n)
        [mm]

    Notes
    -----
    The jerk is even about the middle, so its steps come in pairs of opposite sign, at t and T - t.
    With y = T/2 - t a pair adds :math:`q e^{j\omega_d y} - p e^{-j\omega_d y}` times its step, seen
    from the middle, where :math:`p = e^{-\sigma t}` and :math:`q = e^{-\sigma (T - t)}` are what is
    left of the two at the end.
    """
    found = _Worst(objective, T1.shape, bound)
    whole = np.broadcast_to(total, T1.shape).ravel()
    T1, Ta, T2 = (x.ravel() for x in (T1, Ta, T2))
    ramp, area = T1 + Ta + T2, Ta + 0.5 * (T1 + T2)
    moment = T1 * T1 / 3.0 + Ta * (T1 + 0.5 * Ta) + 0.5 * T2 * (T1 + Ta + T2 / 3.0)
    acceleration = 1.0 / (area * whole - 2.0 * moment)
    up, down = (acceleration / T1).astype(np.float32), (acceleration / T2).astype(np.float32)
    moments = np.stack([T1, T1 + Ta, ramp])
    t, rest = moments.astype(np.float32), (whole - moments).astype(np.float32)
    jerk = np.stack([-up, -down, down])
    begin, end = np.zeros(len(total), dtype=np.float32), total.astype(np.float32)
    for block, sigma, omega, scale in found.blocks():
        if (kept := found.kept()) is not None:
            up, t, rest, jerk = up[kept], t[:, kept], rest[:, kept], jerk[:, kept]
            if not len(up):
                break
        # The first pair, at the beginning and the end, depends on the move alone.
        first = from_middle(begin, end, sigma, omega)
        deep = None if sigma is None else sigma[:, np.newaxis]
        others = from_middle(t, rest, deep, omega[:, np.newaxis])
        squares = []
        for own, three in zip(first, others, strict=True):
            if own is not None and three is not None:
                three *= jerk
                part = found.times(own, up)
                for pair in range(3):
                    part += three[:, pair]
                part *= part
                squares.append(part)
        found.add(block, sum(squares[1:], squares[0]), scale**2 * omega)
    return found.displacement()


def from_middle(
    t: Single, rest: Single, sigma: Single | None, omega: Single
) -> tuple[Single | None, Single]:
    """What a pair of unit steps of the jerk at t and at T - t does, seen from the middle of T.

    Parameters
    ----------
    t, rest : ndarray of float32
        The moment, and T less it. [s]
    sigma : ndarray of float32 or None
        Of the poles, in a shape that broadcasts with that of t; None without damping. [1/s]
    omega : ndarray of float32
        Of the poles, as `sigma`. [1/s]

    Returns
    -------
    tuple of ndarray of float32
        Real part (None: without damping it is zero) and imaginary part, as in `symmetric_worst`.
    """
    phase = (rest - t) * (np.float32(0.5) * omega)
    if sigma is None:
        odd = np.sin(phase, out=phase)
        odd *= np.float32(2.0)
        return None, odd
    early, late = np.exp(t * -sigma), np.exp(rest * -sigma)
    even = late - early
    even *= np.cos(phase)
    late += early
    late *= np.sin(phase, out=phase)
    return even, late


def step_weights(objective: Objective) -> Single:
    """What turns responses to steps of the jerk into displacements, shape (p, n) [mm s^3]."""
    weight = objective.weights / (np.abs(objective.poles) ** 2 * objective.poles.imag)
    return np.ascontiguousarray(weight.T, dtype=np.float32)


def cascade_worst(widths: tuple[Array, ...], objective: Objective) -> Single:
    r"""Largest residual displacement of cascades of moving averages.

    Parameters
    ----------
    widths : tuple of ndarray, shape (..., n)
        Of the boxes, above zero. [s]
    objective : Objective
        Of n moves.

    Returns
    -------
    ndarray of float32, shape (..., n)
        [mm]

    Notes
    -----
    A box of width w leaves :math:`|1 - e^{\lambda w}| / |\lambda w|` of a mode, the square of whose
    numerator is :math:`(1 - e)^2 + 4 e \sin^2(\omega_d w/2)` with :math:`e = e^{-\sigma w}`: no
    difference of nearly equal numbers where a box is as wide as a period.
    """
    single = [w.ravel().astype(np.float32) for w in widths]
    found = _Worst(objective, widths[0].shape)
    for block, sigma, omega, scale in found.blocks():
        square = np.ones(1, dtype=np.float32)
        for w in single:
            sine = np.sin(w * (np.float32(0.5) * omega))
            sine *= sine
            if sigma is not None:
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

    With a bound, candidates beyond it are given up on the way, or at the end. The moves of
    candidates change fastest.

    Rule: what comes of a candidate depends on none that is evaluated beside it.
    """

    def __init__(
        self, objective: Objective, shape: tuple[int, ...], bound: Array | None = None
    ) -> None:
        self.poles, self.weights = objective.poles, objective.weights
        self.shape, self.moves = shape, shape[-1]
        self.starts = np.diff(objective.group, prepend=-1) != 0
        self.worst = np.zeros(math.prod(shape), dtype=np.float32)
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

    def times(self, of_moves: Single, of_candidates: Single) -> Single:
        """Numbers of moves, shape (p, n), times those of their candidates, of one pole or of p."""
        if self.index is not None:
            return of_moves[:, self.index % self.moves] * of_candidates
        # Moves side by side: what belongs to one is not written once for each of its candidates.
        apart = of_candidates.reshape(*of_candidates.shape[:-1], -1, self.moves)
        return (of_moves[:, np.newaxis] * apart).reshape(len(of_moves), -1)

    def blocks(self) -> Iterator[tuple[slice, Single | None, Single, Single]]:
        """Poles in blocks, with -Re, Im and modulus of each, shape (p, 1) [1/s].

        Instead of -Re, None where no pole has damping.
        """
        damped = bool(self.poles.real.any())
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
            yield block, sigma if damped else None, omega, scale

    def add(self, block: slice, square: Single, scale: Single) -> None:
        """Take the squared responses of a block, shape (p, m).

        Divided by the square of `scale`, shape (p, 1), they are squares of displacements.
        """
        weight = self.weights[:, block].T.astype(np.float32) / scale
        square = self.times(weight * weight, square)
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
        out = np.full(math.prod(self.shape), np.inf, dtype=np.float32)
        out[self.index] = left
        return out.reshape(self.shape)
