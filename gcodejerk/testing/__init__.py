"""Strategies and checks for users' own property tests (needs the extra `testing`: hypothesis).

>>> from gcodejerk.testing import assert_stream_valid, machines, moves, programs
"""

from gcodejerk.testing.cycles import cycle_programs
from gcodejerk.testing.machines import machines
from gcodejerk.testing.programs import programs
from gcodejerk.testing.streams import assert_stream_valid, moves

__all__ = ["assert_stream_valid", "cycle_programs", "machines", "moves", "programs"]
