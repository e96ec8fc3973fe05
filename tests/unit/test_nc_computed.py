"""Lines whose numbers are computed, and shapes that they share."""

import random

import pytest

from gcodejerk.nc.dialects import find_dialect
from gcodejerk.nc.interpreter import computed
from gcodejerk.nc.interpreter.computed import Computed, Forms, form_of
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.text.tokenizer import parse_line
from gcodejerk.start import Start

VARIABLES = {"1": 1.5, "2": -0.25, "10": 25.4}
SHAPES = [
    *("G0 X[%.3f*#1+#2] Y[%d*#10]", "N%d X[#1-%.2f] Z-%.2f", "G1 X[[%d+#1]*%.1f] F90"),
    *("X#1 Y-%.3f", "G1 Z[-%.3f] X[#1/%d.]", "G0 X-%.2fY[%.1f-#2]", "X[.%d*#10]", "Y[%d.+%d]"),
]


@pytest.fixture(params=["linuxcnc", "haas", "mach"])
def dialect(request):
    return find_dialect(request.param).set_up(Start())


def drawn(count):
    rng = random.Random(count)
    for _ in range(count):
        shape = rng.choice(SHAPES)
        yield (shape % tuple(rng.uniform(1, 99) for _ in range(shape.count("%")))).encode()


def state():
    found = State()
    for name, value in VARIABLES.items():
        found.set_variable(name, value)
    found.unit = 1.0
    return found


def words(form, typed, dialect):
    """What a line is spelled as; empty where a number is not certain."""
    return Computed([(form, typed)], state(), dialect)._spelled


def test_lines_of_a_shape_are_taken_apart_once_and_say_what_each_says(dialect):
    asked = []
    forms = Forms(dialect, lambda text: asked.append(text) or parse_line(text, dialect))
    lines, certain = list(drawn(600)), 0
    assert len(set(lines)) > 500
    for line in lines:
        form, typed = forms.of(line)
        alone = form_of(parse_line(line, dialect), dialect)
        assert (form is None) == (alone is None), line
        if form is not None:
            assert words(form, typed, dialect) == words(alone, [], dialect), line
            certain += bool(words(form, typed, dialect))
    assert certain > 300
    assert len(asked) == len(SHAPES)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (b"G0 X[1.5*#1] Y2.5 (a)", b"G0 X[2.5*#1] Y2.5 (b)"),
        (b"G0 X[1.5*#<a>]", b"G0 X[2.5*#<a>]"),
        (b"X#1", b"X#2"),
        (b"X[#1*#10]", b"X[#1*#11]"),
        (b"G0 X[#1]", b"G1 X[#1]"),
    ],
)
def test_lines_that_differ_in_more_than_typed_numbers_have_forms_of_their_own(one, other):
    dialect = find_dialect("linuxcnc").set_up(Start())
    forms = Forms(dialect, lambda text: parse_line(text, dialect))
    first, second = forms.of(one), forms.of(other)
    assert first[0] is not second[0]
    assert not first[1]
    assert not second[1]


@pytest.mark.parametrize(
    "line",
    [
        *(b"G#1 X5.", b"M#1 X[#2]", b"N#1 X5.", b"H#1 X[#2]", b"T[#1]", b"D#1 X#2", b"P[#1*2]"),
        *(b"/G0 X#1", b"%", b"X#1 #2=5", b"G0 X[#1", b"X#1 X#2 #"),
    ],
)
def test_what_says_more_than_a_plain_line_has_no_form(dialect, line):
    block = parse_line(line, dialect)
    assert form_of(block, dialect) is None


def test_more_typed_numbers_than_there_are_names_for_are_no_shape(dialect):
    line = b"X[" + b"+".join([b"1.5"] * (computed.MOST_TYPED + 1)) + b"]"
    forms = Forms(dialect, lambda text: parse_line(text, dialect))
    form, typed = forms.of(line)
    assert not typed
    assert words(form, typed, dialect) == [b"X%.1f" % (1.5 * (computed.MOST_TYPED + 1))]


def test_what_is_remembered_is_bounded(dialect, monkeypatch):
    monkeypatch.setattr(computed, "REMEMBERED", 20)
    forms = Forms(dialect, lambda text: parse_line(text, dialect))
    for k in range(200):
        forms.of(b"X#%d" % k)  # no line is of another's shape
        forms.of(b"X%d.5Y[#%d*%d.5]" % (k, k, k))
        forms.of(b"Z-%d.%d.5 X[#%d]" % (k, k, k))
    assert len(forms._forms) <= 20
    assert len(forms._unlike) <= 20


def test_a_line_that_is_set_apart_has_no_form_again(dialect):
    forms = Forms(dialect, lambda text: parse_line(text, dialect))
    assert forms.of(b"X[1.5*#1]")[0] is not None
    forms.set_apart(b"X[1.5*#1]")
    assert forms.of(b"X[1.5*#1]") == (None, [])
    assert forms.of(b"X[2.5*#1]")[0] is not None
