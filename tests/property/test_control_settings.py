"""Drawn programs that set their control: without the inserted lines they are what they were."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gcodejerk import Machine, process, verify
from gcodejerk.errors import EmitError
from gcodejerk.rewrite import control_settings
from gcodejerk.testing.programs import programs

GOLDEN = Path(__file__).parent.parent / "golden"
CONTROLS = {
    "klipper": "klipper",
    "smoothieware": "marlin",
    "marlin": "marlin",
    "twincat": "linuxcnc",
}
STOPS = [
    *(b"M0", b"/M1", b"M30", b"M5 M0", b"(M0)", b"M117 M0", b"PAUSE", b"M600", b""),
    b"G0 X1 ; M2",
]


@cache
def machine_of(name):
    return Machine.load(GOLDEN / f"settings_{name}" / "machine.yaml")


@cache
def tuned(name):
    """One tuning that gains, for whatever is drawn: the search is not what is looked at here."""
    program = (GOLDEN / f"settings_{name}" / "in.ngc").read_bytes()
    found = process(program, machine_of(name), form="parameters").settings.tuning
    assert found.gains
    return found


@pytest.mark.parametrize("name", CONTROLS)
@given(data=st.data())
def test_without_the_inserted_lines_a_program_is_what_it_was(name, data):
    program = data.draw(programs(CONTROLS[name]))
    lines = program.split(b"\n")
    for _ in range(data.draw(st.integers(0, 3))):
        line = data.draw(st.sampled_from(STOPS))
        at = data.draw(st.integers(0, len(lines)))
        lines.insert(at, line + (b"\r" if lines[0].endswith(b"\r") else b""))
    program = b"\n".join(lines)
    assume(program.strip())
    machine, found = machine_of(name), tuned(name)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(control_settings, "tune", lambda *_, **__: found)
        patch.setattr(control_settings, "joined_moves", lambda *_: found.moves)
        try:
            result = process(program, machine, form="parameters")
        except EmitError:  # jumps, macros, M204 of its own: the unit tests say which
            return
    output, back, at = result.output, [], 0
    for begin, end, _ in result.edits.tolist():
        back.append(output[at:begin])
        at = end
    assert b"".join([*back, output[at:]]) == program
    assert len(result.edits) == result.settings.places >= 2
    assert result.verification.ok
    assert verify(program, output, machine).ok
    if data.draw(st.booleans()):
        begin, end, _ = data.draw(st.sampled_from(result.edits.tolist()))
        assert not verify(program, output[:begin] + output[end:], replace(machine)).ok
