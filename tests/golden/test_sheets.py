"""Setup sheets, compared as bytes: one for each control and each of its ways to be set.

Every line of a sheet has its source in the sheet itself. `pytest --update-golden` writes them anew.
"""

from dataclasses import replace
from pathlib import Path

import pytest

from gcodejerk.emit import controllers, load_controller
from gcodejerk.emit.sheets import WIDTH, Sheets
from gcodejerk.errors import EmitError
from gcodejerk.machine import ControllerParameter, Machine, find_machine
from gcodejerk.parameters import LIVE, MARKS, Moves, tune
from tests.unit.test_alike import hold_golden

HERE = Path(__file__).parent / "sheets"
MACHINE = Machine.load(HERE / "machine.yaml")
LENGTHS = (2.0, 5.0, 13.0, 34.0, 89.0, 233.0)
WAYS = [
    (name, way)
    for name in sorted(controllers())
    if isinstance(load_controller(name), Sheets)
    for way in load_controller(name).schemes(MACHINE)
]


def sheet_of(name, way, machine=MACHINE):
    controller = load_controller(name)
    found = tune(
        controller.scheme(machine, way), Moves.of_lengths(LENGTHS, machine), machine, curve=False
    )
    return found, controller.sheet(found, "6 lengths")


def live_lines(controller, sheet):
    """Lines that would do something: no comments, nothing empty."""
    before = controller.remark[0]
    return [x for x in sheet.decode().splitlines() if x and not x.startswith(before)]


@pytest.mark.parametrize(("name", "way"), WAYS)
def test_sheet_is_the_golden_one(name, way, request):
    found, sheet = sheet_of(name, way)
    hold_golden(sheet, HERE / f"{name}.{way}.txt", request)
    controller = load_controller(name)
    # What is not sure is never a live line, and every setting says where it is from.
    sure = {s.mark for s in found.scheme.settings} <= LIVE
    assert sure or not live_lines(controller, sheet)
    assert all(s.mark in MARKS and s.source for s in found.scheme.settings)
    said = set(sheet.decode().splitlines()) - set(live_lines(controller, sheet))
    assert not [line for line in said if len(line) > WIDTH and " = " not in line]
    assert found.chosen.total <= found.today.total * (1.0 + 1e-6) or not found.gains


def test_every_control_with_the_form_has_a_sheet():
    with_form = {
        name
        for name in controllers()
        if any(form.name == "parameters" for form in load_controller(name).forms)
    }
    assert with_form == {name for name, _ in WAYS}
    assert len(with_form) >= 17


def test_a_confirmed_number_is_a_live_line_in_the_users_unit():
    confirmed = (
        ControllerParameter("1620", None, "ms", "", "110"),
        ControllerParameter("1621", "X", "s", "", None),
    )
    machine = replace(MACHINE, controller_parameters=confirmed)
    found, sheet = sheet_of("fanuc", "constant-acceleration", machine)
    live = live_lines(load_controller("fanuc"), sheet)
    numbers = dict(zip([s.key for s in found.scheme.settings], found.written, strict=True))
    first, second = numbers["1620 X"], numbers["1621 X"]
    assert f"N1620 P1 R{first:.0f}" in live
    assert f"N1621 P1 R{second / 1e3:g}" in live
    assert not any(line.startswith("N1621 P2") for line in live)
    # The way back has the user's own old number, and asks for the one that nobody stated.
    assert live.count("N1620 P1 R110") == 1
    assert b"110*" in sheet


def test_a_unit_of_something_else_is_refused():
    confirmed = (ControllerParameter("1620", None, "mm/s^2"),)
    with pytest.raises(EmitError, match=r"states 1620 in mm/s\^2, which is no unit"):
        sheet_of(
            "fanuc", "constant-acceleration", replace(MACHINE, controller_parameters=confirmed)
        )


def test_a_share_of_no_jerk_is_refused():
    vmc = Machine.load(find_machine("vmc"))
    for name in ("siemens", "twincat", "fagor"):
        with pytest.raises(EmitError, match=r"no axes\.X\.rapid\.jerk"):
            load_controller(name).schemes(vmc)
    with pytest.raises(EmitError, match="has no settings 'x'"):
        load_controller("fanuc").scheme(vmc, "x")
