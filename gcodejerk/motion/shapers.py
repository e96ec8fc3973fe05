r"""Input shapers: what today's controllers do against vibration, at the cost of time.

This module owns the shapers that designs are compared with. Each replaces a move by a sum of
delayed copies of itself, with amplitudes that add up to 1; the move takes longer by the last delay.
For a mode of damped period T_d = 1/(f sqrt(1 - zeta^2)) and K = exp(-zeta pi / sqrt(1 - zeta^2)):

======== ====================== ================================================================
name     delays                 amplitudes, before they are divided by their sum
======== ====================== ================================================================
zv       0, T_d/2               1, K
zvd      0, T_d/2, T_d          1, 2 K, K^2
ei       0, T_d/2, T_d          (1 + V)/4, (1 - V) K/2, (1 + V) K^2/4, with V = 0.05
mzv      0, 3 T_d/8, 3 T_d/4    1 - 1/sqrt 2, (sqrt 2 - 1) k, (1 - 1/sqrt 2) k^2, k = K^(3/4)
posicast 0, T_d/2               1/(1 + d), d/(1 + d), with the overshoot d = K
fir      0 to T_d, evenly       equal: a moving average over one period
======== ====================== ================================================================

Sources: Singer and Seering, J. Dyn. Sys. Meas. Control 112 (1990) 76-82 (zv, zvd); Singhose,
Seering and Singer, J. Mech. Des. 116 (1994) 654-659 (ei); Klipper, klippy/extras/shaper_defs.py
(mzv, and the damped ei); Smith, Proc. IRE 45 (1957) 1249-1255 (posicast, which for one mode is zv
by another road).

Rule: a controller's shaper knows one frequency, and by default nothing of the damping, as the
reference figures of the method do.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.errors import PlanError
from gcodejerk.motion.families.filtered import shaped_profiles
from gcodejerk.motion.families.filters import impulses
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.residual import mode_poles

SHAPERS = ("zv", "zvd", "ei", "mzv", "fir", "posicast")
"""Names of the shapers."""
AVERAGED = 128
"""Parts of a moving average: its residual is right to (pi f / f0 / AVERAGED)^2 / 3."""


def shaper_impulses(name: str, frequency: float, damping: float = 0.0) -> tuple[Array, Array]:
    """Delays and amplitudes of a shaper.

    Parameters
    ----------
    name : str
        One of `SHAPERS`.
    frequency : float
        That it is made for. [Hz]
    damping : float, optional
        That it is made for, at least 0 and below 1. [-]

    Returns
    -------
    delays, amplitudes : ndarray
        [s], and shares that add up to 1. [-]

    Raises
    ------
    PlanError
        There is no such shaper, or no such mode.

    Examples
    --------
    >>> delays, amplitudes = shaper_impulses("zv", 50.0)
    >>> delays.tolist(), amplitudes.tolist()
    ([0.0, 0.01], [0.5, 0.5])
    """
    if name not in SHAPERS:
        raise PlanError(f"there is no shaper {name!r}", f"choose one of {', '.join(SHAPERS)}")
    if name == "fir":
        # Half of each end's part: the sum of a trapezoid rule, exactly null at the frequency.
        period = 2.0 * np.pi / complex(mode_poles(frequency, damping)).imag
        amplitudes = np.ones(AVERAGED + 1)
        amplitudes[[0, -1]] = 0.5
        return np.linspace(0.0, period, AVERAGED + 1), amplitudes / AVERAGED
    return impulses("zv" if name == "posicast" else name, frequency, damping)


def shaped_profile(
    profile: Profiles, name: str, frequency: float, damping: float = 0.0
) -> Profiles:
    """One profile behind a shaper.

    Parameters
    ----------
    profile : Profiles
        One profile.
    name, frequency, damping
        As in `shaper_impulses`.

    Returns
    -------
    Profiles
        One profile, longer by the last delay.

    Raises
    ------
    PlanError
        As `shaper_impulses`.
    """
    delays, amplitudes = shaper_impulses(name, frequency, damping)
    return shaped_profiles(profile, delays[np.newaxis], amplitudes[np.newaxis])
