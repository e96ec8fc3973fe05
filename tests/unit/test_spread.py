"""Work that is done ahead of its use comes out in order, and its errors where it is used."""

import threading

import pytest

from gcodejerk.spread import AHEAD, ahead


def test_answers_come_in_the_order_of_the_pieces():
    assert list(ahead(lambda n: n * n, range(50))) == [n * n for n in range(50)]


@pytest.mark.parametrize("count", [0, 1])
def test_a_single_piece_is_done_here(count):
    assert (
        list(ahead(lambda _: threading.get_ident(), range(count)))
        == [threading.get_ident()] * count
    )


def test_pieces_are_asked_for_here_and_only_some_ahead():
    asked = []

    def pieces():
        for n in range(9):
            asked.append(threading.get_ident())
            yield n

    answers = ahead(abs, pieces())
    for n in range(9):
        assert next(answers) == n
        assert len(asked) <= n + AHEAD + 2
    assert set(asked) == {threading.get_ident()}


def test_an_error_comes_where_its_answer_is_used_and_leaves_no_thread():
    before = threading.active_count()
    answers = ahead(lambda n: 1 // (3 - n), range(9))
    assert [next(answers) for _ in range(3)] == [0, 0, 1]
    with pytest.raises(ZeroDivisionError):
        next(answers)
    assert threading.active_count() == before


def test_who_stops_early_leaves_no_thread():
    before = threading.active_count()
    answers = ahead(abs, range(99))
    next(answers)
    answers.close()
    assert threading.active_count() == before
