"""The kit that runs LinuxCNC is no test: LinuxCNC starts parts of it with Python of its own."""

import sys
from itertools import zip_longest
from pathlib import Path

import pytest

# For `interpreter`, which several tests share.
sys.path.insert(0, str(Path(__file__).resolve().parent))

collect_ignore = ["linuxcnc", "freecad", "oracle.py"]

LONGEST = (
    *("test_what_is_played", "test_what_a_guard_costs", "test_the_drives_shake_less"),
    *("test_the_readmes_program_shakes", "test_holes_are_as_deep"),
)
"""Beginnings of names of tests that are played for long: they begin, so that none comes last."""


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    # Of what `-m` has left: a process is handed two tests at first, a long one and a short one.
    long = [item for item in items if item.name.startswith(LONGEST)]
    short = [item for item in items if not item.name.startswith(LONGEST)]
    pairs = zip_longest(long, short[: len(long)])
    items[:] = [item for pair in pairs for item in pair if item] + short[len(long) :]
