"""Every controller, in every form, on drawn machines: nothing is written that its proof refuses.

`process` reads its own output back with readers that share nothing with what wrote it. A refusal of
a program or of a machine file is fine; one of our own output is a bug, whichever of the two is
wrong. What the kinds of rapids, filters, axes and options that a machine file can name do together
is nowhere listed: it is drawn.
"""

from __future__ import annotations

import random
import re
from dataclasses import replace

import pytest
import yaml
from hypothesis import HealthCheck, Phase, event, find, given, note, settings
from hypothesis import strategies as st

from gcodejerk.emit import controllers, load_controller
from gcodejerk.errors import GcodejerkError, VerifyError
from gcodejerk.machine import PLANNERS
from gcodejerk.machine.parts import ControllerOptions, ControllerParameter
from gcodejerk.nc import DIALECTS
from gcodejerk.rewrite.pipeline import process
from gcodejerk.testing.machines import machines

# A machine is a large thing to shrink: minutes for a smaller example that says no more.
CALM = settings(
    deadline=None,
    max_examples=12,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),
    suppress_health_check=list(HealthCheck),
)
FORMS = sorted(
    (name, form.name)
    for name in controllers()
    for form in load_controller(name).forms
    if form.name != "parameters"
)
READ = ("linuxcnc", "grbl", "fanuc", "haas", "mach")
"""Dialects of programs for a controller that has none of its own."""
READ_BY = {"linuxcnc-hal": ("linuxcnc",)}
"""What some of them have their own words in."""
SET_BY_PROGRAM = sorted(
    name for name in controllers() if getattr(load_controller(name), "program_way", "")
)
PERIODS = {"galil": [1 / 1024, 0.000977, 0.002], "fanuc15": [0.001, 0.002, 0.004, 0.008]}
STARTUPS = {
    "klipper": ["G21 G90", "G90"],
    "marlin": ["G21 G90", "G90"],
    "siemens": ["G71 G90 G94 G17 G40", "G70 G90 G94 G17 G40"],
}
PROFILES = ("condition3", "symmetric", "cascade", "condition1", "condition2", "conventional")


@st.composite
def described(draw, controller, dialect):
    """A machine with all that the controller has to know of it, and often what it need not."""
    letters = draw(st.sampled_from(["XYZ", "XYZ", "XZ", "X", "XYZA", "XYZBU"]))
    machine = draw(
        machines(
            axes=letters,
            modes=(0, 2),
            positioning="linear" if controller == "linuxcnc-hal" else None,
            # TwinCAT is told a share of today's jerk.
            jerk_limited=True if controller == "twincat" else None,
            planner=None if controller == "twincat" else draw(st.sampled_from([None, *PLANNERS])),
            filtered=None,
            interval=draw(st.sampled_from(PERIODS.get(controller, [0.0005, 0.001, 0.002, 0.004]))),
        )
    )
    turning = dialect == "linuxcnc" and letters == "XZ" and draw(st.booleans())
    axes = tuple(
        replace(
            axis,
            travel=draw(st.sampled_from([None, None, axis.travel])),
            diameter=turning and axis.name == "X",
            wrap=draw(st.sampled_from([None, "none", "shortest"])) if axis.rotary else None,
        )
        for axis in machine.axes
    )
    lettered = controller in ("galil", "pmac")
    options = ControllerOptions(
        counts_per_unit={a: draw(st.sampled_from([1000.0, 4096.0, 12345.6])) for a in letters},
        axis_names={a: "ABCDEFGH"[k] if lettered else str(k + 1) for k, a in enumerate(letters)},
        isx90=draw(st.sampled_from([1.0, 1000.0])) if controller == "pmac" else None,
        fanuc_distance=draw(st.sampled_from(["general", "special"])),
        confirmed=("pmac-colon", "acs-pvspline"),
        override_guard=controller == "linuxcnc" and draw(st.booleans()),
        version=draw(st.sampled_from([None, "2.9"])) if controller == "linuxcnc" else None,
    )
    usual = ["G21 G90 G94 G17 G40 G49", "G20 G90 G94 G17 G40 G49"]
    program = replace(
        machine.program,
        startup=draw(st.sampled_from(STARTUPS.get(dialect, usual))),
        start=dict.fromkeys(letters, 0.0) if draw(st.booleans()) else {},
        decimal_point="calculator",
    )
    return replace(
        machine, axes=axes, program=program, controller_options=options, spindle="mill"
    )  # fmt: skip


@st.composite
def moving(draw, machine, dialect):
    """A program of rapids long and short, of a second at most, and what stands between them."""
    letters = machine.axis_names
    longest = {axis.name: axis.rapid.velocity for axis in machine.axes}
    # Printers have no words for what is in force anyway, and their G0 has an F.
    printer = dialect in ("marlin", "klipper")
    lines = ["G90", "G1 F90000" if printer else "G94 G64" if dialect != "grbl" else "G94"]
    lines += ["G0 " + " ".join(f"{letter}{k + 1}." for k, letter in enumerate(letters))]
    between = ["G91", "G90", "M3 S1000", "G21", "G20", ""][: 2 if printer else 6]
    for _ in range(draw(st.integers(3, 16))):
        kind = draw(st.integers(0, 11))
        named = draw(st.lists(st.sampled_from(letters), min_size=1, max_size=3, unique=True))
        reach = draw(st.sampled_from([300.0, 20.0, 1.0, 0.1]))
        places = draw(st.integers(1, 4))
        share = [draw(st.integers(-999, 999)) / 999 for _ in named]
        to = " ".join(
            f"{a}{s * min(reach, longest[a]):.{places}f}" for a, s in zip(named, share, strict=True)
        )
        if kind < 8:
            lines.append(f"G0 {to}")
        elif kind < 9:
            lines.append(f"G1 {to}" if printer else f"G1 {to} F500.")
        else:
            lines.append(draw(st.sampled_from(between)))
    return "\n".join([*lines, *([] if printer else ["M30"]), ""]).encode()


@st.composite
def cases(draw, controller, form):
    """A program, the machine that it runs on, and how it is processed."""
    dialect = controller if controller in DIALECTS else None
    dialect = dialect or draw(st.sampled_from(READ_BY.get(controller, READ)))
    machine = draw(described(controller, dialect))
    program = draw(moving(machine, dialect))
    profile = draw(st.sampled_from(PROFILES))
    chosen = {"controller": controller, "form": form, "profile": profile, "dialect": dialect}
    return program, machine, chosen


def planned(case):
    """How many rapids are rewritten; none where the program or the machine file is refused."""
    program, machine, chosen = case
    try:
        return process(program, machine, **chosen).planned
    except VerifyError:
        raise
    except GcodejerkError:
        return 0


@pytest.mark.parametrize(("controller", "form"), FORMS)
@CALM
@given(st.data())
def test_nothing_is_written_that_its_proof_refuses(controller, form, data):
    case = data.draw(cases(controller, form))
    note(case[0].decode())
    event(f"planned: {planned(case) > 0}")


@pytest.mark.parametrize("controller", sorted({name for name, _ in FORMS}))
def test_what_is_drawn_is_rewritten(controller):
    """Or nothing would be proven above."""
    form = next(form for name, form in FORMS if name == controller)
    patient = settings(CALM, max_examples=100)
    find(cases(controller, form), planned, settings=patient, random=random.Random(1))


def as_today(draw, machine, remedy):
    """The machine with what a refusal asks for: settings as they might be today."""
    answers = []
    for one in yaml.safe_load(remedy):
        old = str(one.pop("old"))
        if old == "45":
            old = f"{draw(st.floats(21.0, 90.0)):.1f}"
        elif not old.replace(".", "").isdigit():
            old = draw(st.sampled_from([old, "none"]))
        answers.append(ControllerParameter(**one, old=old))
    return replace(machine, controller_parameters=tuple(answers))


@st.composite
def places_set(draw, controller):
    """At how many places settings are written; none where program or machine are refused.

    The control's settings of today are stated where they have to be.
    """
    program, machine, chosen = draw(cases(controller, "parameters"))
    note(program.decode())
    places, remedy = places_or_remedy(program, machine, chosen)
    if asked := re.search(r"controller_parameters: (\[.*\])", remedy):
        machine = as_today(draw, machine, asked[1])
        places, remedy = places_or_remedy(program, machine, chosen)
    assert "controller_parameters" not in remedy, "it asks again for what was stated"
    return places


def places_or_remedy(program, machine, chosen):
    """At how many places settings were written; where none are, what the refusal asks for."""
    try:
        return process(program, machine, **chosen).settings.places, ""
    except VerifyError:
        raise
    except GcodejerkError as error:
        return 0, error.remedy or ""


@pytest.mark.parametrize("controller", SET_BY_PROGRAM)
@settings(CALM, max_examples=6)
@given(st.data())
def test_no_settings_are_written_that_their_proof_refuses(controller, data):
    event(f"set: {data.draw(places_set(controller)) > 0}")


@pytest.mark.parametrize("controller", SET_BY_PROGRAM)
def test_what_is_drawn_is_set(controller):
    """Or nothing would be proven above."""
    patient = settings(CALM, max_examples=100)
    find(places_set(controller), bool, settings=patient, random=random.Random(1))
