"""docs/paper.md is true: every function it names exists, and its numbers are what they return."""

import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.motion.amplitudes import condition_amplitude
from gcodejerk.motion.profiles.conditions import condition_peaks

PAGE = (Path(__file__).parents[2] / "docs" / "paper.md").read_text(encoding="utf-8")
FUNCTIONS = sorted(set(re.findall(r"`(gcodejerk\.[\w.]+)`", PAGE)))
EXAMPLE = PAGE.split("## The worked example")[1]
ROWS = [
    [cell.strip() for cell in row.strip("|").split("|")]
    for row in EXAMPLE.splitlines()
    if re.match(r"\| (conv|Cond)", row)
]


def test_the_page_names_functions():
    assert len(FUNCTIONS) >= 12


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_that_the_page_names_exists(name):
    module, _, function = name.rpartition(".")
    found = getattr(import_module(module), function)
    assert callable(found)
    assert found.__module__ == module
    assert found.__doc__


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_numbers_of_the_page_are_the_functions(row):
    condition = match.group(1) if (match := re.search(r"Condition (I+)", row[0])) else "III"
    T1 = float(match.group(1)) if (match := re.search(r"T1 = (\d+)", row[0])) else 1e-9
    move = (condition, 1.0, T1 * 1e-3, 0.040)
    peaks = condition_peaks(*move)
    expected = [
        condition_amplitude(*move, 30.0),
        condition_amplitude(*move, 30.0, 0.02),
        condition_amplitude(*move, np.linspace(27.0, 33.0, 601)).max(),
        peaks.acceleration,
    ]
    for text, value in zip(row[1:5], expected, strict=True):
        digits = len(text.partition(".")[2])
        assert float(text) == pytest.approx(float(value), abs=0.51 * 10.0**-digits)
    if row[5] != "unbounded":
        assert float(row[5]) == pytest.approx(float(peaks.jerk), rel=2e-3)


def test_the_page_shows_a_row_for_every_profile():
    assert len(ROWS) == 5
