"""What is compared as bytes: on the arithmetic that it was made with, and on another.

A search ends where a few sines in single precision say, and numpy's sines differ in their last bit
from one kind of processor to the next. So where numpy does not compute with `MADE_WITH`, golden
files and what pages show are alike when what stands between the numbers is the same, byte for byte,
and no number differs by more than one in its last place or by `SHARE` of itself. Sums over an
output's own text say nothing there, and the speed of a block follows from the last places of two
points: that it does is what `verify` says of the same outputs.
"""

import re

import pytest

try:
    from numpy._core._multiarray_umath import __cpu_features__ as features
except ImportError:  # numpy 1
    from numpy.core._multiarray_umath import __cpu_features__ as features

MADE_WITH = {"AVX512_SKX", "X86_V4"}
"""What numpy calls the instructions that it then computes with; one name since 2.4."""
SHARE = 1e-5
NUMBER = re.compile(rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,2}(?![0-9]))?")
SUMS = re.compile(rb"\b[0-9a-f]{16}\b|(?<=M152 )P[0-9]{8} Q[0-9]{8}")
FEEDS = re.compile(rb"(?<=F)[0-9]+\.?[0-9]*")


def same_arithmetic():
    """Whether numpy computes here as it did when the golden files were written."""
    return any(features.get(name, False) for name in MADE_WITH)


def apart(number):
    """A number's value and the unit of its last place."""
    digits, _, exponent = number.lower().partition(b"e")
    places = len(digits.partition(b".")[2])
    return float(number), 10.0 ** (int(exponent or 0) - places)


def differences(output, golden):
    """What says that two texts are not alike; nothing where they are."""
    output, golden = (FEEDS.sub(b"", SUMS.sub(b"", text)) for text in (output, golden))
    if NUMBER.sub(b"#", output) != NUMBER.sub(b"#", golden):
        return ["what stands between the numbers"]
    pairs = zip(NUMBER.findall(output), NUMBER.findall(golden), strict=True)
    found = []
    for one, other in pairs:
        (a, unit), (b, unit_of_other) = apart(one), apart(other)
        if abs(a - b) > 1.01 * min(unit, unit_of_other) + SHARE * abs(b):
            found.append(f"{one.decode()} for {other.decode()}")
    return found


def alike(output, golden):
    """The same bytes, or on another arithmetic the same numbers but for their last place."""
    if same_arithmetic():
        return output == golden
    return not differences(output, golden)


def hold_golden(output, golden, request):
    """An output is the golden one; with `--update-golden` it becomes that."""
    if request.config.getoption("--update-golden"):
        golden.write_bytes(output)
    assert golden.exists(), f"no {golden.parent.name}/{golden.name} yet: run pytest --update-golden"
    hold(output, golden.read_bytes())


def hold(output, expected, about=""):
    """Two texts are alike; where they are not, pytest shows what differs."""
    if same_arithmetic():
        assert output == expected, about
    else:
        assert not differences(output, expected), about


@pytest.mark.parametrize(
    ("output", "golden", "alike"),
    [
        (b"G1 X1.2346 F600.", b"G1 X1.2345 F600.", True),
        (b"G1 X1.2347 F600.", b"G1 X1.2345 F600.", False),
        (b"G1 X12.5", b"G1 X12.501", True),
        (b"G1 X12.5", b"G1 X12.502", False),
        (b"G1 X1. Y2.", b"G1 X1. Z2.", False),
        (b"G1 X1.\n", b"G1 X1.\r\n", False),
        (b"N10 X1.", b"N12 X1.", False),
        (b"X0.410964408286", b"X0.410964406010", True),
        (b"X-0.001", b"X0.001", False),
        (b"1.5e-05", b"1.6e-05", True),
        (b"1.5e-05", b"1.5e-04", False),
        (b"(sum:e056bdbb72adf5b7 a)", b"(sum:2667ec40f1326293 a)", True),
        (b"M152 P14115066 Q04591939", b"M152 P04681707 Q02980792", True),
        (b"M153 P14115066 Q04591939", b"M153 P04681707 Q02980792", False),
    ],
)
def test_a_digit_in_the_last_place_is_all_that_may_differ(output, golden, alike):
    assert (not differences(output, golden)) == alike
