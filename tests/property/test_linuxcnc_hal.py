"""Controller `linuxcnc-hal` over drawn programs: every pair of files is accepted."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from gcodejerk.errors import GcodejerkError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process
from gcodejerk.testing.programs import programs
from gcodejerk.verification import samples, verify

VMC = Machine.load(find_machine("vmc"))
MACHINE = replace(
    VMC,
    axes=tuple(replace(axis, travel=None) for axis in VMC.axes),
    program=replace(VMC.program, start=dict.fromkeys("XYZABC", 0.0), startup="G21"),
    spindle="mill",
    controller="linuxcnc-hal",
)


@pytest.mark.parametrize("form", ["adaptive-feed", "position"])
@settings(
    deadline=None,
    max_examples=12,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
@given(st.data())
def test_every_pair_is_accepted_and_shortened_samples_are_not(form, data):
    program = data.draw(programs())
    try:
        result = process(program, MACHINE, form=form, verify=False)
    except GcodejerkError:
        return
    rows = result.beside.splitlines(keepends=True) if result.planned else []
    gone = data.draw(st.integers(0, len(rows) - 1)) if rows else None
    damaged = b"".join(row for k, row in enumerate(rows) if k != gone)
    for at_once in (1, samples.AT_ONCE):  # rapid by rapid, and all together
        with patch.object(samples, "AT_ONCE", at_once):
            found = verify(program, result.output, MACHINE, beside=result.beside)
            assert found.violations == ()
            assert found.rewritten == result.planned
            if rows:
                assert not verify(program, result.output, MACHINE, beside=damaged).ok
