"""What several dialects read alike: held to the reading of each of them, on programs drawn in each.

The tables `rs274`, `iso-mill` and `any-mill` are written by hand; nothing else keeps them to their
members'.
"""

import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, note
from hypothesis import strategies as st

from gcodejerk.nc import DIALECTS, Start, read_program
from gcodejerk.nc.dialects import any_mill, iso_mill, rs274
from gcodejerk.reasons import CERTAIN
from gcodejerk.testing import programs

COMMON = {"rs274": rs274.MEMBERS, "iso-mill": iso_mill.MEMBERS, "any-mill": any_mill.MEMBERS}
PAIRS = [(name, member.name) for name, members in COMMON.items() for member in members]
ZERO = dict.fromkeys("XYZ", 0.0)
PAIRS += [
    *(("any-mill", "siemens"), ("any-mill", "centroid")),
    *(("uccnc", "linuxcnc"), ("centroid", "mach"), ("mitsubishi", "haas"), ("syntec", "fanuc")),
]
"""What is read in part, and relatives that it must not contradict."""
START = Start(
    positions=ZERO,
    offsets={"G54": {"X": -100.0, "Y": -50.0, "Z": -200.0}, "G55": {"X": 10.0, "Y": 0.0}},
    tool_lengths={1: 80.0},
    startup="G21 G90 G17 G94 G40",
    decimal_point="calculator",
    home=ZERO,
    tool_change={"Z": 0.0},
    spindle="mill",
)


def certain(text, dialect):
    """The certain rapids of a program by line, and all of them."""
    rapids = read_program(io.BytesIO(text), dialect=dialect, start=START).rapids
    lines = rapids.line.tolist()
    return {lines[i]: i for i in range(len(lines)) if rapids.reason[i] == CERTAIN}, rapids


@pytest.mark.parametrize(("common", "member"), PAIRS)
@given(data=st.data())
def test_what_is_certain_is_so_for_each_of_them(common, member, data):
    # To Siemens, which is no member, a comment in parentheses is none: its programs have no such.
    own = [member] if member == "siemens" else [common, member]
    text = data.draw(programs(data.draw(st.sampled_from(own))))
    note(text.decode("latin-1"))
    mine, rapids = certain(text, common)
    start = replace(START, startup="G71 G90 G17 G94 G40") if member == "siemens" else START
    theirs = read_program(io.BytesIO(text), dialect=member, start=start).rapids
    where = {line: i for i, line in enumerate(theirs.line.tolist())}
    for line, i in mine.items():
        assert line in where, f"line {line} is no rapid of {member}"
        j = where[line]
        named = [k for k in range(9) if rapids.words[i] >> k & 1]
        axes = {"XYZABCUVW"[k] for k in named}
        assert rapids.words[i] == theirs.words[j]
        for column in ("start", "target"):
            a, b = getattr(rapids, column)[i, named], getattr(theirs, column)[j, named]
            known = ~np.isnan(b)
            assert a[known] == pytest.approx(b[known], abs=1e-9), (line, column)
        if theirs.reason[j] == CERTAIN:
            # Where a whole number means itself, F200 and F200. are the same.
            whole = DIALECTS[member].whole_numbers == "machine"
            columns = [*["feed_whole"] * whole, *["diameter"] * ("X" in axes)]
            for column in ("inch", "incremental", *columns):
                assert getattr(rapids, column)[i] == getattr(theirs, column)[j], (line, column)


@pytest.mark.parametrize("name", COMMON)
def test_no_code_of_a_member_goes_unseen(name):
    """What turns, scales or bars for one of them lasts behind a block that is not understood."""
    common = DIALECTS[name]
    seen = {*common.transforms, *common.bars}
    seen |= {code for code, group in common.groups.items() if group == "compensation"}
    for member in COMMON[name]:
        lasting = {code for code, (_, begins) in member.transforms.items() if begins}
        assert lasting | set(member.bars) <= seen | {411, 421}  # not understood, ended by G40
        for code, group in common.groups.items():
            theirs = member.groups.get(code)
            if code in common.redrawn | common.drilling.unknown_ends:
                continue  # where the tool is behind such a code is not known
            if theirs is not None and group in member.groups.values():
                assert theirs == group or code in common.bars or f"G{code / 10:g}" in common.refused
    assert not any(
        {c for c, g in common.groups.items() if g == group} == {code}
        for group, code in common.defaults.items()
    )
