"""O-words: nesting that no controller would accept is followed in linear time."""

from time import process_time

import pytest

from gcodejerk.nc import Start, find_dialect
from gcodejerk.nc.flow.branches import Flow
from gcodejerk.nc.interpreter.initial import initial_state

MANY = 40_000


@pytest.mark.parametrize(
    ("keyword", "then"), [("while", "while"), ("do", "endif"), ("if", "while"), ("sub", "endsub")]
)
def test_deep_nesting_takes_linear_time(keyword, then):
    # Were the stack searched each time, this would take minutes.
    flow, state = Flow(), initial_state(find_dialect("linuxcnc"), Start())
    begun = process_time()
    for _ in range(MANY):
        state = flow.apply(state, keyword, "1", False)
    for _ in range(MANY):
        state = flow.apply(state, then, "2", False)
    assert flow.inside
    assert process_time() - begun < 20.0


def test_a_while_closes_the_do_of_its_name_wherever_that_is():
    flow, state = Flow(), initial_state(find_dialect("linuxcnc"), Start())
    for keyword, name in (("do", "1"), ("do", "2"), ("if", "3")):
        state = flow.apply(state, keyword, name, False)
    state = flow.apply(state, "while", "2", False)
    assert flow.inside
    state = flow.apply(state, "while", "1", False)
    assert not flow.inside
