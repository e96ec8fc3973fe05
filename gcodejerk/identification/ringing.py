r"""Free vibration taken apart: frequencies, damping ratios and amplitudes of what rings.

A free decay seen by c sensors is :math:`y(t) = \sum_k v_k e^{\lambda_k t}`. Its samples in a block
Hankel matrix have rank 2m for m modes; one step of time apart, its two halves differ by the poles
alone (the eigensystem realization algorithm: J.-N. Juang, R. S. Pappa, J. Guidance 8, 1985). How
many modes there are is not assumed: what comes back in order after order is one (stabilization).

The uncertainty of a mode of amplitude A [mm/s^2] and decay rate s in noise of one-sided density S
is bounded by (Cramer-Rao, for a decay that is seen whole)

.. math:: \sigma_f = \sqrt{8 S s^3} / (2 \pi A), \qquad \sigma_\zeta = \sqrt{8 S s^3} / (A \omega)

which is what is stated: the matrix pencil is near it where :math:`\sigma_f` is small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex

MOST_ROWS = 220
"""Of the Hankel matrix of one channel; of more, by the square root of their number fewer each."""
ORDERS = tuple(range(2, 26, 2))
SAME_F, SAME_ZETA = 0.01, 0.03
"""A pole has come back if its frequency is so near [-], and its damping ratio [-]."""
BACK = 0.6
"""Of the orders since it first came, in how many a mode comes back."""
TIMES = 4
"""At least so often."""
WELL_DAMPED = 0.25
LEAST_ENERGY = 0.001
"""Of the whole, that a mode has at least."""
CLEAR = 4.0
"""Amplitude over its uncertainty."""


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """One mode of one decay.

    Attributes
    ----------
    frequency, damping : float
        Undamped natural frequency [Hz] and damping ratio [-].
    amplitude : ndarray of complex, shape (c,)
        Of the acceleration in each channel at the decay's begin. [mm/s^2]
    sd_frequency, sd_damping : float
        From the noise. [Hz], [-]
    energy : float
        Its share of the decay's. [-]
    cycles : float
        That the stretch holds of it.
    orders : tuple of int
        In which it came back.
    """

    frequency: float
    damping: float
    amplitude: Complex
    sd_frequency: float
    sd_damping: float
    energy: float
    cycles: float
    orders: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """A decay taken apart.

    Attributes
    ----------
    rings : tuple of Ring
        The lowest frequency first.
    stabilization : tuple of (int, float, float)
        Order, frequency and damping ratio of every pole that came.
    unexplained : float
        Share of the energy that the modes leave. [-]
    fit : ndarray, shape (c, k)
        What they make together. [mm/s^2]
    """

    rings: tuple[Ring, ...]
    stabilization: tuple[tuple[int, float, float], ...]
    unexplained: float
    fit: Array


def take_apart(values: Array, rate: float, noise: Array, band: tuple[float, float]) -> Taken:
    """Find the modes of a free decay.

    Parameters
    ----------
    values : ndarray, shape (c, k)
        Accelerations. [mm/s^2]
    rate : float
        [Hz]
    noise : ndarray, shape (c,)
        Standard deviation of each channel at rest. [mm/s^2]
    band : (float, float)
        Frequencies to look for. [Hz]

    Returns
    -------
    Taken
    """
    # Channels in units of their noise: a quiet one counts for more.
    scale = np.maximum(noise, 1e-12 * np.abs(values).max(initial=1e-300))
    y = values / scale[:, np.newaxis]
    u, pairs = _hankel(y)
    seen: list[tuple[int, float, float]] = []
    for order in ORDERS:
        if order >= u.shape[1]:
            break
        for pole in _poles(u[:, :order], pairs, rate):
            f, zeta = abs(pole) / (2.0 * np.pi), -pole.real / abs(pole)
            # What does not even swing once is drift.
            swings = f * values.shape[1] / rate >= 1.0
            if pole.imag > 0.0 and swings and -0.005 <= zeta < WELL_DAMPED:
                seen.append((order, float(f), float(max(zeta, 0.0))))
    stable = _stable(seen)
    if not stable:
        return Taken((), tuple(seen), 1.0, np.zeros(values.shape))
    poles = np.array([_pole(f, zeta) for f, zeta, _ in stable])
    amplitude, fit = fitted(values, rate, poles)
    left, around = values - fit, values - values.mean(axis=1, keepdims=True)
    whole, rest = (float(((one.T / scale) ** 2).sum()) for one in (around, left))
    unexplained = rest / max(whole, 1e-300)
    rings = []
    energies = _energies(amplitude / scale[:, np.newaxis], poles, values.shape[1] / rate)
    for k, (f, zeta, orders) in enumerate(stable):
        s, omega = zeta * 2.0 * np.pi * f, 2.0 * np.pi * f
        # All channels together, in units of their noise: one channel of that amplitude, noise 1.
        size = float(np.linalg.norm(amplitude[:, k] / scale))
        seen_for = values.shape[1] / rate
        s_seen = max(s, 0.5 / seen_for)
        root = np.sqrt(8.0 * (2.0 / rate) * s_seen**3)
        sd = float(root / max(size, 1e-300))
        ring = Ring(
            f, zeta, amplitude[:, k], sd / (2.0 * np.pi), sd / omega, float(energies[k]),
            f * seen_for, orders,
        )  # fmt: skip
        # What rings outside of the band is part of the fit, and nothing that was asked for.
        if not band[0] <= f <= band[1]:
            continue
        # As many samples of it count as its decay, squared, holds.
        clear = size * np.sqrt(rate / (4.0 * s_seen))
        if ring.energy >= LEAST_ENERGY and clear > CLEAR and ring.sd_frequency < 0.05 * f:
            rings.append(ring)
    return Taken(tuple(sorted(rings, key=lambda one: one.frequency)), tuple(seen), unexplained, fit)


def quick_poles(y: Array, rate: float, order: int, rows: int) -> Complex:
    """Poles of one order that vibrate, from a small Hankel matrix.

    Parameters
    ----------
    y : ndarray, shape (c, k)
        In units of each channel's noise.
    rate : float
        [Hz]
    order : int
        Poles that are looked for.
    rows : int
        Of the matrix.

    Returns
    -------
    ndarray of complex, shape (m,)
        Those above the real axis. [1/s]
    """
    u, channels = _hankel(y, rows)
    order = min(order, u.shape[1], (len(u) - channels) // 2)
    if order < 2:
        return np.zeros(0, dtype=np.complex128)
    poles = _poles(u[:, :order], channels, rate)
    # A pole that grows by noise is one that does not decay.
    poles = poles[(poles.imag > 0.0) & (-poles.real < WELL_DAMPED * np.abs(poles))]
    out: Complex = np.minimum(poles.real, 0.0) + 1j * poles.imag
    return out


def _pole(frequency: float, damping: float) -> complex:
    omega = 2.0 * np.pi * frequency
    return complex(-damping * omega, omega * np.sqrt(1.0 - damping**2))


def _hankel(y: Array, most: int = MOST_ROWS) -> tuple[Array, int]:
    """Left singular vectors of the block Hankel matrix, and the channels in a block."""
    channels, count = y.shape
    rows = min(count // 2, max(8, int(most / np.sqrt(channels))))
    # All of the decay counts, though not from every sample on.
    begins = np.arange(0, count - rows, max(1, (count - rows) // (2 * most)))
    index = np.arange(rows)[:, np.newaxis] + begins
    blocks = y[:, index].transpose(1, 0, 2).reshape(rows * channels, len(begins))
    # Its left singular vectors, from the small square matrix: a tenth of the work.
    s, u = np.linalg.eigh(blocks @ blocks.T)
    order = np.argsort(-s)[: min(max(ORDERS) + 1, len(begins))]
    return u[:, order] * (s[order] > 0.0), channels


def _poles(u: Array, channels: int, rate: float) -> Complex:
    """Poles of one order, from the shift between the halves of the vectors."""
    shift, *_ = np.linalg.lstsq(u[:-channels], u[channels:], rcond=None)
    z = np.linalg.eigvals(shift).astype(np.complex128)
    out: Complex = np.asarray(np.log(z[np.abs(z) > 1e-12]) * rate, dtype=np.complex128)
    return out


def _stable(seen: list[tuple[int, float, float]]) -> list[tuple[float, float, tuple[int, ...]]]:
    """Modes that come back in order after order: frequency, damping ratio, orders."""
    found: list[tuple[float, float, tuple[int, ...]]] = []
    last = max((order for order, _, _ in seen), default=0)
    # From the highest orders, where everything has come that will.
    for _, f, zeta in sorted(seen, key=lambda one: -one[0]):
        if any(abs(f / g - 1.0) < SAME_F for g, _, _ in found):
            continue
        near = [
            (order, g, z)
            for order, g, z in seen
            if abs(g / f - 1.0) < SAME_F and abs(z - zeta) < max(SAME_ZETA, 0.3 * zeta)
        ]
        orders = sorted({order for order, _, _ in near})
        possible = [order for order in ORDERS if orders[0] <= order <= last]
        if len(orders) >= TIMES and len(orders) >= BACK * len(possible):
            # Higher orders model noise, lower ones miss modes: the middle of them.
            found.append(
                (
                    float(np.median([g for _, g, _ in near])),
                    float(np.median([z for _, _, z in near])),
                    tuple(orders),
                )
            )
    return found


def fitted(values: Array, rate: float, poles: Complex) -> tuple[Complex, Array]:
    """Amplitudes of poles by least squares.

    Parameters
    ----------
    values : ndarray, shape (c, k)
        Accelerations. [mm/s^2]
    rate : float
        [Hz]
    poles : ndarray of complex, shape (m,)
        [1/s]

    Returns
    -------
    amplitude : ndarray of complex, shape (c, m)
        At the first sample. [mm/s^2]
    fit : ndarray, shape (c, k)
        What they make together, with a constant. [mm/s^2]
    """
    t = np.arange(values.shape[1]) / rate
    swings = np.exp(np.outer(t, poles))
    basis = np.concatenate([swings.real, -swings.imag, np.ones((len(t), 1))], axis=1)
    solved, *_ = np.linalg.lstsq(basis, values.T, rcond=None)
    m = len(poles)
    amplitude: Complex = (solved[:m] + 1j * solved[m : 2 * m]).T
    return amplitude, (basis @ solved).T


def _energies(amplitude: Complex, poles: Complex, duration: float) -> Array:
    """Share of each mode in the energy of all of them, as long as they were seen."""
    decay = np.maximum(-poles.real, 1e-3 / duration)
    faded = -np.expm1(-2.0 * decay * duration) / decay
    energy = np.linalg.norm(amplitude, axis=0) ** 2 * faded
    out: Array = energy / energy.sum()
    return out
