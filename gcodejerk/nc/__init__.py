"""The program as written: words, blocks, modal groups, rapids. Knows no physics and no machine."""

from __future__ import annotations

from gcodejerk.nc.block import Block, Word
from gcodejerk.nc.dialect import AXES, DIALECTS, Dialect
from gcodejerk.nc.program import Finding, Program, parse_block, read_program, trace
from gcodejerk.nc.rapids import CERTAIN, REASONS, Rapids
from gcodejerk.nc.start import Start

__all__ = [
    "AXES",
    "CERTAIN",
    "DIALECTS",
    "REASONS",
    "Block",
    "Dialect",
    "Finding",
    "Program",
    "Rapids",
    "Start",
    "Word",
    "parse_block",
    "read_program",
    "trace",
]
