"""CYCLE81 and its kin: where they leave the tool, and that both readings know it."""

import io
import math

import pytest

from gcodejerk.nc import Start, read_program
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

START = Start(startup="G17 G90 G94 G71 G40 G64", spindle="mill")
HEAD = b"G17 G90 G94 G71 G64 F200\nG0 X1 Y2 Z50\n"


def behind(body, start=START, head=HEAD):
    """Where the last rapid starts, whether its F is known, and whether it is confirmed."""
    text = head + body + b"G0 X99 Z60\nM30\n"
    rapids = read_program(io.BytesIO(text), dialect="siemens", start=start).rapids
    last = len(rapids) - 1
    assert rapids.line[last] == text.count(b"\n") - 1
    found = Findings(9)
    n = confirm(io.BytesIO(text), "siemens", start, rapids, [last], found)
    assert not found.sorted()
    place = [None if math.isnan(x) else float(x) for x in rapids.start[last, :3]]
    return place, float(rapids.feed[last]) == 200.0, n


CERTAIN = {
    b"CYCLE81(40,0,2,-5)\n": ([1, 2, 40], True),
    b"N10 CYCLE81( 40.5 , 0, 2, -5, )\n": ([1, 2, 40.5], True),
    b"CYCLE81(40,0,2,,5)\n": ([1, 2, 40], True),
    b"CYCLE82(40,0,2,-5,,0.5)\n": ([1, 2, 40], True),
    b"CYCLE82(40,0,2,-5,,0.5,0,0,0)\n": ([1, 2, 40], True),
    b"CYCLE83(40,0,2,-20,,-5,,1,0,0,1,0)\n": ([1, 2, 40], False),
    b"CYCLE85(40,0,2,-5,,0,100,200)\n": ([1, 2, 40], False),
    b"CYCLE89(40,0,,-5)\n": ([1, 2, 40], True),
    b"MCALL CYCLE81(40,0,2,-5)\nG0 X5\nY6\nMCALL\n": ([5, 6, 40], True),
    b"MCALL CYCLE81(40,0,2,-5)\nMCALL\n": ([1, 2, 50], True),
    b"MCALL CYCLE83(40,0,2,-20,,-5,,1,0,0,1,0)\nX5\nMCALL\n": ([5, 2, 40], False),
    # a way of no length: nobody knows whether it drills
    b"MCALL CYCLE81(40,0,2,-5)\nX1 Y2\nMCALL\n": ([1, 2, None], True),
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nX5\nMCALL\n": ([5, 2, 40], True),
    b"G91\nMCALL CYCLE81(40,0,2,-5)\nX5\nX5\nMCALL\nG90\n": ([11, 2, 40], True),
}


@pytest.mark.parametrize("body", CERTAIN)
def test_a_cycle_comes_back_to_its_retraction_plane(body):
    place, feed, confirmed = behind(body)
    assert (place, feed) == CERTAIN[body]
    assert confirmed == (None not in place)


UNCERTAIN = [
    b"CYCLE86(40,0,2,-5,,0,3,0,0,0,0)\n",
    b"CYCLE81(R1,0,2,-5)\n",
    b"CYCLE81(40,0,2)\n",  # no depth
    b"CYCLE81(40,0,2,5)\n",  # above the surface
    b"CYCLE81(1,0,2,-5)\n",  # comes back below where it starts
    b"CYCLE81(40,0,-2,-5)\n",
    b"CYCLE81(40,,2,-5)\n",
    b"CYCLE82(40,0,2,-5,,0.5,0,1,11)\n",
    b"CYCLE83(40,0,2,-20,,-5,,1,0,0,1,0,1)\n",
    b"CYCLE81(40,0,2,-5) X5\n",
    b"G0 X5 CYCLE81(40,0,2,-5)\n",
    b"CYCLE81(40,0,2,-5) M8\n",
    b"CYCLE81\n",
    b"G18\nCYCLE81(40,0,2,-5)\nG17\n",
    b"G70\nCYCLE81(2,0,.1,-.5)\nG71\n",
    b"ROT RPL=45\nCYCLE81(40,0,2,-5)\nROT\n",
    b"G41 G1 X9\nCYCLE81(40,0,2,-5)\nG40\n",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nHOLES1(0,0,0,10,10,3)\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5)\nG2 X5 I2 J0\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5)\nMCALL CYCLE86(40,0,2,-5)\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5) X5\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nMCALL CYCLE81(30,0,2,-5)\nMCALL\n",
    b"MCALL L20\nX5\nMCALL\n",
    b"MCALL CYCLE81(40,0,2,-5)\nX5\nMCALL X7\n",
    b"MCALL CYCLE81(40,0,2,-5)\nG74 Z1=0\nMCALL\n",
]


@pytest.mark.parametrize("body", UNCERTAIN)
def test_what_is_not_certain_leaves_the_drilling_axis_unknown(body):
    place, _, confirmed = behind(body)
    assert place[2] is None
    assert not confirmed


def test_rapids_while_mcall_is_in_force_are_left_alone():
    text = HEAD + b"MCALL CYCLE81(40,0,2,-5)\nG0 X5\nX6\nMCALL\nG0 X7\nM30\n"
    rapids = read_program(io.BytesIO(text), dialect="siemens", start=START).rapids
    found = Findings(9)
    assert confirm(io.BytesIO(text), "siemens", START, rapids, [1], found) == 0
    assert found.sorted(), "a stream in the place of a hole would drill at every point"
