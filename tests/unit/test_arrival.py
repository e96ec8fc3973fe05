"""What one move leaves in bands of frequency, by quadrature over the acceleration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.planning.arrival import BANDS, _peak, worst_in_bands
from gcodejerk.planning.plan import plan_moves

MACHINE = Machine.loads(
    """
interval: 0.001
positioning: linear
axes:
  X:
    rapid: {velocity: 300, acceleration: 2500, jerk: 6.0e+4}
    modes:
      - {frequency: 27, damping: 0.03, participation: 0.7}
      - {frequency: 61, damping: 0.01, participation: 1.9}
"""
)
LENGTH = 13.7


def left(profile, frequency, damping):
    """Displacement that a mode of participation 1 keeps of a unit move, by the trapezoidal rule."""
    total = float(profile.total[0])
    t = np.linspace(0.0, total, 200_001)
    k = np.clip(np.searchsorted(profile.begin, t, side="right") - 1, 0, None)
    a = profile.acceleration[k] + profile.jerk[k] * (t - profile.begin[k])
    omega = 2.0 * np.pi * frequency
    damped = omega * np.sqrt(1.0 - damping**2)
    kernel = np.exp((-damping * omega + 1j * damped) * (total - t))
    return abs(trapezoid(a * kernel, t)) / damped


@pytest.mark.parametrize("band", range(len(BANDS)))
def test_the_worst_in_a_band_is_that_of_a_dense_scan_in_displacement_and_acceleration(band):
    row = np.zeros((1, 9))
    row[0, AXES.index("X")] = LENGTH
    plans = plan_moves(row, MACHINE, "conventional")
    modes = plans.modes
    weights = plans.share @ modes.participation.T
    displacement, acceleration = worst_in_bands(plans.profiles, weights, modes)
    worst = np.zeros(2)
    for mode in MACHINE.axis("X").modes:
        size = LENGTH * dict(mode.participation)["X"]
        for off in np.linspace(1.0 - BANDS[band], 1.0 + BANDS[band], 41):
            D = size * left(plans.profiles, mode.frequency * off, mode.damping)
            felt = D * (2.0 * np.pi * mode.frequency * off) ** 2
            worst = np.maximum(worst, [D, felt])
    assert displacement[band] == pytest.approx(worst[0], rel=2e-3)
    assert acceleration[band] == pytest.approx(worst[1], rel=2e-3)


@given(
    # Of the half width of the widest band: within, at the ends of, and outside the narrower one.
    at=st.floats(-1.3, 1.3),
    top=st.floats(1.0, 9.0),
    curvature=st.floats(0.01, 0.5),
    half=st.integers(1, 7).map(lambda n: 2 * n),
    band=st.sampled_from(BANDS),
)
def test_the_largest_of_a_parabola_is_exact_wherever_the_points_lie(at, top, curvature, half, band):
    x = np.linspace(-1.0, 1.0, 2 * half + 1)
    width = band / max(BANDS)
    # The largest that the band holds; where it is at an end, that is a point.
    inside = min(max(at, -width), width)
    found = _peak(top - curvature * (x - at) ** 2, band)
    assert found == pytest.approx(np.sqrt(top - curvature * (inside - at) ** 2), rel=1e-12)
