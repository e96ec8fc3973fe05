"""Profiles of every kind, over drawn machines and moves: 400 moves, or 100,000 with `--long`.

What a profile does is worked out here from its jerks alone, by sums that share no code with the
package.
"""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.planning.plan import plan_moves
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.testing import machines

MOVES = 50
"""Of an example; 8 examples in four parts are 400 moves."""
LONGEST = 160
"""Intervals of a drawn move, about: an optimum of more takes long."""
PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
SAME_TIME = ("condition1", "condition2", "condition3", "symmetric", "cascade", "optimal")
cases = settings(
    max_examples=2, deadline=None, phases=PHASES, suppress_health_check=list(HealthCheck)
)


class Motion:
    """One profile, integrated from its segments."""

    def __init__(self, profiles, k):
        part = slice(profiles.first[k], profiles.first[k + 1])
        d, j = profiles.duration[part], profiles.jerk[part]
        self.t = np.concatenate([[0.0], np.cumsum(d)])
        self.steps = np.diff(profiles.acceleration[part], append=0.0)
        # A trapezoid's acceleration steps; all other profiles begin and end each segment alike.
        begin = profiles.acceleration[part]
        end = begin + j * d
        self.jumps = np.concatenate([begin, [0.0]]) - np.concatenate([[0.0], end])
        self.kinks = np.diff(j, prepend=0.0, append=0.0)
        gained = (0.5 * (begin + end)) * d
        self.v = np.concatenate([[0.0], np.cumsum(gained)])
        passed = self.v[:-1] * d + d**2 * (2.0 * begin + end) / 6.0
        self.length = passed.sum()
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.where(j != 0.0, -begin / j, -1.0)
        inside = (turn > 0.0) & (turn < d)
        between = self.v[:-1][inside] + 0.5 * begin[inside] * turn[inside]
        self.speeds = np.concatenate([self.v, between])
        self.acceleration = np.abs(np.concatenate([begin, end])).max()
        self.jerk = np.abs(j).max()

    def response(self, poles, until):
        """Of modes at a time after the end: every jump and kink of the acceleration rings on."""
        pole = np.asarray(poles)[:, np.newaxis]
        rung = (self.jumps / pole + self.kinks / pole**2) * np.exp(pole * (until - self.t))
        return rung.sum(axis=1)


def drawn_moves(machine, seed):
    """Displacements of 50 moves, of one axis or of several, none of more than LONGEST intervals."""
    rng = np.random.default_rng(seed)
    out = np.zeros((MOVES, len(AXES)))
    for axis in machine.axes:
        T = LONGEST * machine.interval
        far = min(0.25 * axis.rapid.acceleration * T**2, 0.7 * axis.rapid.velocity * T)
        if np.isfinite(axis.rapid.jerk):
            far = min(far, axis.rapid.jerk * T**3 / 64.0)
        size = far * 10 ** rng.uniform(-3.0, 0.0, MOVES)
        used = rng.random(MOVES) < (1.0 if len(machine.axes) == 1 else 0.6)
        out[:, AXES.index(axis.name)] = np.where(used, rng.choice([-1.0, 1.0], MOVES) * size, 0.0)
    return out[(out != 0.0).any(axis=1)]


def frequencies(mode, band):
    """The mode's own frequency, and points within its band."""
    return mode.frequency * (np.linspace(1.0 - band, 1.0 + band, 41) if band else np.ones(1))


def worst(machine, share, motion, band):
    """Largest residual displacement of one profile over all modes and their band."""
    largest = 0.0
    for _, mode in machine.all_modes():
        weight = sum(share[AXES.index(a)] * p for a, p in mode.participation)
        if not weight:
            continue
        omega = 2.0 * math.pi * frequencies(mode, band)
        damped = omega * math.sqrt(1.0 - mode.damping**2)
        poles = -mode.damping * omega + 1j * damped
        D = np.abs(motion.response(poles, motion.t[-1])) * abs(weight) / damped
        largest = max(largest, D.max())
    return largest


def worst_together(plans, profiles, move, band):
    """The same of all profiles of a move, when the last of them has ended."""
    rows, machine = plans.profiles_of(move), plans.machine
    motions = [Motion(profiles, k) for k in rows]
    until = max(motion.t[-1] for motion in motions)
    largest = 0.0
    for _, mode in machine.all_modes():
        omega = 2.0 * math.pi * frequencies(mode, band)
        damped = omega * math.sqrt(1.0 - mode.damping**2)
        poles = -mode.damping * omega + 1j * damped
        rung = np.zeros(len(poles), dtype=complex)
        for k, motion in zip(rows, motions, strict=True):
            weight = sum(plans.share[k][AXES.index(a)] * p for a, p in mode.participation)
            rung += weight * motion.response(poles, until)
        largest = max(largest, (np.abs(rung) / damped).max())
    return largest


def shares_modes(plans, k):
    """Whether another axis of the same move excites a mode that this one does."""
    excited = [
        {a for a, p in mode.participation if p and plans.displacement[plans.move[k]][AXES.index(a)]}
        for _, mode in plans.machine.all_modes()
    ]
    own = {AXES[int(np.argmax(plans.share[k] != 0.0))]}
    return any(own < axes for axes in excited)


def check_profile(plans, k, motion, profile):
    """Arrival, limits, no way back."""
    machine, share = plans.machine, plans.share[k]
    total = plans.profile_counts[k] * machine.interval
    assert abs(motion.length - 1.0) < 1e-8
    assert abs(motion.v[-1]) < 1e-8 * motion.v.max()
    assert motion.t[-1] <= total * (1.0 + 1e-9)
    assert motion.speeds.min() >= -3e-6 * motion.v.max(), profile
    assert np.abs(motion.jumps).max() <= 1e-6 * motion.acceleration
    for axis in machine.axes:
        size, limit = abs(share[AXES.index(axis.name)]), axis.limit
        assert motion.speeds.max() * size <= limit.velocity * (1.0 + 3e-6), profile
        assert motion.acceleration * size <= limit.acceleration * (1.0 + 3e-6), profile
        assert motion.jerk * size <= limit.jerk * (1.0 + 3e-6), profile


@pytest.mark.parametrize("part", range(4))  # for as many cores
@given(machine=machines(jerk_limited=True, interval=0.001), seed=st.integers(0, 2**32 - 1))
@cases
def test_every_profile_keeps_what_it_promises(part, machine, seed):
    displacement = drawn_moves(machine, seed)
    band = machine.design.band
    plans = {name: plan_moves(displacement, machine, name) for name in SAME_TIME}
    conventional = plan_moves(displacement, machine, "conventional")
    usual = np.ceil(conventional.conventional_time / machine.interval - 1e-6)
    best = {}
    for name in reversed(SAME_TIME):
        own = plans[name]
        # Where rapid's limits are within limit's, the time never changes.
        fits = conventional.planned
        assert (own.counts == usual)[fits & own.planned].all(), name
        assert {REASONS[k] for k in own.reason[fits & ~own.planned]} <= {
            Reason.NOT_BETTER,
            Reason.LATER,
        }, name
        gaining = set()
        for k in range(len(own.profiles)):
            motion = Motion(own.profiles, k)
            check_profile(own, k, motion, name)
            share, key = own.share[k], (own.move[k], tuple(np.nonzero(own.share[k])[0]))
            left = worst(machine, share, motion, band)
            today = worst(machine, share, Motion(own.conventional, k), band)
            # The optimum is one of all axes that share modes: one of them may leave more by itself.
            joint = name == "optimal" and shares_modes(own, k)
            if joint:
                left, today = (
                    worst_together(own, profiles, own.move[k], band)
                    for profiles in (own.profiles, own.conventional)
                )
            if own.profiles.segments(k) == own.conventional.segments(k):
                assert machine.positioning == "independent", name
                assert joint or left <= today * (1.0 + 1e-9), name
            else:
                # Judged at other frequencies than these, to 0.5 %.
                assert left < today * 0.99, name
                gaining.add(own.move[k])
            # What does not matter, a hundredth of today's or a tenth of the tolerance, is left for
            # less jerk; and what is guarded leaves more.
            slack = max(0.01 * today, 0.1 * machine.design.tolerance)
            if machine.design.guard or joint:
                continue
            if name == "optimal":
                best[key] = left, own.profile_counts[k]
            elif key not in best:
                # The optimum was not worth it, so no other profile may be; but where axes run on
                # their own, the best of each are not the best together.
                assert (
                    machine.positioning == "independent"
                    or not fits[own.move[k]]
                    or today <= left * 1.03 + slack
                ), name
            elif best[key][1] == own.profile_counts[k]:
                # Points beside those that the optimum was judged on may be worse by a little.
                assert best[key][0] <= left * 1.03 + slack, name
        assert gaining == set(np.nonzero(own.planned)[0]), name
