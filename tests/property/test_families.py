"""Promises of the families, over drawn settings, moves and modes."""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from simulation import (
    DT,
    behind_averages,
    four_ramps,
    left_by,
    marlin,
    quintic,
    two_stages,
)

from gcodejerk.motion import mode_poles, profiles_response
from gcodejerk.motion.families import FAMILIES, Kind
from gcodejerk.motion.families.filtered import averaged_profiles, filtered
from gcodejerk.motion.families.filters import KINDS, length, transfer

PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
drawn = settings(deadline=None, phases=PHASES, max_examples=40)
slow = settings(deadline=None, phases=PHASES, max_examples=15)

frequency = st.floats(3.1, 197.0)
damping = st.one_of(st.just(0.0), st.floats(0.0, 0.2))
time = st.floats(0.0011, 0.083)


@st.composite
def quantities(draw, name):
    """Unit quantities of a family, of moves from a few to a thousand milliseconds."""
    V = draw(st.floats(1.1, 70.0))
    values = {"velocity": V, "acceleration": V / draw(time), "jerk": 0.0}
    values["jerk"] = values["acceleration"] / draw(time)
    out = {}
    for quantity in FAMILIES[name].quantities:
        key = quantity.name
        if key == "overshoot":
            out[key] = draw(st.floats(1.25, 1.875))
        elif key == "notch":
            out[key] = draw(st.floats(7.0, 120.0))
        elif quantity.kind is Kind.TIME:
            out[key] = draw(time)
        elif key == "changeover":
            out[key] = V * draw(st.floats(0.1, 1.3))
        elif key in values:
            out[key] = values[key]
        else:
            out[key] = values["acceleration"] * draw(st.floats(0.3, 3.0))
    return out


anyone = st.sampled_from(sorted(FAMILIES)).flatmap(
    lambda name: st.tuples(st.just(name), quantities(name))
)


def built(name, values):
    return FAMILIES[name].build(**{key: np.array([x]) for key, x in values.items()})


@drawn
@given(law=anyone)
def test_every_rapid_goes_from_rest_to_rest_within_its_limits(law):
    name, values = law
    profile = built(name, values)
    d = profile.duration[-1]
    a, j = profile.acceleration[-1], profile.jerk[-1]
    v = profile.velocity[-1] + (a + 0.5 * j * d) * d
    p = profile.position[-1] + (profile.velocity[-1] + (0.5 * a + j * d / 6.0) * d) * d
    assert p == pytest.approx(1.0, abs=1e-9)
    assert v == pytest.approx(0.0, abs=1e-9 * values["velocity"])
    assert profile.least_velocity[0] >= -1e-9 * values["velocity"]
    assert profile.peak_velocity[0] <= values["velocity"] * (1.0 + 1e-9)
    most = max((values.get(k, 0.0) for k in ("acceleration", "upper_acceleration", "deceleration",
                                             "upper_deceleration")), default=0.0)  # fmt: skip
    if most:
        over = {"poly5": 1.5, "poly6": values.get("overshoot", 1.0)}.get(name, 1.0)
        assert profile.peak_acceleration[0] <= most * over * 1.005
    if "jerk" in values:
        assert profile.greatest_jerk[0] <= values["jerk"] * 1.01


@drawn
@given(law=anyone, by=st.floats(0.3, 3.0))
def test_a_family_knows_no_unit_of_time(law, by):
    """All times longer by a factor, all limits of speed and the rest lower by its powers."""
    name, values = law
    powers = {"velocity": 1, "changeover": 1, "jerk": 3, "notch": 1, "overshoot": 0}
    slower = {}
    for quantity in FAMILIES[name].quantities:
        key = quantity.name
        power = -1 if quantity.kind is Kind.TIME else powers.get(key, 2)
        slower[key] = values[key] / by**power
    assert built(name, slower).total[0] == pytest.approx(by * built(name, values).total[0])


@drawn
@given(law=anyone, kind=st.sampled_from(KINDS), f=frequency, zeta=damping, at=frequency,
       own=damping)  # fmt: skip
def test_a_filter_multiplies_what_a_mode_keeps(law, kind, f, zeta, at, own):
    profile = built(*law)
    x = 1.0 / f if kind in ("average", "triangle") else f
    poles = mode_poles([at], [own])
    want = profiles_response(profile, poles) * transfer(kind, [x], [zeta], poles)
    behind = filtered(profile, kind, x, zeta)
    assert behind.total[0] == pytest.approx(profile.total[0] + length(kind, x, zeta))
    off = abs(profiles_response(behind, poles) - want)[0, 0]
    assert off < 1e-3 * float(profile.peak_velocity[0])


def stepped(name, values):
    """The law as it is described, stepped in time."""
    V, A = values["velocity"], values.get("acceleration", 0.0)
    peak = min(V, A**0.5)
    if name == "four-ramp":
        times = (values[k] for k in ("rise", "fall", "braking_rise", "braking_fall"))
        return four_ramps(V, A, values["deceleration"], *times)
    if name == "two-stage":
        keys = ("acceleration", "upper_acceleration", "deceleration", "upper_deceleration")
        return two_stages(V, *(values[k] for k in keys), values["changeover"])
    return {
        "trapezoidal": lambda: behind_averages(peak, peak / A),
        "averaged-trapezoid": lambda: behind_averages(peak, peak / A, values["second_average"]),
        "time-constants": lambda: behind_averages(
            V, values["first_average"], values["second_average"]
        ),
        "poly5": lambda: marlin(V, A),
        "poly6": lambda: marlin(V, A, values["overshoot"]),
        "quintic": lambda: quintic(V, values["jerk"]),
    }[name]()


STEPPED = ("four-ramp", "two-stage", "trapezoidal", "averaged-trapezoid", "time-constants",
           "poly5", "poly6", "quintic")  # fmt: skip


@slow
@pytest.mark.parametrize("name", STEPPED)
@given(data=st.data(), f=st.floats(3.1, 97.0), zeta=damping)
def test_a_stepped_simulation_leaves_as_much(name, data, f, zeta):
    values = data.draw(quantities(name))
    profile = built(name, values)
    law = stepped(name, values)
    assert len(law) * DT == pytest.approx(float(profile.total[0]), abs=8 * DT)
    mine = abs(profiles_response(profile, mode_poles([f], [zeta])))[0, 0]
    # A ramp of 1 ms has 50 steps; a shorter one is over by as much as a step adds.
    step = DT * max((values[k] for k in values if "celeration" in k), default=0.0)
    off = max(0.03 * values["velocity"], 1.5 * step)
    assert mine == pytest.approx(left_by(law, DT, f, zeta), abs=off)


@drawn
@given(law=anyone, first=time, second=time)
def test_averages_may_be_taken_in_any_order(law, first, second):
    profile = built(*law)
    poles = mode_poles([17.0, 61.0], [0.0, 0.04])
    one, other = (
        averaged_profiles(profile, first, second),
        averaged_profiles(profile, second, first),
    )
    assert profiles_response(one, poles) == pytest.approx(
        profiles_response(other, poles), abs=1e-4 * float(profile.peak_velocity[0])
    )
