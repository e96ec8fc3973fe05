"""`verify` over drawn machines and programs of every dialect: each output is accepted.

That every damage is noticed is in `test_verify_damage`.
"""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from gcodejerk.errors import GcodejerkError
from gcodejerk.machine import PLANNERS, Machine, find_machine
from gcodejerk.rewrite.pipeline import process
from gcodejerk.testing.machines import machines
from gcodejerk.testing.programs import programs
from gcodejerk.testing.vocabulary import VOCABULARIES
from gcodejerk.verification import verify, verify_files

# A machine is a large thing to shrink: minutes for a smaller example that says no more.
CALM = settings(
    deadline=None,
    max_examples=10,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
KNOWN = dict.fromkeys("XYZABC", 0.0)


def ready(machine, known=True, unit="G21"):
    """The machine without travel, from a known start: so that there is much to rewrite."""
    axes = tuple(replace(axis, travel=None) for axis in machine.axes)
    start, startup, spindle = (KNOWN, unit, "mill") if known else ({}, "", None)
    program = replace(machine.program, start=start, startup=startup)
    return replace(machine, axes=axes, program=program, spindle=spindle)


def machine_of(**kwargs):
    """Machines with a servo period of which LinuxCNC's blocks of three are short enough."""
    return st.sampled_from([0.001, 0.002]).flatmap(
        lambda interval: machines(interval=interval, **kwargs)
    )


VMC = ready(Machine.load(find_machine("vmc")))


def outputs(data, machine, controller):
    try:
        return process(data, machine, verify=False, controller=controller)
    except GcodejerkError:
        return None


@pytest.mark.parametrize("controller", ["linuxcnc", "mach"])
@settings(parent=CALM, max_examples=3)
@given(machine_of(axes="XYZ"), programs(), st.booleans())
def test_every_output_is_accepted(controller, machine, data, known):
    machine = ready(machine, known)
    result = outputs(data, machine, controller)
    assume(result is not None)
    found = verify(data, result.output, machine)
    assert found.violations == ()
    assert (found.rapids, found.rewritten) == (len(result.program.rapids), result.planned)
    assert found.kept == result.program.lines - result.planned


@pytest.mark.parametrize("part", range(4))  # for as many cores
@settings(parent=CALM, max_examples=2)
@given(
    st.sampled_from(PLANNERS),
    st.data(),
    st.booleans(),
    st.sampled_from(["condition3", "cascade", "conventional"]),
)
def test_every_output_is_accepted_whatever_profile_todays_rapids_follow(
    part, planner, data, known, profile
):
    drawn = machine_of(axes="XYZ", modes=(1, 4), planner=planner, filtered=None)
    machine = ready(data.draw(drawn), known)
    assert machine.planner == planner
    program = data.draw(programs())
    try:
        result = process(program, machine, verify=False, controller="linuxcnc", profile=profile)
    except GcodejerkError:
        return
    assume(result.planned)
    design = replace(machine.design, profile=profile)
    found = verify(program, result.output, replace(machine, design=design))
    assert found.violations == ()
    assert found.rewritten == result.planned
    # No rapid is longer than the profile of its control allows.
    planned = result.plans.planned
    today = result.plans.conventional_time[planned]
    most = np.maximum(
        np.ceil(today / machine.interval - 1e-6) * machine.interval,
        today * (1.0 + machine.design.max_extension),
    )
    time = result.plans.counts[planned] * machine.interval
    assert (time <= most * (1.0 + 1e-9) + 1e-9).all()


@pytest.mark.parametrize("part", range(2))  # for as many cores
@settings(parent=CALM, max_examples=2)
@given(machine=machines(axes="XYZ"), data=programs())
def test_every_table_is_accepted(part, machine, data):
    machine = ready(machine)
    result = outputs(data, machine, "csv")
    assume(result is not None)
    found = verify_files(io.BytesIO(data), io.BytesIO(result.output), machine, table=True)
    assert found.violations == ()
    assert found.rewritten == result.planned


COMMON = {
    **{"rs274": ["linuxcnc", "grbl", "mach"], "iso-mill": ["fanuc", "haas"]},
    **{name: ["mach"] for name in ("centroid", "uccnc", "edingcnc", "planetcnc", "masso")},
    **{name: ["fanuc"] for name in ("mitsubishi", "mazatrol-eia", "syntec")},
    "duet": ["marlin", "mach"],
    "any-mill": ["linuxcnc", "grbl", "mach", "fanuc", "haas"],
}
"""Controllers that may read a dialect which is no control's own, or of a control without one."""


TWINS = {"edingcnc", "planetcnc", "masso", "mazatrol-eia", "syntec"}
"""Their tables are those of uccnc and mitsubishi but for little that no output shows."""


@pytest.mark.parametrize("dialect", sorted(VOCABULARIES.keys() - TWINS))
@settings(parent=CALM, max_examples=6)
@given(st.data(), st.booleans())
def test_every_output_of_every_dialect_is_accepted(dialect, data, known):
    program = data.draw(programs(dialect))
    machine = ready(VMC, known, "G71" if dialect == "siemens" else "G21")
    machine = turning(machine) if "lathe" in dialect else machine
    machine = replace(machine, program=replace(machine.program, decimal_point="calculator"))
    controller = data.draw(st.sampled_from(COMMON.get(dialect, [dialect.split("-")[0]])))
    result = process(program, machine, verify=False, controller=controller, dialect=dialect)
    machine = replace(machine, controller=controller)
    found = verify(program, result.output, machine, dialect=dialect)
    assert found.violations == ()
    assert found.rewritten == result.planned
    assert found.confirmed <= found.rewritten


def turning(machine):
    """The machine as a lathe, whose X is a diameter."""
    axes = tuple(replace(a, diameter=True) if a.name == "X" else a for a in machine.axes)
    return replace(machine, axes=axes)
