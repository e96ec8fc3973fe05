"""Optima of many moves: each problem once, remembered, and checked before it is used."""

import builtins
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.errors import PlanError
from gcodejerk.motion import mode_poles
from gcodejerk.motion.search.unit_move import Move, optimum_profiles
from gcodejerk.planning import optima
from gcodejerk.planning.optima import Question, answers, joint_answers
from gcodejerk.planning.solution_cache import VARIABLE, cache_file, read_solutions, write_solutions

MS = 0.001


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))


@pytest.fixture
def solved(monkeypatch):
    """The questions that reach the solver."""
    asked = []
    solve = optima._answer
    monkeypatch.setattr(
        optima, "_answer", lambda question: asked.append(question) or solve(question)
    )
    return asked


def question(length=1.0, count=40, frequency=30.0):
    poles = mode_poles([frequency], [0.0])
    move = Move(
        count, 600 / length, 5000 / length, 5e6 / length, poles, np.array([length]),
        np.arange(1), 0.05, MS,
    )  # fmt: skip
    return Question(move, 0.37 * length)


def test_equal_problems_are_solved_once(solved):
    found = answers([question(), question(frequency=31.0), question()])
    assert len(solved) == 2
    assert found[0].worst == found[2].worst != found[1].worst


def test_lengths_with_the_same_limits_over_them_share_a_solution(solved):
    # Twice the length and twice all limits: the same unit profile, twice the residual.
    move = question().move
    double = Question(
        Move(move.count, move.velocity, move.acceleration, move.jerk, move.poles,
             2.0 * move.weights, move.group, move.band, MS),
        0.74,
    )  # fmt: skip
    one, two = answers([question(), double])
    assert len(solved) == 1
    assert two.worst == pytest.approx(2.0 * one.worst)
    np.testing.assert_array_equal(one.jerk, two.jerk)


def test_a_second_run_solves_nothing(solved):
    first = answers([question(), question(2.0, 50)])
    again = answers([question(2.0, 50), question()])
    assert len(solved) == 2
    for a, b in zip(first, reversed(again), strict=True):
        np.testing.assert_array_equal(a.jerk, b.jerk)
        np.testing.assert_array_equal(a.knots, b.knots)
        assert a.worst == b.worst


def tampered(value):
    """Solutions that are not: cut, of nonsense, with a jerk too many or one doubled."""
    numbers = np.frombuffer(value, "<f8").copy()
    yield value[:-8]
    yield value[:5]
    yield np.array([0.5]).tobytes()
    yield value + np.zeros(1).tobytes()
    yield b""
    yield np.full(len(numbers), np.nan).tobytes()
    for k in (0, 2, 4, len(numbers) - 2):
        wrong = numbers.copy()
        wrong[k] = 1.5 * wrong[k] + 1.0
        yield wrong.tobytes()
    faster = numbers.copy()
    faster[int(numbers[0]) + 3 :] *= 1.01
    yield faster.tobytes()


def test_a_solution_from_the_disk_that_is_none_is_solved_again(solved):
    good = answers([question()])[0]
    key = question().key()
    value = read_solutions([key], cache_file())[key]
    for count, wrong in enumerate(tampered(value), 2):
        write_solutions({key: wrong}, cache_file())
        again = answers([question()])[0]
        assert len(solved) == count
        np.testing.assert_allclose(again.jerk, good.jerk)


def joint_question(count=40):
    """Two axes that excite one mode against each other, the second one shorter."""
    first, second = question(1.0, count).move, question(0.5, count - 6).move
    return Question(
        first, 0.5, 1e-4, beside=(replace(second, weights=-second.weights),),
        until=count,
    )  # fmt: skip


def test_joint_solutions_are_read_again_and_none_is_taken_for_another(solved):
    first = joint_answers([joint_question(), joint_question(42), joint_question()])
    assert len(solved) == 2
    again = joint_answers([joint_question(42), joint_question()])
    assert len(solved) == 2
    for a, b in ((first[1], again[0]), (first[0], again[1]), (first[2], again[1])):
        assert len(a) == len(b) == 2
        for one, other in zip(a, b, strict=True):
            np.testing.assert_array_equal(one.knots, other.knots)
            np.testing.assert_array_equal(one.jerk, other.jerk)
            assert one.worst == other.worst == a[0].worst
    assert [optimum.knots[-1] for optimum in first[1]] == [42, 36]
    # One of the two by itself, both in the wrong order, and a third one.
    key = joint_question().key()
    value = read_solutions([key], cache_file())[key]
    half = 8 * (2 * len(first[0][0].jerk) + 3)
    for count, wrong in enumerate(
        (value[:half], value[half:] + value[:half], value + value[half:], value[:-8]), 3
    ):
        write_solutions({key: wrong}, cache_file())
        (mended,) = joint_answers([joint_question()])
        assert len(solved) == count
        np.testing.assert_allclose(mended[1].jerk, first[0][1].jerk)


@pytest.mark.parametrize("limit", ["velocity", "acceleration", "jerk"])
def test_a_solution_is_one_within_each_limit_only(limit):
    found, move = answers([question()])[0], question().move
    assert optima._holding([found], [move])[0]
    profile = optimum_profiles([found], MS)
    peak = {
        "velocity": profile.peak_velocity,
        "acceleration": profile.peak_acceleration,
        "jerk": profile.greatest_jerk,
    }[limit][0]
    assert optima._holding([found], [replace(move, **{limit: peak})])[0]
    assert not optima._holding([found], [replace(move, **{limit: 0.99 * peak})])[0]


@pytest.mark.parametrize("moment", [0, 1, 2])
def test_a_solution_is_one_that_ends_there_and_at_rest(moment):
    # Jerks by whose addition one alone of position, velocity and acceleration at the end changes.
    found, move = answers([question()])[0], question().move
    wide = replace(move, velocity=1e9, acceleration=1e9, jerk=1e12)
    begin, end = (move.count - k for k in (found.knots[:-1], found.knots[1:]))
    moments = np.array([(begin.astype(float) ** k - end.astype(float) ** k) for k in (3, 2, 1)])
    only = np.linalg.lstsq(moments, np.eye(3)[moment])[0]
    assert optima._holding([found], [wide])[0]
    share = np.abs(found.jerk).max() / np.abs(only).max()
    for size, holds in ((1e-13, True), (1e-6, False), (1e-2, False)):
        changed = replace(found, jerk=found.jerk + size * share * only)
        assert optima._holding([changed], [wide]).tolist() == [holds]


def test_many_problems_are_solved_by_several_processes_alike(monkeypatch):
    monkeypatch.setenv(VARIABLE, "")
    questions = [question(0.5 + 0.1 * k, 36 + k) for k in range(optima.FEW + 4)]
    told = []
    together = answers(questions, lambda done, total: told.append((done, total)))
    assert told[-1] == (len(questions), len(questions))
    alone = [optima._answer(q) for q in questions]
    for a, b, q in zip(together, alone, questions, strict=True):
        assert (a is None) == (b is None)
        if a is not None:
            np.testing.assert_allclose(a.jerk, b[0].jerk)
            assert a.worst == pytest.approx(b[0].worst * float(q.move.weights[0]))


def test_what_the_limits_do_not_allow_has_no_answer():
    assert answers([question(count=12)]) == [None]


def test_without_the_solver_the_extra_is_named(monkeypatch):
    real = builtins.__import__

    def missing(name, *arguments, **keywords):
        if name == "clarabel":
            raise ImportError("No module named 'clarabel'", name="clarabel")
        return real(name, *arguments, **keywords)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(PlanError, match="clarabel is missing") as caught:
        answers([question()])
    assert "pip install 'gcodejerk[science]'" in caught.value.remedy
