"""Options of the test run."""

import os
import tempfile

from hypothesis import settings

LONG = 100
"""How many times more examples `--long` draws."""


def pytest_configure(config):
    # No test reads or fills the user's own cache of solutions.
    os.environ["GCODEJERK_CACHE"] = tempfile.mkdtemp(prefix="gcodejerk-cache-")


def pytest_addoption(parser):
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write tests/golden/*/out.* anew; their difference is reviewed like code",
    )
    parser.addoption(
        "--long",
        action="store_true",
        help=f"draw {LONG} times as many examples in property tests: hours, on demand",
    )


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--long"):
        return
    for item in items:
        test = getattr(getattr(item, "obj", None), "hypothesis", None)
        own = getattr(item.obj, "_hypothesis_internal_use_settings", None)
        if test is not None and own is not None:
            examples = LONG * own.max_examples
            item.obj._hypothesis_internal_use_settings = settings(own, max_examples=examples)
