"""Klipper: streams as G1 blocks; acceleration and input shapers.

SET_VELOCITY_LIMIT and SET_INPUT_SHAPER at 84104bb (docs/G-Codes.md, shaper_defs.py): trapezoids in
front of the shaper.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    OFF,
    acceleration,
    no_shaper,
    shaped_scheme,
    unmeasured,
)
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.emit.sheets import Sheets
from gcodejerk.machine import Machine
from gcodejerk.parameters import PATH, Scheme, Setting


class KlipperController(Sheets, GcodeController):
    """Klipper."""

    name = "klipper"
    forms = (
        unmeasured(
            "Klipper slows down at corners, by max_accel and by minimum_cruise_ratio (0.5 unless "
            "the printer says another: SET_VELOCITY_LIMIT MINIMUM_CRUISE_RATIO=0 while streams "
            "run); an input shaper adds to this"
        ),
        Form("parameters", "documented", "SET_VELOCITY_LIMIT ACCEL, SET_INPUT_SHAPER"),
    )
    planner_limits = "max_velocity", "max_accel (of Z, max_z_accel)"
    path_limits = "max_velocity, max_accel"
    sheet_suffix = ".klipper.cfg.txt"
    remark = ("# ", "")
    program_way = "shaper"
    program_damping = "DAMPING_RATIO"
    program_sets = r"SET_VELOCITY_LIMIT|SET_INPUT_SHAPER|M0*204(?!\d)|SAVE_CONFIG|RESTART"
    acts_on = "ACCEL and shapers act on all moves of the program, cuts too"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """The acceleration of all moves, and a shaper for each axis."""
        facts = ("S", "Klipper 84104bb, docs/G-Codes.md", "NC program or console", "no")
        limits = (1.0, 1.0, 1e6)
        first = acceleration("ACCEL", PATH, "mm/s^2", 1.0, limits, facts, "acceleration of moves")
        kinds = {
            **{k: k for k in ("zv", "mzv", "zvd")},
            **{"klipper-ei": "ei", "2hump_ei": "2hump_ei", "3hump_ei": "3hump_ei"},
        }
        called = ("SHAPER_TYPE", "SHAPER_FREQ")
        return {"shaper": shaped_scheme(self.name, machine, "acceleration and input shapers", first,
                                  kinds, facts, called, shared=True)}  # fmt: skip

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Klipper's own commands."""
        out = [f"SET_VELOCITY_LIMIT ACCEL={n}" for s, n in numbers if s.axis == PATH]
        damping = no_shaper(machine)["filter_damping"]
        for axis in machine.axis_names:
            own = {s.number: n for s, n in numbers if s.axis == axis}
            if own.get("SHAPER_TYPE") == OFF:
                out.append(f"SET_INPUT_SHAPER SHAPER_FREQ_{axis}=0")
            elif own:
                out.append(
                    f"SET_INPUT_SHAPER SHAPER_TYPE_{axis}={own['SHAPER_TYPE']} "
                    f"SHAPER_FREQ_{axis}={own['SHAPER_FREQ']} "
                    f"DAMPING_RATIO_{axis}="
                    + own.get("DAMPING_RATIO", f"{damping[AXES.index(axis)]:g}")
                )
        return out
