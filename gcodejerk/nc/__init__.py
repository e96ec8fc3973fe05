"""The program as written: words, blocks, modal groups, rapids. Knows no physics and no machine."""

from __future__ import annotations

from gcodejerk.nc.dialects import AUTO, DIALECTS, dialect_of, find_dialect
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.initial import check_start
from gcodejerk.nc.interpreter.rapids import Rapids
from gcodejerk.nc.interpreter.runner import Finding
from gcodejerk.nc.program import Program, parse_block, read_program, trace
from gcodejerk.nc.text.block import Block, Name, Word
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.start import Start

__all__ = [
    "AUTO",
    "CERTAIN",
    "DIALECTS",
    "REASONS",
    "Block",
    "Dialect",
    "Finding",
    "Name",
    "Program",
    "Rapids",
    "Start",
    "Word",
    "check_start",
    "dialect_of",
    "find_dialect",
    "parse_block",
    "read_program",
    "trace",
]
