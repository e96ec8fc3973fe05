"""The second reading against the first: no false alarm, and every mistake of the first noticed.

The first reading's results are falsified here, rapid by rapid, as a mistake in `nc` would falsify
them; what the programs say is not touched.
"""

import io

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.nc.dialects import DIALECTS
from gcodejerk.testing.cycles import cycle_programs
from gcodejerk.testing.programs import programs
from gcodejerk.verification.agreement import confirm
from gcodejerk.verification.findings import Findings

WRITTEN = sorted(name for name, dialect in DIALECTS.items() if dialect.writing is not None)
CALM = settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
KNOWN = dict.fromkeys("XYZABC", 0.0)


def start_of(dialect, known=True):
    return Start(
        positions=KNOWN if known else {},
        offsets={"G54": KNOWN, "G55": dict.fromkeys("XYZ", 7.0)} if known else {},
        tool_lengths={1: 12.5},
        decimal_point="calculator",
        diameter="lathe" in dialect,
    )


def read(data, dialect, start):
    return read_program(io.BytesIO(data), dialect=dialect, start=start).rapids


def judge(data, dialect, start, rapids, rows=None):
    """Violations and how many rapids are confirmed."""
    rows = np.flatnonzero(rapids.reason == CERTAIN) if rows is None else rows
    found = Findings(100)
    return found.violations, confirm(io.BytesIO(data), dialect, start, rapids, rows, found)


@pytest.mark.parametrize("dialect", WRITTEN)
@CALM
@given(st.data(), st.booleans())
def test_the_second_reading_agrees_with_the_first(dialect, data, known):
    program, start = data.draw(programs(dialect)), start_of(dialect, known)
    violations, _ = judge(program, dialect, start, read(program, dialect, start))
    assert not violations


@CALM
@given(cycle_programs())
def test_the_second_reading_agrees_behind_drilling_cycles(data):
    start = start_of("linuxcnc")
    violations, _ = judge(data, "linuxcnc", start, read(data, "linuxcnc", start))
    assert not violations
