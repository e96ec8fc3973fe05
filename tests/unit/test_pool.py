"""Several processes at one program: the same answers, in order, and nobody left behind."""

import multiprocessing
import os
import signal
import time

import pytest

from gcodejerk.batch import pool as module
from gcodejerk.batch.pool import LostError, Pool
from gcodejerk.errors import PlanError


def act(piece):
    """What a test wants of a piece; who did it, and how often this one has worked."""
    kind, value = piece
    elsewhere = multiprocessing.parent_process() is not None
    if kind == "wait":
        time.sleep(value)
    elif kind == "die" and elsewhere:
        os.kill(os.getpid(), value)
    elif kind == "refuse":
        raise PlanError(f"problem {value}", "remedy")
    elif kind == "fail":
        raise ValueError(f"bug {value}")
    return value, elsewhere


def values(answers):
    return [value for value, _ in answers]


@pytest.fixture
def pool():
    """Two of them, both at work from the first piece on."""
    with Pool(2) as pool:
        pool.call(act)
        pool.wait_for_all()
        yield pool
    assert not multiprocessing.active_children()


def test_answers_come_in_order_and_both_work(pool):
    pieces = [("wait", 0.3), *(("", k) for k in range(9)), ("wait", 0.05), ("", 10)]
    for _ in range(2):
        answers = list(pool.map(act, iter(pieces)))
        assert values(answers) == [value for _, value in pieces]
        assert {elsewhere for _, elsewhere in answers} == {True, False}
    # What somebody stopped listening to is nobody's answer afterwards.
    answers = pool.map(act, [("wait", 0.1), *(("", -k) for k in range(9))])
    assert next(answers)[0] == 0.1
    answers.close()
    assert values(pool.map(act, [("", k) for k in range(20)])) == list(range(20))
    # A large piece, and a large answer, do not wait for each other.
    large = [("", bytes(1 << 20)) for _ in range(6)]
    assert values(pool.map(act, large)) == [value for _, value in large]
    assert list(pool.map(act, [])) == []


def test_what_goes_wrong_comes_where_it_would_with_one(pool):
    pieces = [("", 0), ("", 1), ("", 2), ("wait", 0.2), ("refuse", 4), ("fail", 5), ("fail", 6)]
    answers = pool.map(act, pieces)
    assert values(next(answers) for _ in range(4)) == [0, 1, 2, 0.2]
    with pytest.raises(PlanError, match="problem 4\n  remedy"):
        next(answers)

    def ending():
        yield from pieces[:3]
        raise OSError("no more pieces")

    answers = pool.map(act, ending())
    assert values(next(answers) for _ in range(3)) == [0, 1, 2]
    with pytest.raises(OSError, match="no more pieces"):
        next(answers)
    for _ in range(2):  # whoever does it
        with pytest.raises(ValueError, match="bug 5"):
            list(pool.map(act, [("wait", 0.1), ("fail", 5), ("fail", 5)]))


def test_few_pieces_are_asked_for_ahead(pool):
    asked = 0

    def pieces():
        nonlocal asked
        for asked in range(1, 41):
            yield "", asked

    for taken, _ in enumerate(pool.map(act, pieces())):
        assert asked <= taken + 1 + module.AHEAD * pool.size


def test_the_death_of_one_is_told(pool):
    with pytest.raises(LostError) as lost:
        list(pool.map(act, [("die", signal.SIGKILL)] * 9))
    assert lost.value.status == -signal.SIGKILL


def test_what_cannot_travel_is_done_at_home(pool):
    for act_here in (lambda piece: piece[1], lambda piece: -piece[1]):
        assert list(pool.map(act_here, [("", k) for k in range(9)]))[1] in (1, -1)
    assert values(pool.map(act, [("", k) for k in range(9)])) == list(range(9))
    with Pool(2, pays=-1.0) as other:
        assert list(other.map(lambda piece: piece, [1, 2])) == [1, 2]
        assert not other.workers


def test_nobody_is_started_where_it_does_not_pay():
    with Pool(4) as pool:
        assert values(pool.map(act, [("", k) for k in range(50)])) == list(range(50))
        assert not pool.workers
    with Pool(1) as pool:
        assert isinstance(pool.map(abs, [-1]), map)
