"""`verify` over drawn machines and programs of every dialect: each output is accepted.

That every damage is noticed is in `test_verify_damage`.
"""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from gcodejerk.errors import GcodejerkError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.pipeline import process
from gcodejerk.testing.machines import machines
from gcodejerk.testing.programs import programs
from gcodejerk.testing.vocabulary import VOCABULARIES
from gcodejerk.verification import verify, verify_csv

CALM = settings(
    deadline=None,
    max_examples=40,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
KNOWN = dict.fromkeys("XYZABC", 0.0)


def ready(machine, known=True):
    """The machine without travel, from a known start: so that there is much to rewrite."""
    axes = tuple(replace(axis, travel=None) for axis in machine.axes)
    program = replace(machine.program, start=KNOWN if known else {})
    return replace(machine, axes=axes, program=program)


VMC = ready(Machine.load(find_machine("vmc")))


def outputs(data, machine, controller):
    try:
        return process(data, machine, verify=False, controller=controller)
    except GcodejerkError:
        return None


@CALM
@given(machines(axes="XYZ"), programs(), st.booleans())
def test_every_output_is_accepted(machine, data, known):
    machine = ready(machine, known)
    result = outputs(data, machine, "linuxcnc")
    assume(result is not None)
    found = verify(data, result.output, machine)
    assert found.violations == ()
    assert (found.rapids, found.rewritten) == (len(result.program.rapids), result.planned)
    assert found.kept == result.program.lines - result.planned


@CALM
@given(machines(axes="XYZ"), programs())
def test_every_table_is_accepted(machine, data):
    machine = ready(machine)
    result = outputs(data, machine, "csv")
    assume(result is not None)
    found = verify_csv(io.BytesIO(data), io.BytesIO(result.output), machine)
    assert found.violations == ()
    assert found.rewritten == result.planned


@pytest.mark.parametrize("dialect", sorted(VOCABULARIES))
@settings(parent=CALM, max_examples=25)
@given(st.data(), st.booleans())
def test_every_output_of_every_dialect_is_accepted(dialect, data, known):
    program = data.draw(programs(dialect))
    machine = turning(ready(VMC, known)) if "lathe" in dialect else ready(VMC, known)
    machine = replace(machine, program=replace(machine.program, decimal_point="calculator"))
    result = process(
        program, machine, verify=False, controller=dialect.split("-")[0], dialect=dialect
    )
    found = verify(program, result.output, machine, dialect=dialect)
    assert found.violations == ()
    assert found.rewritten == result.planned
    assert found.confirmed <= found.rewritten


def turning(machine):
    """The machine as a lathe, whose X is a diameter."""
    axes = tuple(replace(a, diameter=True) if a.name == "X" else a for a in machine.axes)
    return replace(machine, axes=axes)
