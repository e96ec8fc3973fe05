"""Messages: where, what, and what to do about it, in this order."""

import pytest

from gcodejerk import errors
from gcodejerk.errors import GcodejerkError, Place, PlanError, ProgramError


def test_a_message_has_place_problem_excerpt_caret_and_remedy():
    place = Place("samples/plate.nc", 12, 13, "N120 G0 X10 Y4..2")
    error = ProgramError("axis word Y holds '4..2'", "write one decimal point", place)
    assert str(error).split("\n") == [
        "samples/plate.nc:12:13: axis word Y holds '4..2'",
        "    N120 G0 X10 Y4..2",
        "                ^",
        "  write one decimal point",
    ]


def test_a_message_without_place_or_remedy_is_the_problem_alone():
    assert str(PlanError("it cannot be")) == "it cannot be"


@pytest.mark.parametrize(
    ("place", "text"),
    [
        (Place("a.nc"), "a.nc: wrong"),
        (Place("a.nc", 3), "a.nc:3: wrong"),
        (Place("a.nc", 3, 7), "a.nc:3:7: wrong"),
    ],
)
def test_a_place_names_what_is_known_of_it(place, text):
    assert str(ProgramError("wrong", place=place)) == text


def test_a_line_without_a_column_is_shown_without_caret():
    assert str(ProgramError("wrong", place=Place("a.nc", 3, None, "G0 X1"))).split("\n") == [
        "a.nc:3: wrong",
        "    G0 X1",
    ]


@pytest.mark.parametrize("column", [1, 60, 67, 200, 99_990])
def test_the_caret_stands_under_its_column_however_long_the_line(column):
    text = "".join(chr(ord("a") + k % 26) for k in range(100_000))
    shown, caret = str(ProgramError("x", place=Place("f", 1, column, text))).split("\n")[1:3]
    assert len(shown) <= 80
    assert caret.strip() == "^"
    at = caret.index("^")
    assert shown[at] == text[column - 1]
    assert shown[4 : at + 1] == text[column - 1 - (at - 4) : column]


@pytest.mark.parametrize(
    ("text", "column"), [("G0\tX1\x00\x1bY2", 8), ("\t\t\tX", 4), ("\x07" * 90 + "X", 91)]
)
def test_control_characters_reach_no_terminal_and_move_no_caret(text, column):
    message = str(ProgramError("x", place=Place("f", 1, column, text)))
    assert all(c.isprintable() or c == "\n" for c in message)
    shown, caret = message.split("\n")[1:3]
    assert shown[caret.index("^")] == text[column - 1]


def test_every_error_can_be_caught_as_one():
    kinds = [k for k in vars(errors).values() if isinstance(k, type) and issubclass(k, Exception)]
    assert len(kinds) >= 6
    for kind in kinds:
        assert issubclass(kind, GcodejerkError)
        assert kind is GcodejerkError or kind.__bases__ == (GcodejerkError,)


def test_parts_of_an_error_are_there_for_programs_too():
    error = PlanError("p", "r", Place("f", 1))
    assert (error.problem, error.remedy, error.place) == ("p", "r", Place("f", 1))
