"""The strategy that draws programs: what it promises to users."""

import io

import pytest
from hypothesis import HealthCheck, Phase, find, given, settings
from hypothesis import strategies as st

from gcodejerk.errors import ProgramError
from gcodejerk.nc import CERTAIN, REASONS, Start, read_program
from gcodejerk.nc.dialects import DIALECTS
from gcodejerk.reasons import Reason
from gcodejerk.testing.programs import programs

# Whether there is one at all matters, not which is the smallest: no shrinking.
ANY = settings(
    max_examples=2000,
    deadline=None,
    derandomize=True,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
QUICK = settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))


@QUICK
@given(programs())
def test_a_drawn_program_has_an_end_and_no_line_that_is_not_understood(data):
    program = read_program(io.BytesIO(data))
    messages = [finding.message for finding in program.findings]
    assert not any("without M2" in message for message in messages)


@pytest.mark.parametrize(
    "wanted",
    [
        *(Reason.START_UNKNOWN, Reason.CANNED_CYCLE, Reason.FRAME_CHANGE, Reason.BLOCK_DELETE),
        *(Reason.NO_MOTION, None),
    ],
)
def test_drawn_programs_hold_rapids_of_every_common_kind(wanted):
    entry = CERTAIN if wanted is None else REASONS.index(wanted)

    def holds(data):
        return entry in read_program(io.BytesIO(data)).rapids.reason

    assert find(programs(), holds, settings=ANY)


@pytest.mark.parametrize(
    "condition",
    [
        lambda data: b"\r\n" in data,
        lambda data: data.startswith(b"%"),
        lambda data: b"G20" in data,
        lambda data: b"G91" in data,
        lambda data: b"(" in data,
        lambda data: not data.endswith(b"\n"),
    ],
    ids=["CR LF", "percent", "inches", "incremental", "comments", "no last newline"],
)
def test_drawn_programs_are_varied(condition):
    assert find(programs(), condition, settings=ANY)


def test_a_dialect_that_is_not_drawn_is_refused():
    with pytest.raises(ProgramError, match="heidenhain"):
        find(programs(dialect="heidenhain-iso"), lambda data: True)


WRITTEN = sorted(name for name, dialect in DIALECTS.items() if dialect.writing is not None)


@pytest.mark.parametrize("dialect", WRITTEN)
def test_programs_are_drawn_for_every_dialect_that_has_streams(dialect):
    start = Start(decimal_point="calculator", diameter="lathe" in dialect)

    def holds(data):
        return CERTAIN in read_program(io.BytesIO(data), dialect=dialect, start=start).rapids.reason

    assert find(programs(dialect), holds, settings=ANY)


@given(st.data())
@settings(max_examples=20, deadline=None)
def test_the_strategy_can_be_drawn_from_within_a_test(data):
    assert isinstance(data.draw(programs("linuxcnc")), bytes)
