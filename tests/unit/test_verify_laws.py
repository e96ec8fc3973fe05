"""The control's own rapids by a law or a filter: planning and verification agree, two ways."""

import numpy as np
import pytest

from gcodejerk import process, verify
from gcodejerk.axes import AXES
from gcodejerk.machine import FILTERS, LAWS, Machine, machine_yaml
from gcodejerk.motion import mode_poles, profiles_response, sample_profiles
from gcodejerk.motion.families import FAMILIES
from gcodejerk.motion.families.filters import KINDS
from gcodejerk.motion.families.filters import impulses as shaper
from gcodejerk.planning.conventional import conventional_limits, todays_profiles
from gcodejerk.verification.physics.laws import OwnRapids
from gcodejerk.verification.physics.shapers import impulses_of, lasts, passes

OWN = {
    "averaged-trapezoid": "second_average: {t:g}",
    "time-constants": "first_average: 0.06, second_average: {t:g}",
    "four-ramp": "deceleration: {a:g}, rise: {t:g}, fall: 0.03, braking_rise: 0.02, "
                 "braking_fall: 0.01",
    "two-stage": "changeover: 50, upper_acceleration: {a:g}",
    "quintic": "jerk: 5.0e+5",
    "poly5": "",
    "poly6": "overshoot: 1.6",
    "notch-ramp": "notch: 31",
}  # fmt: skip
SHARE = np.zeros((5, 9))
SHARE[:, AXES.index("X")] = [1.3, 200.0, 0.0, -40.0, 12.0]
SHARE[:, AXES.index("Z")] = [0.0, 70.0, 8.0, 41.0, -0.4]


def machine(planner, behind="", positioning="linear"):
    """X and Z with rapids of their own."""

    def rapid(v, a, t):
        said = [f"velocity: {v}, acceleration: {a}, planner: {planner}"]
        said += [OWN.get(planner, "").format(t=t, a=0.7 * a), behind]
        return ", ".join(part for part in said if part)

    return Machine.loads(f"""
interval: 0.001
positioning: {positioning}
axes:
  X:
    rapid: {{{rapid(600, 5000, 0.013)}}}
    limit: {{acceleration: 9000, jerk: 5.0e+6}}
    modes: [{{frequency: 30, damping: 0.02}}]
  Z:
    rapid: {{{rapid(400, 3000, 0.021)}}}
    limit: {{acceleration: 9000, jerk: 5.0e+6}}
    modes: [{{frequency: 41, damping: 0.04}}]
""")


def test_machine_files_name_every_family_and_every_filter():
    assert set(LAWS) | {"trapezoidal", "jerk-limited"} == set(FAMILIES)
    assert FILTERS == KINDS
    for name, keys in LAWS.items():
        assert {q.name for q in FAMILIES[name].quantities} - {"velocity", "acceleration"} == set(
            keys
        )
    assert set(OWN) == set(LAWS)


SHAPED = ["", "filter: {type: average, time: 0.023}", "filter: {type: triangle, time: 0.011}",
          "filter: {type: zvd, frequency: 28, damping: 0.06}"]  # fmt: skip


@pytest.mark.parametrize("behind", SHAPED)
@pytest.mark.parametrize("planner", [*LAWS, "trapezoidal"])
@pytest.mark.parametrize("positioning", ["linear", "independent"])
def test_both_have_the_same_rapids(planner, behind, positioning):
    own = machine(planner, behind, positioning)
    poles = mode_poles([9.0, 30.0, 88.0], [0.0, 0.02, 0.05])
    limits = np.full((3, len(SHARE), 9), np.inf)
    with np.errstate(divide="ignore"):
        for axis in own.axes:
            k = AXES.index(axis.name)
            usual = axis.conventional()
            for row, x in enumerate((usual.velocity, usual.acceleration, usual.jerk)):
                limits[row, :, k] = x / np.abs(SHARE[:, k])
    rapids = OwnRapids(SHARE, own, limits)
    for axis in ("X", "Z"):
        k = AXES.index(axis)
        moves = np.flatnonzero(SHARE[:, k])
        share = SHARE[moves]
        if positioning == "independent":
            share = np.where(np.arange(9) == k, share, 0.0)
        _, profiles = todays_profiles(own, conventional_limits(own, share), share)
        assert rapids.totals()[moves, k] == pytest.approx(profiles.total, rel=1e-9, abs=2e-9)
        peak = profiles.peak_velocity
        for m, pole in enumerate(poles):
            want = profiles_response(profiles, poles)[:, m]
            off = np.abs(rapids.response(k, complex(pole))[moves] - want)
            assert (off < 2e-3 * peak).all()
        moments = np.tile(np.arange(400), (len(moves), 1))
        sampled, _ = sample_profiles(profiles, moments, 0.0017)
        for i, move in enumerate(moves):
            there = rapids.position(k, 0.0017 * moments[i], np.full(400, move))
            assert there == pytest.approx(sampled[i], abs=3e-4)


@pytest.mark.parametrize("kind", FILTERS)
def test_both_have_the_same_filters(kind):
    timed = kind in ("average", "triangle")
    text = f"{{type: {kind}, time: 0.023}}" if timed else (
        f"{{type: {kind}, frequency: 29, damping: 0.07}}")  # fmt: skip
    behind = machine("trapezoidal", f"filter: {text}").axis("X").filter
    delays, shares = impulses_of(behind)
    assert shares.sum() == pytest.approx(1.0)
    if not timed:
        want = shaper(kind, 29.0, 0.07)
        assert delays == pytest.approx(want[0], abs=1e-12)
        assert shares == pytest.approx(want[1], abs=1e-12)
    pole = complex(mode_poles(17.0, 0.03))
    mean = np.sum(shares * np.exp(pole * (delays[-1] - delays)))
    assert passes(behind, pole) == pytest.approx(mean, abs=2e-3)
    assert lasts(behind) == pytest.approx(delays[-1])


@pytest.mark.parametrize("behind", ["", SHAPED[1], SHAPED[3]])
@pytest.mark.parametrize("planner", LAWS)
def test_what_is_written_for_such_a_machine_is_proven(planner, behind):
    program = b"G90 G21\nG0 X0 Z0\nG0 X30 Z5\nG1 X31 F500\nG0 Z40\nG0 X-60\nG0 Z21\nM2\n"
    for positioning in ("linear", "independent"):
        own = machine(planner, behind, positioning)
        result = process(program, own)
        assert result.plans.planned.sum() >= 1
        assert result.output is not None
        assert verify(program, result.output, own).ok


@pytest.mark.parametrize("behind", ["", *SHAPED[1:]])
@pytest.mark.parametrize("planner", [*LAWS, "trapezoidal", "linuxcnc-2.9"])
def test_such_a_machine_is_written_as_it_was_read(planner, behind):
    own = machine(planner, behind)
    assert Machine.loads(machine_yaml(own)) == own
    assert not own.warnings


KEPT = """
interval: 0.001
positioning: independent
spindle: mill
axes:
  X:
    rapid: {velocity: 79.16, acceleration: 919.6, planner: poly6, overshoot: 1.401, FILTER}
    limit: {acceleration: 2758.8, jerk: 413820.0}
    modes:
      - {frequency: 85.52, damping: 0.002994, participation: 0.07727}
      - {frequency: 260.7, damping: 0.0, participation: 0.1415}
  Z:
    rapid: {velocity: 347.7, acceleration: 849.0, planner: poly6, overshoot: 1.401, FILTER}
    limit: {acceleration: 1698.0}
    modes: [{frequency: 17.62, damping: 0.00106, participation: 0.281}]
design: {profile: cascade, band: 0.05, guard: 0.0, max_extension: 0.0}
program: {start: {X: 0.0, Z: 0.0}, startup: "G21 G90"}
"""


def test_an_axis_that_keeps_an_asymmetric_rapid_of_its_own_is_accepted():
    """Under independent positioning one axis gains, and the other stays as it is."""
    behind = "filter: {type: 3hei, frequency: 17.72, damping: 0.05}"
    own = Machine.loads(KEPT.replace("FILTER", behind))
    program = b"G91 G21\nG0 X-2.7 Z-2.7\nM2\n"
    result = process(program, own, controller="grbl", verify=False)
    assert result.planned
    assert verify(program, result.output, own, controller="grbl").ok
