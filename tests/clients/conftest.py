"""The kit that runs LinuxCNC is no test: LinuxCNC starts parts of it with Python of its own."""

import sys
from pathlib import Path

# For `interpreter`, which several tests share.
sys.path.insert(0, str(Path(__file__).resolve().parent))

collect_ignore = ["linuxcnc", "freecad", "oracle.py"]

LONGEST = (
    *("test_what_is_played", "test_what_a_guard_costs", "test_the_drives_shake_less"),
    *("test_the_readmes_program_shakes", "test_holes_are_as_deep"),
)
"""Beginnings of names of tests that are played for long: they begin, so that none comes last."""


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: not item.name.startswith(LONGEST))
