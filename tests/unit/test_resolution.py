"""Resolutions: what a machine file may say, and what a control keeps of a number."""

import itertools
import re
from dataclasses import replace
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcodejerk.errors import MachineError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import DIALECTS
from gcodejerk.reasons import Reason
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import Kind, verify

VMC = Machine.load(find_machine("vmc"))
TEXT = """\
interval: 0.001
positioning: linear
axes:
  X: {{resolution: {}, rapid: {{velocity: 300, acceleration: 2000, jerk: 5.0e+4}}}}
"""


@pytest.mark.parametrize("resolution", ["0.11", "1", "1600", "0.1000001"])
def test_a_resolution_above_a_tenth_is_refused(resolution):
    with pytest.raises(MachineError, match=r"axes.X.resolution is .* at most 0.1 \[mm\]"):
        Machine.loads(TEXT.format(resolution))


def test_a_tenth_of_a_degree_is_the_coarsest_too():
    text = TEXT.format("0.2").replace("  X: {", "  A: {type: rotary, ")
    with pytest.raises(MachineError, match=r"\[deg\]"):
        Machine.loads(text)


def test_the_limit_of_a_file_in_inches_is_in_millimetres():
    with pytest.raises(MachineError, match="resolution"):
        Machine.loads("units: inch\n" + TEXT.format("0.005"))
    Machine.loads("units: inch\n" + TEXT.format("0.0001"))


@pytest.mark.parametrize(
    ("resolution", "warned"), [("0.1", 1), ("0.02", 1), ("0.01", 0), ("1e-3", 0)]
)
def test_a_resolution_above_a_hundredth_is_warned_of(resolution, warned, command, tmp_path):
    machine = Machine.loads(TEXT.format(resolution))
    assert sum("resolution" in str(warning) for warning in machine.warnings) == warned
    (tmp_path / "m.yaml").write_text(TEXT.format(resolution))
    code, out = command("machine", "check", "m.yaml")
    assert (code, out.count("warning: axes.X.resolution")) == (0, warned)
    result = process(b"G21 G90 G94\nG0 X0\nG0 X5\nM2\n", machine, controller="mach", dialect="mach")
    assert any("machine file is doubtful" in note for note in result.notes) >= bool(warned)


def machine_for(dialect, resolution):
    axes = tuple(
        replace(
            a, travel=None, resolution=resolution, diameter="lathe" in dialect and a.name == "X"
        )
        for a in VMC.axes
    )
    program = replace(
        VMC.program, start=dict.fromkeys("XYZ", 0.0), decimal_point="calculator", startup=""
    )
    design = replace(VMC.design, minimum_length=0.0)
    return replace(VMC, axes=axes, program=program, dialect=dialect, design=design)


HEADS = {
    "fanuc": "G{u} G17 G40 G94 G64 F100.\n",
    "haas": "G{u} G17 G40 G94 G64 F100.\n",
    "mach": "G{u} G17 G94 G64 F100\n",
    "grbl": "G{u} G17 G94 F100\n",
    "fanuc-lathe-b": "G{u} G18 G40 G94 G64 F100.\n",
    "siemens": "G{s} G17 G40 G94 G64 F100\n",
}
NUMBER = re.compile(rb"([XYZ])(-?[0-9.]+)")


@pytest.mark.parametrize("dialect", HEADS)
@pytest.mark.parametrize("inch", [False, True])
@pytest.mark.parametrize("incremental", [False, True])
@pytest.mark.parametrize("resolution", [0.001, 0.0005, 0.002, 0.01])
def test_points_are_whole_steps_that_the_control_keeps(dialect, inch, incremental, resolution):
    head = HEADS[dialect].format(u=20 if inch else 21, s=700 if inch else 710)
    unit = 25.4 if inch else 1.0
    mode = "G91" if incremental else "G90"
    cross = "Z" if "lathe" in dialect else "Y"
    moves = [(12.3, 0.004), (0.004, 0.0), (-7.77, 0.0023), (0.05, -0.007), (3.3333, 2.2222)]
    lines = [f"{mode} G0 X0. {cross}0."]
    lines += [f"G0 X{a / unit:.5f} {cross}{b / unit:.5f}" for a, b in moves]
    data = (head + "\n".join(lines) + "\nM30\n").encode()
    result = process(data, machine_for(dialect, resolution), dialect=dialect, controller="mach")
    assert result.planned
    step = Decimal(repr(resolution))
    if inch:
        step = Decimal(1).scaleb(-int({0.001: 4, 0.0005: 4, 0.002: 4, 0.01: 3}[resolution]))
    lines = [*result.output.splitlines(), b""]
    pairs = itertools.pairwise(lines)
    inner = [a for a, b in pairs if a.startswith(b"G1 ") and b.startswith(b"G1 ")]
    assert len(inner) > 20
    for line in inner:
        for letter, number in NUMBER.findall(line):
            value = Decimal(number.decode())
            whole = 2 * step if letter == b"X" and "lathe" in dialect else step
            assert value % whole == 0, line
            digits = DIALECTS[dialect].writing.digits
            assert len(number.translate(None, b"-.")) <= digits, line


def test_linuxcnc_keeps_the_decimals_of_a_double():
    data = b"G21 G91 G94 G64 F100\nG0 X12.3 Y0.004\nM2\n"
    machine = machine_for("linuxcnc", 0.001)
    lines = process(data, machine).output.splitlines()
    assert any(
        len(n.partition(b".")[2]) > 3
        for line in lines
        for a, n in NUMBER.findall(line)
        if a == b"Y"
    )


@pytest.mark.parametrize(("x", "planned"), [("9999.5", 2), ("99999.5", 1)])
def test_a_point_with_more_digits_than_the_control_reads_is_not_written(x, planned):
    data = f"G21 G17 G90 G94 G64 F100.\nG0 X0. Y0.\nG0 Y5.\nG0 X{x}\nM30\n".encode()
    machine = machine_for("fanuc", 0.0001)
    machine = replace(machine, dialect="fanuc")
    result = process(data, machine, dialect="fanuc", controller="fanuc")
    assert result.planned == planned
    if planned == 1:
        from gcodejerk.reasons import REASONS

        assert str(REASONS[result.plans.reason[-1]]) == "line or number too long for the control"


FAST = """
interval: 0.001
positioning: linear
axes:
  X:
    resolution: {}
    rapid: {{velocity: 1800, acceleration: 10000, jerk: 1.0e+6}}
    modes: [{{frequency: 30, damping: 0.02}}]
program: {{start: {{X: 0}}}}
"""


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "grbl"])
@pytest.mark.parametrize("resolution", ["0.001", "1.0e-5"])
def test_f_has_no_more_digits_than_the_control_reads(dialect, resolution):
    data = (HEADS[dialect].format(u=21) + "G90\nG0 X800.\nM30\n").encode()
    machine = Machine.loads(FAST.format(resolution))
    made = process(data, machine, dialect=dialect, controller=dialect)
    assert made.planned == 1
    lines = [line for line in made.output.splitlines() if line.startswith(b"G1 ")]
    feeds = [line.rpartition(b" F")[2] for line in lines]
    assert max(map(float, feeds)) > 100_000.0
    assert max(len(feed.replace(b".", b"")) for feed in feeds) == 8
    fastest = max(feeds, key=float)
    longer = made.output.replace(b" F" + fastest, b" F" + fastest + b"0", 1)
    found = verify(data, longer, machine, dialect=dialect, controller=dialect)
    assert {violation.kind for violation in found.violations} == {Kind.FORM}


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "grbl", "siemens"])
@pytest.mark.parametrize("stream", [0, 1, 2])
def test_f_of_the_last_point_has_no_more_digits_either(dialect, stream):
    """The first stream is read word by word, the others by their form."""
    head = HEADS[dialect].format(u=21, s=710)
    data = (head + "G90\nG0 X800.\nG0 X5.\nG0 X760.\nM30\n").encode()
    machine = Machine.loads(FAST.format("0.001"))
    made = process(data, machine, dialect=dialect, controller=dialect)
    assert made.planned == 3
    lines = made.output.split(b"\n")
    lasts = [
        k
        for k, line in enumerate(lines)
        if line.startswith(b"G1 ") and not lines[k + 1].startswith(b"G1 ")
    ]
    assert len(lasts) == 3
    at = lasts[stream]
    written = lines[at].rpartition(b" F")[2].replace(b".", b"")
    digits = len(written) if dialect == "siemens" else 8
    for zeros, kinds in (
        (digits - len(written), set()),
        (digits - len(written) + (6 if dialect == "siemens" else 1), {Kind.FORM}),
        (60, {Kind.FORM}),
    ):
        longer = [*lines[:at], lines[at] + b"0" * zeros, *lines[at + 1 :]]
        found = verify(data, b"\n".join(longer), machine, dialect=dialect, controller=dialect)
        assert {v.kind for v in found.violations if v.kind != Kind.STAMP} == kinds


def coarse(dialect, resolution):
    """A machine whose control keeps coarser steps than programs may be written in."""
    axes = tuple(replace(axis, travel=None, resolution=resolution) for axis in VMC.axes)
    program = replace(VMC.program, decimal_point="calculator", startup="G21 G90 G94 G17")
    spindle = replace(VMC, axes=axes, controller=dialect, dialect=dialect, spindle="mill")
    return replace(spindle, program=program)


@pytest.mark.parametrize("dialect", ["grbl", "mach", "fanuc", "haas", "siemens"])
def test_an_axis_that_moves_between_two_steps_is_left_alone(dialect):
    units = "G71" if dialect == "siemens" else "G21"
    text = f"{units} G90 G94\nG0 X30.839 Y15.756 F900\nG0 X62.839 Y15.754\nG0 X20.8 Y1.7\nM30\n"
    machine = coarse(dialect, 0.01)
    if dialect == "siemens":
        machine = replace(machine, program=replace(machine.program, startup="G71 G90 G64 G17"))
    result = process(text.encode(), machine)
    reasons = [one.reason for one in result.rapids]
    assert reasons[1:] == [Reason.NOT_PLAYED, None]
    finer = replace(machine, axes=tuple(replace(a, resolution=1e-3) for a in machine.axes))
    assert [one.reason for one in process(text.encode(), finer).rapids][1:] == [None, None]


@given(
    dialect=st.sampled_from(["grbl", "mach", "fanuc", "haas", "linuxcnc"]),
    resolution=st.sampled_from([0.1, 0.02, 0.01, 0.005, 1e-3]),
    places=st.lists(st.tuples(*[st.decimals(-40, 40, places=4)] * 2), min_size=3, max_size=6),
    near=st.decimals("-0.03", "0.03", places=4),
)
def test_programs_may_be_written_finer_than_the_control_keeps(dialect, resolution, places, near):
    # One axis moves hardly at all.
    places = [*places, (places[-1][0] + 9, places[-1][1] + near)]
    blocks = "".join(f"G0 X{x:.4f} Y{y:.4f}\n" for x, y in places)
    process(f"G21 G90 G94 G17\n{blocks}M30\n".encode(), coarse(dialect, resolution))
