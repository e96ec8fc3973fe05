"""One call of a drilling cycle as moves."""

from decimal import Decimal as D

import pytest

from gcodejerk.cycles.drilling import (
    DRILLING,
    LINUXCNC,
    Call,
    Kind,
    drill,
    end_of,
    most_moves,
)
from gcodejerk.nc import DIALECTS


def call(code, *, start=10, level=10, r=2, bottom=-3, g99=True, **more):
    """A call of one of LinuxCNC's cycles in mm."""
    given = {"peck": D(2), "clearance": LINUXCNC.clearance[False]} | more
    return Call(LINUXCNC.cycles[code], D(start), D(level), D(r), D(bottom), g99, **given)


def told(given):
    return " ".join(f"{move.kind.name.lower()}{move.to.normalize():f}" for move in drill(given))


@pytest.mark.parametrize(
    ("code", "moves"),
    [
        (810, "hole10 rapid2 feed-3 rapid2"),
        (820, "hole10 rapid2 feed-3 dwell-3 rapid2"),
        (830, "hole10 rapid2 feed0 rapid2 rapid0.254 feed-2 rapid2 rapid-1.746 feed-3 rapid2"),
        (730, "hole10 rapid2 feed0 rapid0.254 feed-2 rapid-1.746 feed-3 rapid2"),
        (850, "hole10 rapid2 feed-3 feed2"),
        (860, "hole10 rapid2 feed-3 dwell-3 stop-3 rapid2 start2"),
        (890, "hole10 rapid2 feed-3 dwell-3 feed2"),
    ],
)
def test_each_cycle_makes_its_moves(code, moves):
    assert told(call(code)) == moves


def test_every_cycle_of_the_table_is_a_cycle_of_its_dialect():
    for name, rules in DRILLING.items():
        assert rules.cycles.keys() < DIALECTS[name].cycles


def test_what_only_the_controller_can_do_is_not_in_the_table():
    assert not LINUXCNC.cycles.keys() & {740, 760, 840, 870, 880}


def test_g98_returns_to_where_the_series_began():
    assert told(call(810, g99=False)) == "hole10 rapid2 feed-3 rapid10"
    assert told(call(850, g99=False)) == "hole10 rapid2 feed-3 feed2 rapid10"
    assert told(call(890, g99=False)) == "hole10 rapid2 feed-3 dwell-3 feed10"


def test_a_start_below_r_is_lifted_to_r_first():
    assert told(call(810, start=1, level=1, g99=False)) == "rapid2 hole2 feed-3 rapid2"


def test_a_lower_r_than_the_last_one_is_gone_to_first_where_the_series_began_below_it():
    assert told(call(810, start=5, level=1)) == "rapid2 hole2 feed-3 rapid2"


def test_repeats_start_from_where_the_cycle_came_back_to():
    assert told(call(810, repeats=2)) == "hole10 rapid2 feed-3 rapid2 hole2 feed-3 rapid2"
    moves = "hole10 rapid2 feed-3 rapid10 hole10 rapid2 feed-3 rapid10"
    assert told(call(810, g99=False, repeats=2)) == moves


def test_from_r_itself_the_way_to_the_hole_ends_where_the_tool_will_come_back_to():
    assert told(call(810, start=2, g99=False)) == "hole10 rapid2 feed-3 rapid10"


def test_pecks_end_where_the_controllers_binary_numbers_end():
    # 1 - 10 * 0.1 stays above 0 in binary: the controller pecks once more, to the very bottom
    depths = [m.to for m in drill(call(730, r=1, bottom=0, peck=D("0.1"))) if m.kind is Kind.FEED]
    assert len(depths) == 11
    assert depths[-2:] == [0, 0]


def test_the_number_of_moves_is_foreseen():
    for code in LINUXCNC.cycles:
        for repeats in (1, 7):
            given = call(code, peck=D("0.01"), repeats=repeats)
            assert len(list(drill(given))) <= most_moves(given)


def test_the_end_of_a_call_is_the_end_of_its_last_move():
    for code in LINUXCNC.cycles:
        for g99 in (True, False):
            for start in (-1, 5, 10):
                given = call(code, start=start, level=start, g99=g99)
                assert list(drill(given))[-1].to == end_of(given)
