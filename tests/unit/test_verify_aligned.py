"""`verify` accepts streams for LinuxCNC written by hand, and refuses each damage to their form.

Blocks end on servo periods, with speeds that change linearly within them. The streams here are
written by a few lines of this file; neither the planner nor an emitter takes part.
"""

from __future__ import annotations

import io
import re
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.machine import Machine
from gcodejerk.verification import Kind, verify, verify_files
from gcodejerk.verification.physics.points import sum_up

TEXT = """
controller: linuxcnc
interval: 0.001
positioning: linear
axes:
  Z:
    resolution: 1.0e-3
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
    modes: [{frequency: 30.0, damping: 0.02}]
design: {max_extension: 0}
"""
MACHINE = Machine.loads(TEXT)
KNOTS = [0, *range(3, 38, 2), 40]
SEGMENTS = [(0.001, 1.0), (0.019, -1 / 19), (0.019, -1 / 19), (0.001, 1.0)]
"""Durations and jerks of the paper's four segments. [s], up to a factor"""


def rise(t, T=0.040, T1=0.001):
    """Speed of the paper's four segments at t, of a way of 1."""
    t = min(t, T - t)
    T2 = T / 2 - T1
    J = 6.0 / (T1**2 * T * (2 * T2 / T1 + 1))
    u = t - T1
    return J * t**2 / 2 if u <= 0 else J * T1**2 / 2 + J * T1 * u - J * T1 / T2 * u**2 / 2


def stream(begin=0.0, way=1.0, knots=KNOTS, end=0.01, early=2e-10, tail=2e-5):
    """Points, and the tail in front of the end; F is the larger speed at the ends of a block."""
    T = knots[-1]
    speed = [rise(0.040 * k / T) * 40 / T for k in knots]
    share = sum(
        (b - a) * (u + v) / 2e3
        for a, b, u, v in zip(knots, knots[1:], speed, speed[1:], strict=False)
    )
    speed = [v * (way - tail) / share for v in speed]
    speed[-1] = end
    lines, at, before, last, wanted = [], 1e-6, 0.0, 0.0, 1e-6
    for n in range(1, len(knots)):
        h = (knots[n] - knots[n - 1]) / 1000 - early * (n == 1)
        moved = round((before + speed[n]) / 2 * h + 0.2 * (wanted - at), 6)
        wanted += (speed[n - 1] + speed[n]) / 2 * h
        at, after = at + moved, 2 * moved / h - before
        feed = round(60 * max(before, after), 11)
        feed += 1e-11 * (feed == last)
        lines.append(f"G1 Z{begin + at:.6f} F{feed:.11f}\n")
        before, last = after, feed
    lines.append(f"G1 Z{begin + way - 1e-6:.6f} F{60 * before:.11f}\n")
    return "".join(lines)


LEAD = "G0 Z0.0000003\nG1 Z0.0000006 F0.0018\nG0 Z0.000001\n"
UP = stream()
ORIGINAL = "G21 G90 G94 G64 P0.01\nF600\nG0 Z0\nG0 Z1. M8\nG1 Z2\nM2\n"
PROCESSED = ORIGINAL.replace("G0 Z1. M8\n", f"G0  M8\n{LEAD}{UP}G0 Z1.\nF600\n")


def judge(processed, original=ORIGINAL, machine=MACHINE):
    return verify(original.encode(), processed.encode(), machine)


def kinds(*args, **kwargs):
    return {v.kind for v in judge(*args, **kwargs).violations}


def line(n):
    return UP.splitlines(keepends=True)[n]


def with_feed(n, change):
    """Line n with another F."""
    head, _, feed = line(n).strip().rpartition("F")
    return f"{head}F{change(float(feed)):.11f}\n"


def moved(n, by):
    """Line n with its point elsewhere."""
    return re.sub(r"Z(\S+)", lambda match: f"Z{float(match[1]) + by:.6f}", line(n))


def test_a_stream_written_by_hand_is_accepted():
    found = judge(PROCESSED)
    assert found.violations == ()
    assert (found.rapids, found.rewritten) == (2, 1)


@pytest.mark.parametrize(
    ("end", "wrong"),
    [
        ("0.9999996666666666", None),
        ("0.9999996666666666200740", None),  # the same double
        ("0.9999996666666667", Kind.END),
        ("0.999999667", Kind.END),
        ("0.99999966", Kind.END),
    ],
)
def test_a_computed_end_is_the_very_number_that_is_computed(end, wrong):
    original = ORIGINAL.replace("G0 Z1. M8", "#1=2.999999\nG0 Z[#1/3] M8")
    points = f"{LEAD}{stream(way=2.999999 / 3)}G0 Z{end}\nF600\n"
    processed = original.replace("G0 Z[#1/3] M8\n", f"G0  M8\n{points}")
    assert {v.kind for v in judge(processed, original).violations} == {wrong} - {None}


DAMAGE = {
    "F larger by 1e-6": (line(9), with_feed(9, lambda f: f + 60e-6), Kind.FEED),
    "F smaller by 1e-6": (line(9), with_feed(9, lambda f: f - 60e-6), Kind.FEED),
    "F with eight decimals": (line(8), line(8)[:-4] + "\n", Kind.FEED),
    "first F": (line(0), with_feed(0, lambda f: f * 0.999999), Kind.FEED),
    "F of the peak": (line(9), with_feed(9, lambda f: f * 2), Kind.FEED),
    "F zero": (line(9), with_feed(9, lambda f: 0.0), Kind.FEED),
    "F of the tail": (line(19), with_feed(19, lambda f: f * 4), Kind.FEED),
    "equal F": (line(9), with_feed(9, lambda f: float(line(8).split("F")[1])), Kind.FEED),
    "last digit of a position": (line(6), moved(6, 1e-6), Kind.FEED),
    "point further by 0.01 mm": (line(6), moved(6, 0.01), Kind.FEED),
    "point backwards": (line(6), moved(6, -0.2), Kind.BACKWARDS),
    "lines swapped": (line(6) + line(7), line(7) + line(6), Kind.BACKWARDS),
    "line removed": (line(6), "", Kind.FEED),
    "line doubled": (line(6), line(6) * 2, Kind.FEED),
    "tail removed": (line(19), "", Kind.FEED),
    "point without F": (line(6), line(6).split(" F")[0] + "\n", Kind.FORM),
    "point as a rapid": (line(6), line(6).replace("G1", "G0"), Kind.FORM),
    "point with seven decimals": (line(6), line(6).replace(" F", "1 F"), Kind.FORM),
    "another axis": (line(6), line(6).replace(" F", " X0.0 F"), Kind.FORM),
    "lead-in missing": (LEAD, "", Kind.FORM),
    "lead-in of nothing": (
        LEAD,
        "G0 Z0.0000002\nG1 Z0.0000004 F0.0012\nG0 Z0.000001\n",
        Kind.FORM,
    ),
    "lead-in in no time": (LEAD, LEAD.replace("F0.0018", "F18"), Kind.FEED),
    "lead-in of an hour": (LEAD, LEAD.replace("F0.0018", "F0.000000005"), Kind.FEED),
    "lead-in of one line": (LEAD, "G0 Z0.000001\n", Kind.FORM),
    "lead-in without its block": ("G1 Z0.0000006 F0.0018\n", "", Kind.FORM),
    "lead-in that dwells": ("G0 Z0.000001\n", "G4 P0\n", Kind.FORM),
    "lead-in too long": ("G0 Z0.000001\n", "G0 Z0.0001\n", Kind.FORM),
    "lead-in of another axis": ("G0 Z0.000001\n", "G0 X0.000001\n", Kind.FORM),
    "exact stop in front": (LEAD, "G61\n" + LEAD, Kind.FORM),
    "inverse time in front": (LEAD, "G93\n" + LEAD, Kind.FORM),
    "G94 in front": (LEAD, "G94\n" + LEAD, Kind.FORM),
    "last G0 missing": ("G0 Z1.\nF600\n", "F600\n", Kind.FORM),
    "last G0 elsewhere": ("G0 Z1.\nF600\n", "G0 Z1.000001\nF600\n", Kind.END),
    "last G0 with another axis": ("G0 Z1.\nF600\n", "G0 Z1. X0\nF600\n", Kind.AXES),
    "last G0 as G1": ("G0 Z1.\nF600\n", "G1 Z1.\nF600\n", Kind.FORM),
    "last G0 with exact stop": ("G0 Z1.\nF600\n", "G0 G61 Z1.\nF600\n", Kind.PATH),
    "F not restored": ("G0 Z1.\nF600\n", "G0 Z1.\n", Kind.FORM),
    "another F restored": ("G0 Z1.\nF600\n", "G0 Z1.\nF601\n", Kind.FEED_RESTORED),
    "feed mode changed": ("G0 Z1.\nF600\n", "G0 Z1.\nG95 F600\n", Kind.FEED_MODE),
    "path mode changed": ("G0 Z1.\nF600\n", "G0 Z1.\nG61 F600\n", Kind.PATH),
    "a code beside F": ("G0 Z1.\nF600\n", "G0 Z1.\nG94 F600\n", Kind.FORM),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damage_is_refused_for_the_right_reason(name):
    before, after, kind = DAMAGE[name]
    assert before in PROCESSED
    found = kinds(PROCESSED.replace(before, after, 1))
    assert kind in found


@pytest.mark.parametrize("n", range(19))
def test_one_feed_or_one_position_that_changes_is_noticed_in_every_block(n):
    for factor in (0.99, 1 - 1e-6, 1.01):
        assert Kind.FEED in kinds(
            PROCESSED.replace(line(n), with_feed(n, lambda f, by=factor: f * by))
        )
    # A hair earlier at one point is the same motion; later it is not.
    for by in (1e-6, -1e-3):
        assert kinds(PROCESSED.replace(line(n), moved(n, by)))


def longer(by, at):
    """The knots, those from `at` on later."""
    return [k + by * (k >= at) for k in KNOTS]


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"knots": longer(1, 21)}, Kind.TIME),
        ({"knots": longer(-1, 21)}, Kind.TIME),
        ({"knots": [0, 2, *KNOTS[2:]]}, Kind.TIME),
        ({"knots": [*KNOTS[:-2], 38, 40]}, Kind.TIME),
        ({"knots": [k for k in KNOTS if not 15 <= k <= 25]}, Kind.TIME),
        ({"early": 0.0}, Kind.FEED),
        ({"early": -1e-6}, Kind.FEED),
        ({"early": 1e-5}, Kind.FEED),
        ({"end": 0.1}, Kind.FEED),
        ({"tail": 2e-4}, Kind.TIME),
    ],
)
def test_other_times_are_refused_with_feeds_that_agree_with_them(changes, kind):
    assert kind in kinds(PROCESSED.replace(UP, stream(**changes)))


@pytest.mark.parametrize(
    ("limit", "kind"),
    [("velocity: 30", Kind.VELOCITY), ("acceleration: 3000", Kind.ACCELERATION)],
)
def test_limits_are_those_of_the_machine(limit, kind):
    machine = Machine.loads(TEXT.replace("    modes", f"    limit: {{{limit}}}\n    modes"))
    assert kinds(PROCESSED, machine=machine) == {kind}


def test_what_max_acceleration_is_said_to_be_is_not_passed():
    options = replace(MACHINE.controller_options, max_acceleration={"Z": 3000.0})
    machine = replace(MACHINE, controller_options=options)
    assert kinds(PROCESSED, machine=machine) == {Kind.ACCELERATION}


def test_a_stream_that_shakes_more_than_the_rapid_is_refused():
    # The controller's own 40 ms leave a mode of 50 Hz at rest; the four segments do not.
    machine = Machine.loads(TEXT.replace("frequency: 30.0, damping: 0.02", "frequency: 50.0"))
    assert kinds(PROCESSED, machine=machine) == {Kind.RESIDUAL}


def test_the_profile_that_was_reported_is_held_to():
    def found(segments, rapid=4):
        return verify_files(
            io.BytesIO(ORIGINAL.encode()),
            io.BytesIO(PROCESSED.encode()),
            MACHINE,
            reported={rapid: np.array(segments)},
        )

    J = 6.0 / (0.001**2 * 0.040 * 39)
    own = [(d, J * j) for d, j in SEGMENTS]
    other = [(0.010, j) for j in (5e5, -5e5, -5e5, 5e5)]
    assert found(own).ok
    assert found(other, rapid=3).ok
    assert {v.kind for v in found(other).violations} == {Kind.PROFILE}
    late = [(0.002, 0.0), *own]
    assert {v.kind for v in found(late).violations} == {Kind.PROFILE}


def test_where_a_motion_is_queued_one_tiny_rapid_leads_in():
    original = ORIGINAL.replace("G0 Z0\nG0 Z1. M8\n", "G0 Z5\nG1 Z0\nG0 Z1.\n")
    good = original.replace("G0 Z1.\n", f"G0 Z0.000001\n{UP}G0 Z1.\nF600\n")
    assert judge(good, original).violations == ()
    assert Kind.AXES in kinds(good.replace("G0 Z0.000001\n", LEAD), original)
    assert kinds(good.replace("G0 Z0.000001\n", ""), original) == {Kind.FORM}


def test_exact_path_and_inverse_time_are_restored():
    original = "G21 G90 G93 G61\nG0 Z0\nM8\nG0 Z1.\nM2\n"
    good = original.replace("G0 Z1.\n", f"G94 G64\n{LEAD}{UP}G0 G61 Z1.\nG93\n")
    assert judge(good, original).violations == ()
    assert Kind.PATH in kinds(good.replace("G0 G61 Z1.", "G0 Z1."), original)
    assert Kind.PATH in kinds(good.replace("G0 G61 Z1.", "G0 G61.1 Z1."), original)
    assert kinds(good.replace("Z1.\nG93\n", "Z1.\n"), original)
    assert Kind.MODE in kinds(good.replace("G94 G64\n", "G94\n"), original)
    assert Kind.MODE in kinds(good.replace("G94 G64\n", "G64\n"), original)


def test_stops_of_the_block_follow_the_stream():
    original = ORIGINAL.replace(" M8", " M0")
    good = original.replace("G0 Z1. M0\n", f"{LEAD}{UP}G0 Z1.\nF600\nM0\n")
    assert judge(good, original).violations == ()
    for wrong in ("", "M1\n", "M0\nM0\n"):
        assert kinds(good.replace("M0\n", wrong), original)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("far", [999_999_999.0, 1e200, -1e200])
def test_increments_beyond_any_machine_are_far_off(far):
    increments = np.array([[np.nan], [0.25], [far], [0.125]])
    at = sum_up(increments, np.array([0]), np.array([4]))[:, 0]
    assert at[:2].tolist() == [0.0, 0.25]
    assert np.abs(at[2:]).min() > 1e6
    assert np.sign(at[2:]).tolist() == [np.sign(far)] * 2
