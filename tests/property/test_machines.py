"""Promises that hold on every machine that can be drawn."""

import contextlib
import math
from dataclasses import fields, is_dataclass, replace
from itertools import pairwise

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.errors import MachineError
from gcodejerk.machine import Limits, Machine, machine_yaml
from gcodejerk.machine.problems import MachineFileError
from gcodejerk.machine.spectrum import MOST_LINES, read_spectrum
from gcodejerk.testing.machines import machines


@settings(max_examples=40)
@given(machine=machines())
def test_a_machine_written_is_read_back_as_the_same_machine(machine):
    text = machine_yaml(machine)
    again = Machine.loads(text)
    assert again == machine
    assert again.settings_hash == machine.settings_hash
    assert machine_yaml(again) == text


@settings(max_examples=40)
@given(machine=machines())
def test_what_is_written_is_plain_yaml_with_plain_numbers(machine):
    values = yaml.safe_load(machine_yaml(machine))
    for axis in machine.axes:
        written = values["axes"][axis.name]
        assert written["resolution"] == axis.resolution
        assert written["rapid"].get("jerk", math.inf) == axis.rapid.jerk


@settings(max_examples=40)
@given(machine=machines())
def test_a_drawn_machine_is_one_that_exists(machine):
    assert 1 <= len(machine.axes) <= 6
    assert list(machine.axis_names) == sorted(machine.axis_names, key=AXES.index)
    for axis in machine.axes:
        assert len(axis.modes) <= 4
        assert axis.limit.acceleration >= axis.rapid.acceleration
        assert math.isinf(axis.rapid.jerk) or axis.limit.jerk >= axis.rapid.jerk
    for _, mode in machine.all_modes():
        assert mode.frequency < 0.5 / machine.interval
        assert 0.0 <= mode.damping <= 0.2


@given(machine=machines(axes="XZ", modes=(2, 3), positioning="independent", jerk_limited=False))
def test_a_drawn_machine_is_as_asked_for(machine):
    assert (machine.axis_names, machine.positioning) == (("X", "Z"), "independent")
    for axis in machine.axes:
        assert 2 <= len(axis.modes) <= 3
        assert math.isinf(axis.rapid.jerk)


@settings(max_examples=40)
@given(machine=machines())
def test_a_file_in_inches_is_the_file_in_mm_with_every_length_converted(machine):
    # 0.01 in are more than a control's step may be, and refused.
    axes = tuple(replace(a, resolution=min(a.resolution, 0.002)) for a in machine.axes)
    machine = replace(machine, axes=axes)
    inch = Machine.loads(machine_yaml(machine).replace("units: mm", "units: inch"))
    assert inch.inch
    for axis, axis_inch in zip(machine.axes, inch.axes, strict=True):
        k = 1.0 if axis.rotary else 25.4
        assert axis_inch.resolution == k * axis.resolution
        for limits, limits_inch in ((axis.rapid, axis_inch.rapid), (axis.limit, axis_inch.limit)):
            assert limits_inch == Limits(
                k * limits.velocity, k * limits.acceleration, k * limits.jerk
            )
        if axis.travel is not None:
            assert axis_inch.travel == (k * axis.travel[0], k * axis.travel[1])
        assert axis_inch.modes == axis.modes
    for limits, limits_inch in zip(
        (machine.path.rapid, machine.path.limit), (inch.path.rapid, inch.path.limit), strict=True
    ):
        assert limits_inch.velocity == 25.4 * limits.velocity
        assert limits_inch.acceleration == 25.4 * limits.acceleration
    assert inch.modes == machine.modes
    assert inch.design.tolerance == 25.4 * machine.design.tolerance
    assert inch.design.minimum_length == 25.4 * machine.design.minimum_length
    assert (inch.design.band, inch.interval) == (machine.design.band, machine.interval)


@settings(max_examples=40)
@given(machine=machines())
def test_every_number_of_a_machine_is_finite_but_for_what_is_not_bounded(machine):
    def check(value, name):
        if is_dataclass(value):
            for field in fields(value):
                inner = name if name == "path" else field.name
                check(getattr(value, field.name), inner)
        elif isinstance(value, tuple):
            for part in value:
                check(part, name)
        elif isinstance(value, float):
            assert math.isfinite(value) or (name in ("jerk", "path") and value > 0.0)

    check(machine, "machine")


KEYS = [
    "axes", "X", "rapid", "limit", "velocity", "jerk", "modes", "frequency", "participation",
    "design", "units", "<<",
]  # fmt: skip
scalars = st.sampled_from(
    ["1", "-1", "5e6", ".nan", "x", "''", "", "[]", "{}", "*a", "&a 1", "!t 1"]
)
flow = st.recursive(
    scalars,
    lambda part: st.one_of(
        st.lists(part, max_size=3).map(lambda parts: f"[{', '.join(parts)}]"),
        st.lists(st.tuples(st.sampled_from(KEYS), part), max_size=4).map(
            lambda pairs: "{" + ", ".join(f"{key}: {value}" for key, value in pairs) + "}"
        ),
    ),
    max_leaves=12,
)


def problems_of(text):
    """Messages about a text; none for a text that is a machine."""
    try:
        assert Machine.loads(text, "any.yaml").axes
    except MachineFileError as error:
        return [str(problem) for problem in error.problems]
    return []


@given(text=st.one_of(st.text(), flow, st.lists(flow).map("\n".join)))
def test_any_text_is_a_machine_or_a_refusal_with_its_place(text):
    assert all(problem.startswith("any.yaml") for problem in problems_of(text))


@given(machine=machines(), data=st.data())
def test_a_damaged_file_is_read_or_refused_with_its_place(machine, data):
    text = machine_yaml(machine)
    begin = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(begin, min(begin + 20, len(text))))
    damaged = text[:begin] + data.draw(st.text(max_size=5)) + text[end:]
    assert all(problem.startswith("any.yaml") for problem in problems_of(damaged))


@st.composite
def spectra(draw):
    """Rising frequencies, some a bit apart only, and a PSD over many orders of magnitude."""
    gap = st.sampled_from([1e-12, 0.01, 0.1, 1.5, 20.0]) | st.floats(1e-9, 40.0)
    gaps = draw(st.lists(gap, min_size=8, max_size=300))
    start = draw(st.floats(5.0, 50.0))
    f = [start]
    for step in gaps:
        f.append(max(f[-1] + step, math.nextafter(f[-1], math.inf)))
    value = st.sampled_from([0.0, 5e-324, 1e-12, 1.0, 1e300]) | st.floats(0.0, 1e300)
    psd = draw(st.lists(value, min_size=len(f), max_size=len(f)))
    return f, psd


@given(drawn=spectra(), highest=st.sampled_from([100.0, 500.0, math.inf]))
def test_a_drawn_spectrum_is_refused_or_keeps_its_energy_in_few_lines(drawn, highest):
    text = "".join(f"{f!r},{psd!r}\n" for f, psd in zip(*drawn, strict=True))
    usable = [(f, psd) for f, psd in zip(*drawn, strict=True) if f < highest]
    if len(usable) < 8 or not any(psd for _, psd in usable):
        with pytest.raises(MachineError):
            read_spectrum(text.encode(), "x.csv", highest)
        return
    spectrum = read_spectrum(text.encode(), "x.csv", highest)
    lines = spectrum.frequency
    assert 1 <= len(lines) == len(spectrum.weight) <= MOST_LINES
    assert math.fsum(spectrum.weight) == 1.0
    assert all(weight > 0.0 for weight in spectrum.weight)
    assert all(low < high for low, high in pairwise(lines))
    assert usable[0][0] <= lines[0]
    assert lines[-1] <= usable[-1][0]
    assert spectrum.peak in dict(usable)


@given(
    data=st.binary(max_size=200) | st.text("0123456789,.e-+#\n\r f", max_size=200).map(str.encode)
)
def test_any_bytes_are_a_spectrum_or_a_refusal(data):
    with contextlib.suppress(MachineError):
        assert read_spectrum(data, "x.csv", 500.0).frequency
