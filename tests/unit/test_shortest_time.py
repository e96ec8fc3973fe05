"""The search for the shortest time: against a linear programme, move by move, and its cost."""

import numpy as np
import pytest
from test_motion_optimal import by_linear_programme, rows_of

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, find_machine
from gcodejerk.planning import shortest_time
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.task import Task, worst_in_band

VMC = Machine.load(find_machine("vmc"))


def displacements(**lengths):
    """A move of one axis for each of its lengths."""
    rows = [(AXES.index(axis), length) for axis, own in lengths.items() for length in own]
    out = np.zeros((len(rows), len(AXES)))
    for row, (axis, length) in zip(out, rows, strict=True):
        row[axis] = length
    return out


def task_of(machine, moves):
    return Task.of(machine, Modes.of(machine), moves)


def drawn_machines(count):
    """Limits of an axis, its modes, and lengths that take some tens of intervals."""
    rng = np.random.default_rng(11)
    for _ in range(count):
        A = 10 ** rng.uniform(3.3, 4.0)
        limits = 0.03 * A * rng.uniform(0.6, 1.5), A, A / rng.uniform(0.001, 0.006)
        frequencies = np.sort(rng.uniform(25.0, 90.0, rng.integers(1, 3)))
        damping = rng.choice([0.0, 0.02, 0.06], len(frequencies))
        yield limits, frequencies, damping, rng.uniform(0.05, 0.6, 3) * A * 0.02**2


def machine_of(limits, frequencies, damping, band, tolerance):
    V, A, J = limits
    modes = "".join(
        f"      - {{frequency: {f!r}, damping: {z!r}, participation: 1.0}}\n"
        for f, z in zip(frequencies.tolist(), damping.tolist(), strict=True)
    )
    return Machine.loads(
        f"interval: 0.001\npositioning: linear\ndesign: {{band: {band}, tolerance: {tolerance}}}\n"
        f"axes:\n  Z:\n    rapid: {{velocity: {V!r}, acceleration: {A!r}, jerk: {J!r}}}\n"
        f"    limit: {{velocity: {V!r}, acceleration: {A!r}, jerk: {J!r}}}\n"
        f"    modes:\n{modes}"
    )


@pytest.mark.parametrize("band", [0.0, 0.1])
def test_no_linear_programme_keeps_the_tolerance_an_interval_earlier(band):
    tolerance, checked = 0.002, 0
    for limits, frequencies, damping, lengths in drawn_machines(5):
        machine = machine_of(limits, frequencies, damping, band, tolerance)
        plans = plan_moves(displacements(Z=lengths), machine, "shortest")
        assert plans.planned.all()
        sides = np.unique([1.0 - band, 1.0 - 0.5 * band, 1.0, 1.0 + 0.5 * band, 1.0 + band])
        every = np.outer(frequencies, sides).ravel()
        zeta = np.repeat(damping, len(sides))
        for length, count in zip(lengths, plans.counts, strict=True):
            unit = [limit / length for limit in limits]
            weights = np.full(len(every), length)
            later, earlier = (
                by_linear_programme(n, *unit, rows_of(n, every, zeta, weights))
                for n in (int(count), int(count) - 1)
            )
            # Its polygons lie around the circles, and between its frequencies there are others.
            assert later <= tolerance
            checked += earlier is not None
            assert earlier is None or earlier > 0.955 * tolerance, (length, count)
    assert checked > 8


def test_moves_are_planned_as_if_they_were_alone():
    """Of one axis or of several: what they know of each other are times only."""
    rng = np.random.default_rng(5)
    together = displacements(Z=[3.0, 55.0, 11.0, 11.02, 24.0], X=[7.0, 40.0])
    together = np.vstack([together, rng.uniform(-40.0, 40.0, (5, len(AXES)))])
    together[:, 3:] = 0.0
    plans = plan_moves(together, VMC, "shortest")
    for row, move in enumerate(together):
        alone = plan_moves(move[np.newaxis], VMC, "shortest")
        assert alone.counts[0] == plans.counts[row]
        own = plans.profiles.take(slice(row, row + 1))
        np.testing.assert_allclose(own.duration, alone.profiles.duration, rtol=1e-12)
        np.testing.assert_allclose(own.jerk, alone.profiles.jerk, rtol=1e-9)


def test_moves_that_excite_nothing_are_planned_as_if_they_were_alone():
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n"
        "  Z:\n    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}\n"
        "  X:\n    rapid: {velocity: 600, acceleration: 5000}\n"
        "    modes: [{frequency: 20, damping: 0.0, participation: 1.0}]\n"
    )
    together = displacements(Z=[3.01, 3.02, 3.03, 9.0], X=[9.0])
    plans = plan_moves(together, machine, "shortest")
    assert plans.planned.all()
    assert plans.counts[0] == plans.counts[2]
    for row, move in enumerate(together):
        alone = plan_moves(move[np.newaxis], machine, "shortest")
        own = plans.profiles.take(slice(row, row + 1))
        np.testing.assert_allclose(own.duration, alone.profiles.duration, rtol=1e-12)


def test_longer_moves_take_no_less_time():
    lengths = np.geomspace(0.2, 150.0, 23)
    counts = plan_moves(displacements(Z=lengths), VMC, "shortest").counts
    assert (np.diff(counts) >= 0).all()
    assert len(np.unique(counts)) > 15


def test_few_programmes_are_asked(monkeypatch, tmp_path):
    """Halves of all times would be eight or nine for each move."""
    monkeypatch.setenv("GCODEJERK_CACHE", str(tmp_path))
    asked = []

    def answers(questions, progress=None):
        asked.append(len(questions))
        return shortest_time_answers(questions, progress)

    shortest_time_answers = shortest_time.answers
    monkeypatch.setattr(shortest_time, "answers", answers)
    rng = np.random.default_rng(2)
    lengths = rng.uniform(1.0, 60.0, 24)
    plans = plan_moves(displacements(Z=lengths), VMC, "shortest")
    assert plans.planned.all()
    assert sum(asked) < 4.5 * len(lengths)
    # Of lengths that are nearly the same, nothing but their own profiles.
    asked.clear()
    near = plan_moves(displacements(Z=np.linspace(20.0, 20.01, 24)), VMC, "shortest")
    assert len(np.unique(near.counts)) == 1
    assert sum(asked) <= 1.5 * len(near.counts)


def test_a_bar_only_goes_forward(monkeypatch, tmp_path):
    monkeypatch.setenv("GCODEJERK_CACHE", str(tmp_path))
    told = []
    moved = displacements(Z=[3.0, 9.0, 21.0], X=[5.0, 50.0])
    plan_moves(moved, VMC, "shortest", progress=lambda done, total: told.append((done, total)))
    done, total = np.array(told).T
    assert len(done) > 10
    assert (np.diff(done) >= 0).all()
    assert (done <= total).all()
    assert np.ptp(total) == 0
    assert done[-1] > 0.75 * total[0]


def test_where_the_programme_finds_nothing_a_move_is_left_alone(monkeypatch):
    monkeypatch.setattr(shortest_time, "answers", lambda questions, _: [None] * len(questions))
    hard = np.full(3, np.inf)
    monkeypatch.setattr(
        shortest_time, "symmetric", lambda task: (task.conventional, hard[: len(task)])
    )
    plans = plan_moves(displacements(Z=[4.0, 5.0], X=[6.0]), VMC, "shortest")
    assert not plans.planned.any()


def test_a_profile_of_a_longer_move_serves_where_the_programme_finds_none(monkeypatch, tmp_path):
    monkeypatch.setenv("GCODEJERK_CACHE", str(tmp_path))
    answers, lengths = shortest_time.answers, [20.0, 20.001]
    plans = plan_moves(displacements(Z=lengths), VMC, "shortest")
    short = task_of(VMC, displacements(Z=lengths)).limits[0][0]

    def failing(questions, progress):
        """Of the shorter move nothing is found."""
        found = answers(questions, progress)
        return [
            None if question.move.velocity == short else own
            for question, own in zip(questions, found, strict=True)
        ]

    monkeypatch.setattr(shortest_time, "answers", failing)
    other = plan_moves(displacements(Z=lengths), VMC, "shortest")
    assert other.planned.all()
    assert (other.counts == plans.counts).all()
    left = worst_in_band(task_of(VMC, displacements(Z=lengths)), other.profiles)
    assert (left <= VMC.design.tolerance).all()


def test_moves_of_a_kind_are_asked_by_turns():
    assert shortest_time._turns(9).tolist() == [0, 4, 3, 4, 2, 4, 3, 4, 1]
    for count in (0, 1, 2, 3, 7, 8, 1000):
        turns = shortest_time._turns(count)
        assert len(turns) == count
        for turn in range(1, int(turns.max(initial=0)) + 1):
            # One that was asked before lies between any two.
            now, before = np.flatnonzero(turns == turn), np.flatnonzero(turns < turn)
            assert (np.diff(np.searchsorted(before, now)) > 0).all()
