"""Emitters: how they are found, and what a step of a resolution is."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.emit import API, base, controllers, load_controller
from gcodejerk.emit.base import Controller, Form
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.planning.lines import Play

PHASES = (Phase.explicit, Phase.reuse, Phase.generate)


def test_our_controllers_are_there_and_keep_their_names():
    assert {"csv", "linuxcnc"} <= set(controllers())
    for name in ("csv", "linuxcnc"):
        emitter = load_controller(name)
        assert emitter.name == name
        assert emitter.api == API
        assert "stream" in [form.name for form in emitter.forms]


def test_an_unknown_controller_is_refused_with_the_nearest():
    with pytest.raises(EmitError, match="there is no controller 'linuxcmc'") as caught:
        load_controller("linuxcmc")
    assert "did you mean 'linuxcnc'?" in caught.value.remedy
    assert "csv" in caught.value.remedy


class Foreign(GcodeController):
    name = "foreign"
    forms = (Form("stream", "unverified", "nobody has tried it"),)


def plug_in(monkeypatch, make):
    """Install one foreign emitter that is made by a function."""
    entry = SimpleNamespace(load=lambda: make, dist=SimpleNamespace(name="other", version="2.1"))
    monkeypatch.setattr(base, "controllers", lambda: {"foreign": entry})


def test_a_foreign_emitter_is_loaded_through_its_entry_point(monkeypatch):
    plug_in(monkeypatch, Foreign)
    assert isinstance(load_controller("foreign"), Foreign)


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (
            lambda: SimpleNamespace(api=API),
            r"is a SimpleNamespace, which is no",
        ),
        (type("Nameless", (Foreign,), {"name": ""}), r"calls itself ''"),
        (type("Formless", (Foreign,), {"forms": ()}), r"has no forms"),
        (type("Mute", (Controller,), {}), r"cannot be loaded: TypeError: .*abstract.*render"),
        (
            type("Rowless", (Foreign,), {"play": Play.CUBIC}),
            r"plays cubics and has no row_format and no render_rows",
        ),
    ],
)
def test_what_an_emitter_lacks_is_told_when_it_is_loaded(monkeypatch, make, problem):
    plug_in(monkeypatch, make)
    with pytest.raises(EmitError, match=rf"'foreign' of other 2\.1 {problem}"):
        load_controller("foreign")


def test_an_emitter_for_another_version_is_refused_with_its_package(monkeypatch):
    plug_in(monkeypatch, lambda: SimpleNamespace(api=API + 1))
    with pytest.raises(EmitError, match=rf"'foreign' of other 2.1 has api {API + 1}, expected"):
        load_controller("foreign")


def test_an_emitter_that_breaks_on_loading_is_named_with_its_error(monkeypatch):
    def broken():
        raise ImportError("no module named serial")

    plug_in(monkeypatch, broken)
    with pytest.raises(
        EmitError, match=r"'foreign' of other 2.1 cannot be loaded: ImportError: no"
    ):
        load_controller("foreign")


@given(st.integers(1, 9999), st.integers(0, 6))
@settings(deadline=None, phases=PHASES, max_examples=200)
def test_a_decimal_resolution_is_its_own_step(whole, decimals):
    resolution = whole / 10**decimals
    step, places = base.decimal_step(resolution)
    assert step / 10**places == pytest.approx(resolution, rel=1e-12)
    assert places <= decimals


@given(st.floats(1e-6, 3.0))
@settings(deadline=None, phases=PHASES, max_examples=200)
def test_a_step_is_never_coarser_than_the_resolution(resolution):
    step, places = base.decimal_step(resolution)
    assert step >= 1
    assert step / 10**places <= resolution * (1 + 1e-5)
    assert step / 10**places > 0.0999 * resolution


MACHINE = Machine.loads(
    """
interval: 0.001
positioning: linear
axes:
  X: {resolution: 0.0005, rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}}
  Z: {resolution: 0.001, rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}}
  A: {type: rotary, resolution: 0.01, rapid: {velocity: 90, acceleration: 2000, jerk: 5.0e+4}}
"""
)


@pytest.mark.parametrize(
    ("inch", "expected"),
    [
        (False, {"X": (5, 4), "Z": (1, 3), "A": (1, 2)}),
        (True, {"X": (1, 5), "Z": (1, 5), "A": (1, 2)}),
    ],
)
def test_steps_are_written_in_the_program_s_unit(inch, expected):
    whole, decimals = base.axis_steps(MACHINE, inch)
    size = base.step_sizes(MACHINE, inch)
    for axis, (step, places) in expected.items():
        k = AXES.index(axis)
        assert (whole[k], decimals[k]) == (step, places)
        unit = 25.4 if inch and axis != "A" else 1.0
        assert size[k] == pytest.approx(step / 10.0**places * unit)
        assert size[k] <= MACHINE.axis(axis).resolution * (1 + 1e-9)
    assert size.dtype == np.float64
