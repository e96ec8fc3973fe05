"""What several dialects read alike: held to the reading of each of them, on programs drawn in each.

The tables `rs274`, `iso-mill` and `any-mill` are written by hand; nothing else keeps them to their
members'.
"""

import io
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, note
from hypothesis import strategies as st

from gcodejerk.errors import ProgramError
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


STARTING = (
    *("G0", "G1", "G8", "G15", "G49", "G50", "G50.1", "G54", "G61", "G64", "G64 P0.01", "G67"),
    *("G69", "G80", "G90.1", "G91.1", "G97", "G98", "G99", "M5", "M9", "M48"),
)
"""Further codes that a control may start with."""


@cache
def accepts(dialect, codes):
    """Whether a reading takes codes for those that its control starts with."""
    try:
        read_program(io.BytesIO(b"M30\n"), dialect=dialect, start=replace(START, startup=codes))
    except ProgramError:
        return False
    return True


def certain(text, dialect, start=START):
    """The certain rapids of a program by line, and all of them."""
    rapids = read_program(io.BytesIO(text), dialect=dialect, start=start).rapids
    lines = rapids.line.tolist()
    return {lines[i]: i for i in range(len(lines)) if rapids.reason[i] == CERTAIN}, rapids


@pytest.mark.parametrize(("common", "member"), PAIRS)
@given(data=st.data())
def test_what_is_certain_is_so_for_each_of_them(common, member, data):
    # To Siemens, which is no member, a comment in parentheses is none: its programs have no such.
    own = [member] if member == "siemens" else [common, member]
    text = data.draw(programs(data.draw(st.sampled_from(own))))
    note(text.decode("latin-1"))
    start = START
    if member != "siemens":
        ours = [codes for codes in STARTING if all(accepts(d, codes) for d in (common, member))]
        further = data.draw(st.lists(st.sampled_from(ours), max_size=3, unique=True))
        modes = data.draw(st.sampled_from(["G21 G90", "G21 G91", "G20 G90", "G21"]))
        startup = " ".join([modes, "G17 G94 G40", *further])
        assume(all(accepts(d, startup) for d in (common, member)))
        start = replace(START, startup=startup)
    note(start.startup)
    mine, rapids = certain(text, common, start)
    if member == "siemens":
        start = replace(START, startup="G71 G90 G17 G94 G40")
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


PLAIN = b"G0 X1. Y2.\nG1 Z-1. F100.\nG0 Z5.\nG0 X30. Y4.\nG3 X40. Y4. I5. J0. F100.\nG0 X3. Y9.\n"
"""A program that leaves every mode to the control."""


@pytest.mark.parametrize("common", COMMON)
def test_what_a_control_starts_with_holds_for_the_program(common):
    compared = 0
    for member in COMMON[common]:
        for modes in ("G21 G90", "G21 G91", "G20 G90", "G20 G91"):
            for codes in ("", "G17", "G18", "G94", "G95", "G40", *STARTING):
                startup = f"{modes} {codes}".strip()
                if not all(accepts(d, startup) for d in (common, member.name)):
                    continue
                start = replace(START, startup=startup)
                mine, rapids = certain(PLAIN, common, start)
                theirs = read_program(io.BytesIO(PLAIN), dialect=member.name, start=start).rapids
                where = {line: i for i, line in enumerate(theirs.line.tolist())}
                for line, i in mine.items():
                    j = where[line]
                    assert theirs.reason[j] == CERTAIN, (startup, line)
                    for column in ("start", "target", "inch", "incremental", "feed_mode"):
                        one, other = getattr(rapids, column)[i], getattr(theirs, column)[j]
                        known = ~np.isnan(one)  # an axis that stands still need not be
                        assert np.array_equal(one[known], other[known]), (startup, line, column)
                    compared += 1
    assert compared > 50


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
