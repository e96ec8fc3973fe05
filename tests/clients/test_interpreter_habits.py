"""What LinuxCNC 2.9 does that no manual says, and that moves the tool elsewhere.

The oracle is the canonical machine behind the interpreter: where its last motion ended, there the
tool stands, whatever the interpreter itself believes.
"""

import io
import itertools
import math
import re
import shutil
import subprocess
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from interpreter import run_oracle

from gcodejerk.axes import AXES
from gcodejerk.nc import CERTAIN, Start, read_program, trace
from gcodejerk.nc.dialects.linuxcnc import LINUXCNC

STARTUP = "G17 G21 G40 G49 G54 G64 G90 G94 G97"
AT_ZERO = Start(
    positions=dict.fromkeys(AXES, 0.0), offsets={"G54": dict.fromkeys(AXES, 0.0)}, startup=STARTUP
)
PLANES = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}
CYCLES = {
    "G73": "Q2", "G74": "P0.1", "G81": "", "G82": "P0.1", "G83": "Q2", "G84": "P0.1", "G85": "",
    "G86": "P0.1", "G87": "I1 J1 K1", "G88": "P0.1", "G89": "P0.1",
}  # fmt: skip
NOT_ASSUMED = {("G88", plane) for plane in PLANES} | {
    (code, plane) for code in ("G74", "G84") for plane in ("G18", "G19")
}
"""Where the tool is left elsewhere than the manual says."""
MANUAL = replace(
    LINUXCNC,
    drilling=replace(LINUXCNC.drilling, unknown_ends=frozenset(), only_in_xy=frozenset()),
)

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]


def ends(text, folder, name):
    """Where the tool stands after the program, by its canonical motions; None if refused."""
    path = folder / name
    path.write_text(text)
    (folder / "tools.tbl").write_text("T1 P1 Z1 D5\n")
    tools = folder / "tools.tbl"
    done = run_oracle(path, "--startup", STARTUP, "--tool-table", tools, timeout=60)
    moves = re.findall(r"^\d+ (?:TRAVERSE|FEED) (.*)$", done.stdout, re.MULTILINE)
    return None if done.returncode else tuple(float(v) for v in moves[-1].split()[:3])


def drilling(code, plane, retract, distance):
    first, second, along = PLANES[plane]
    clearance = "R30" if distance == "G90" else "R3"
    spindle = "M4" if code == "G74" else "M3"
    return (
        f"S100 {spindle}\nF100\nG0 X1 Y2 Z50\n{plane} {retract} {distance}\n"
        f"{code} {first}10 {second}20 {along}-5 {clearance} {CYCLES[code]}\nG80\nM2\n"
    )


def test_every_cycle_in_every_plane_leaves_the_tool_where_it_is_read_to_be(tmp_path):
    kinds = list(itertools.product(CYCLES, PLANES, ("G98", "G99"), ("G90", "G91")))
    texts = [drilling(*kind) for kind in kinds]
    real = [ends(text, tmp_path, f"{k}.ngc") for k, text in enumerate(texts)]
    compared = 0
    for kind, text, where in zip(kinds, texts, real, strict=True):
        lines = list(trace(io.BytesIO(text.encode()), start=AT_ZERO))
        ours = lines[5][1][:3]
        assert where is not None, kind
        if kind[:2] in NOT_ASSUMED:
            assert all(map(math.isnan, ours)), kind
            by_the_manual = list(trace(io.BytesIO(text.encode()), start=AT_ZERO, dialect=MANUAL))
            assert by_the_manual[5][1][:3] != pytest.approx(where, abs=1e-6), kind
        else:
            assert ours == pytest.approx(where, abs=1e-6), kind
            compared += 1
    assert compared == len(kinds) - 4 * len(NOT_ASSUMED)


INI = """[EMC]
VERSION = 1.1
[RS274NGC]
PARAMETER_FILE = {folder}/rotary.var
[TRAJ]
COORDINATES = X Y Z A
[EMCIO]
TOOL_TABLE = {folder}/tools.tbl
[AXIS_A]
WRAPPED_ROTARY = {wrapped}
"""


def turns(text, folder, wrapped):
    """End of every move of A."""
    (folder / "rotary.ini").write_text(INI.format(folder=folder, wrapped=int(wrapped)))
    (folder / "tools.tbl").write_text("T1 P1 Z1 D5\n")
    (folder / "rotary.var").write_text("")
    (folder / "rotary.ngc").write_text(text)
    done = subprocess.run(
        ["rs274", "-g", "-i", "rotary.ini", "rotary.ngc"],
        cwd=folder, capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    return [
        float(values.split(",")[3])
        for values in re.findall(r"STRAIGHT_(?:TRAVERSE|FEED)\((.*)\)", done.stdout)
    ]


ANGLES = st.integers(-359_999, 359_999).map(lambda n: f"{n / 1000:.3f}")
WORDS = st.lists(
    st.tuples(st.sampled_from(["G90 G0", "G90 G0", "G90 G1 F100", "G91 G0"]), ANGLES),
    min_size=20, max_size=60,
)  # fmt: skip


@pytest.mark.parametrize("wrapped", [True, False])
@settings(
    max_examples=8, deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)
@given(words=WORDS)
def test_a_rotary_axis_turns_as_the_interpreter_turns_it(tmp_path_factory, words, wrapped):
    text = "G21 G94 G17 G40 G64\n" + "".join(f"{code} A{angle}\n" for code, angle in words)
    text += "G90 G0 A-0.000\nA0\nA-0\nA359.999\nA-359.999\nM2\n"
    real = turns(text, tmp_path_factory.mktemp("rotary"), wrapped)
    start = Start(
        positions=AT_ZERO.positions, startup=STARTUP, wraps={"A": "sign" if wrapped else "none"}
    )
    data = text.encode()
    read = [positions[3] for _, positions, _ in trace(io.BytesIO(data), start=start)][1:-1]
    assert read == pytest.approx(real, abs=1e-4)  # rs274 prints four decimals
    for fast in (True, False):
        rapids = read_program(io.BytesIO(data), start=start, fast=fast).rapids
        certain = rapids.reason == CERTAIN
        assert certain.any()
        assert rapids.target[certain, 3] == pytest.approx(
            [real[line - 2] for line in rapids.line[certain]], abs=1e-4
        )


@pytest.mark.parametrize(
    "way", ["G28", "G28 X5 Y5 Z9", "G91 G28 Z0\nG90\nG28 X5 Y5", "G91 G28 X1 Y2 Z3\nG90"]
)
def test_g28_leads_home_from_everywhere(way, tmp_path):
    """Its parameters are all 0 here, and where that is, the work offset says."""
    offsets = {"X": -100.0, "Y": -50.0, "Z": -20.0}
    head = "G10 L2 P1 X-100 Y-50 Z-20\nG54\nG0 X5 Y5 Z5\n"
    home = ends(f"{head}{way}\nM2\n", tmp_path, "home.ngc")
    start = replace(AT_ZERO, offsets={"G54": offsets}, home=dict.fromkeys("XYZ", 0.0))
    *_, (_, positions, _), _ = trace(io.BytesIO(f"G0 X5 Y5 Z5\n{way}\nM2\n".encode()), start=start)
    assert home == pytest.approx(positions[:3])
    assert home == pytest.approx((100.0, 50.0, 20.0))
