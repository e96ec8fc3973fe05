r"""Measured frequency responses, turned into the free decays that they are the spectra of.

A frequency response on an even grid from 0 is the spectrum of an impulse response: a free decay.
Where it has not died away within the grid's period T it is wound around, and that only changes its
amplitudes,

.. math:: \sum_n e^{\lambda (t + n T)} = e^{\lambda t} / (1 - e^{\lambda T}).

So the poles are those of the machine, whatever the grid, and are found as those of any decay
(`ringing`).

What the grid cuts off above its last line rings at both ends of the decay, which are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.identification.decays import Decay, Search
from gcodejerk.identification.record import LEAST_SAMPLES, Record, RecordError
from gcodejerk.identification.ringing import take_apart
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.threads import one_thread

EVEN = 1e-3
"""What steps of frequency may differ by, of their mean."""
MISSING = 0.1
"""Of the grid, that may be missing below its first line."""
FIRST, LAST = 0.004, 0.02
"""Of the decay, that is left out at both ends."""
UNKNOWN_NOISE = 0.01
"""Of the decay's strength, taken for its noise at first; then what its modes leave."""


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """What c sensors answer to a force or to a command, at f frequencies.

    Attributes
    ----------
    name : str
        What messages call it.
    frequency : ndarray, shape (f,)
        [Hz]
    channels : tuple of str, length c
    values : ndarray of complex, shape (c, f)
        Accelerations, over whatever it was.
    """

    name: str
    frequency: NDArray[np.float64]
    channels: tuple[str, ...]
    values: Complex


def take_response(response: FrequencyResponse, band: tuple[float, float]) -> tuple[Record, Search]:
    """A frequency response as a record with one decay.

    Parameters
    ----------
    response : FrequencyResponse
    band : (float, float)
        Frequencies to look for. [Hz]

    Returns
    -------
    (Record, Search)
        Of its impulse response, whose amplitudes mean nothing.

    Raises
    ------
    RecordError
        Its lines are not even, do not begin near 0, or are too few.
    """
    name, f = response.name, response.frequency
    step = float(np.diff(f).mean()) if len(f) > 1 else 0.0
    if len(f) < LEAST_SAMPLES or step <= 0.0:
        raise RecordError(
            f"{name} has {len(f)} rising lines", f"at least {LEAST_SAMPLES} are needed"
        )
    if np.abs(np.diff(f) - step).max() > EVEN * step:
        raise RecordError(f"{name} has lines that are not even", "export it on an even grid")
    missing = round(float(f[0]) / step)
    if missing > MISSING * len(f):
        raise RecordError(
            f"{name} begins at {f[0]:g} Hz: what is below is missing", "export it from 0 Hz on"
        )
    if not np.isfinite(response.values).all():
        raise RecordError(f"{name} holds what is no number", "export it again")
    whole = np.pad(response.values, ((0, 0), (missing, 0)))
    impulse = np.fft.irfft(whole, axis=1)
    rate = impulse.shape[1] * step
    count = impulse.shape[1]
    first, last = int(np.ceil(FIRST * count)), int(np.ceil(LAST * count))
    values = impulse[:, first : count - last]
    noise = UNKNOWN_NOISE * values.std(axis=1)
    with one_thread():
        for _ in range(2):
            taken = take_apart(values, rate, noise, band)
            noise = np.maximum((values - taken.fit).std(axis=1), 1e-9 * values.std(axis=1))
    begin, end = first / rate, (count - last) / rate
    record = Record(
        name, rate, begin, response.channels, values, np.zeros(values.shape[1], dtype=np.bool_),
        ("a frequency response: its decay is the inverse Fourier transform",),
    )  # fmt: skip
    decays = (Decay(0, begin, begin, end, taken),) if taken.rings else ()
    why = () if taken.rings else (f"no modes from {band[0]:g} to {band[1]:g} Hz",)
    return record, Search(decays, 1, noise, why)
