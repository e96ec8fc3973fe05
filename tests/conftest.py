"""Options of the test run."""

import os
import tempfile


def pytest_configure():
    """No test reads or fills the user's own cache of solutions."""
    os.environ["GCODEJERK_CACHE"] = tempfile.mkdtemp(prefix="gcodejerk-cache-")


def pytest_addoption(parser):
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write tests/golden/*/out.* anew; their difference is reviewed like code",
    )
