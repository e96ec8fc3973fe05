"""What stands around rapids is the same looked at one by one, and all of a chunk at once."""

import io

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcodejerk.nc import read_program
from gcodejerk.nc.interpreter import neighbours

MANY = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
LENGTH = st.sampled_from(["0", "1", "1.5", "-2", "0.01", ".25", "40"])
RAPID = st.builds("G0{}{}".format, st.sampled_from("XYZA"), LENGTH)
FEED = st.builds("G1 {}{}{}".format, st.sampled_from("XYZ"), LENGTH, st.sampled_from(["", " F30"]))
MODAL = st.builds("{}{}".format, st.sampled_from("XYZ"), LENGTH)
STILL = st.sampled_from(
    [
        *("", "(c)", "(" + "x" * 120 + ")", ";c", "N5", "G0", "G1", "F300", "F1", "R5", "I1", "K0"),
        *("S500", "G0X1S500", "G2 X1 Y1 I.5 J.5", "M5", "G4 P1", "G43 H1", "G90", "G91", "G94"),
        *("G64", "G61", "M8", "T1 M6", "G54", "G80", "#1=5", "G0X#1", "G93", "G20", "G21", "M0"),
    ]
)
LINES = st.lists(st.one_of(RAPID, FEED, MODAL, RAPID, STILL), min_size=1, max_size=120)


def around(monkeypatch, data, few):
    monkeypatch.setattr(neighbours, "FEW", few)
    rapids = read_program(io.BytesIO(data), neighbours=True).rapids
    return rapids.lone, rapids.queued


@MANY
@given(LINES, st.sampled_from(["F600", "F20", "F1", "G20 F5"]), st.sampled_from(["\n", "\r\n"]))
def test_one_by_one_and_all_at_once_agree(lines, head, end):
    text = end.join([f"G21 G90 G94 G17 G40 {head}", "G0 X0 Y0 Z0", *lines, *lines]) + end
    with pytest.MonkeyPatch.context() as patch:
        for data in (text.encode(), text.encode().rstrip()):
            together, alone = (around(patch, data, few) for few in (0, 1 << 60))
            assert np.array_equal(together[0], alone[0])
            assert np.array_equal(together[1], alone[1])


def test_they_agree_where_chunks_meet(monkeypatch):
    holes = [f"G0 X{k % 37} Y{k % 11}\nG1 Z-{k % 5}\nG0 Z5" for k in range(9)]
    body = [*holes, "(" + "c" * 300 + ")", "M8", *holes, "G91", *holes, "G90"]
    data = "\n".join(["G21 G90 G94 G17 G40 F600", "G0 Z5", *body * 4, "M2", ""]).encode()
    every = around(monkeypatch, data, 1 << 60)
    assert 0 < np.count_nonzero(every[0]) < len(every[0])
    assert 0 < np.count_nonzero(every[1]) < len(every[1])
    for size in (300, 511, 700, 2000):
        monkeypatch.setattr("gcodejerk.nc.text.chunks.CHUNK", size)
        found = around(monkeypatch, data, 0)
        assert np.array_equal(found[0], every[0])
        assert np.array_equal(found[1], every[1])


@pytest.mark.parametrize(
    ("computed", "queued"),
    # X11 takes 0.6 s at F100 and 10 ms at F6000; what the other one takes nobody knows.
    [("G1 X[#1]", True), ("G1 X[#1] F100", False), ("G1 G91 X[#1]", False), ("X[#1]F[#2]", False)],
)
def test_a_computed_motion_may_hide_how_fast_the_one_before_is(monkeypatch, computed, queued):
    feed = "F100" if queued else "F6000"
    lines = ["G21 G90 G94 G64", "#1=11.01", "#2=100", "G0 X10 Y0", "M3 S100", f"G1 X11 {feed}"]
    data = "\n".join([*lines, computed, "G90 G0 Y50", "M2", ""]).encode()
    assert around(monkeypatch, data, 1 << 60)[1][-1] == queued
