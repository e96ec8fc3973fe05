"""Numbers as text, beside Python's own formatting."""

from decimal import Decimal

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from gcodejerk.emit.number_format import ROWS, Column, format_lines

PHASES = (Phase.explicit, Phase.reuse, Phase.generate)

# Ends of ranges and neighbours of powers of ten come up often.
whole = st.one_of(
    st.integers(-(10**6), 10**6),
    st.integers(-(10**15), 10**15),
    st.integers(0, 15).flatmap(lambda k: st.sampled_from([10**k - 1, 10**k, -(10**k), 10**k + 1])),
)


def by_python(value, decimals):
    """A whole number with an implied point, as Decimal writes it."""
    return format(Decimal(int(value)).scaleb(-decimals), f".{decimals}f")


@st.composite
def tables(draw):
    """Prefixes, numbers and decimals of a few columns, at least one of them with numbers."""
    count = draw(st.integers(1, 12))
    prefix = st.text("GXYZF ,0123456789", max_size=4).map(str.encode)
    columns = [
        (
            draw(prefix),
            draw(st.lists(whole, min_size=count, max_size=count)) if k == 0 or draw(st.booleans())
            else None,
            draw(st.integers(0, 9)),
        )
        for k in range(draw(st.integers(1, 4)))
    ]  # fmt: skip
    return draw(st.permutations(columns)), count


@given(tables(), st.sampled_from([b"\n", b"\r\n", b"\r"]))
@settings(deadline=None, phases=PHASES, max_examples=200)
def test_lines_are_those_that_python_formats(table, line_end):
    columns, count = table
    text, ends = format_lines(
        [Column(p, None if v is None else np.array(v, np.int64), d) for p, v, d in columns],
        line_end,
    )
    expected = [
        b"".join(p + (b"" if v is None else by_python(v[k], d).encode()) for p, v, d in columns)
        + line_end
        for k in range(count)
    ]
    assert text == b"".join(expected)
    assert ends.tolist() == np.cumsum([len(line) for line in expected]).tolist()


def test_many_lines_are_made_in_parts_that_join():
    rng = np.random.default_rng(3)
    count = 2 * ROWS + 17
    # Wide numbers stand in the last part only; the first has to be as wide.
    x, f = rng.integers(-99, 100, count), rng.integers(0, 10, count)
    x[-1], f[0] = -123456789012, 10**12
    text, ends = format_lines([Column(b"X", x, 3), Column(b" F", f, 0)], b"\n")
    lines = text.split(b"\n")
    assert lines.pop() == b""
    assert len(lines) == len(ends) == count
    for k in (0, 1, ROWS - 1, ROWS, 2 * ROWS, count - 1):
        assert lines[k] == f"X{by_python(x[k], 3)} F{f[k]}".encode()
        assert ends[k] == sum(len(line) + 1 for line in lines[: k + 1])


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (0, 0, b"0"),
        (0, 3, b"0.000"),
        (-1, 3, b"-0.001"),
        (5, 1, b"0.5"),
        (-1000, 3, b"-1.000"),
        (10000, 4, b"1.0000"),
        (99999, 4, b"9.9999"),
        (-(10**17), 9, b"-100000000.000000000"),
    ],
)
def test_single_numbers_are_written_as_expected(value, decimals, text):
    line, _ = format_lines([Column(b"X", np.array([value]), decimals)], b"\n")
    assert line == b"X" + text + b"\n"


def test_no_lines_are_no_text():
    text, ends = format_lines([Column(b"X", np.zeros(0, np.int64), 3)], b"\n")
    assert (text, ends.tolist()) == (b"", [])
