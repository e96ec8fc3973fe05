"""Fanuc mills and lathes: streams as G1 blocks, and the time constants of rapids.

Parameters 1620 (time constant of linear rapid acceleration, FT1) and 1621 (FT2, bell), per axis, in
whole ms (A-63512EN p. 9 for the role of 1620 and the acceleration 1420/1620; A-78962EN p. 16 has
1773 and 1774 for the look-ahead rapid of the 16i, 18i and 21i). The ranges, the number 1621 and
that G10 sets them without power off are unverified: lines that do are written for numbers that the
machine file confirms. G10 L52 (0i, 30i; older controls L50): R.

A cutting feed beyond the upper limit is clamped to it (B-63172EN/01 p. 29), and G0 is not: 1422,
and 1430 for each axis.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import unmeasured
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.emit.sheets import Sheets, axis_settings, today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import Scheme, Setting, proportional, ramp_time

ORDER = "P counts the controlled axes in the order of the machine file: check it"


class FanucController(Sheets, GcodeController):
    """Fanuc mills and lathes."""

    name = "fanuc"
    highest_feed = "the highest cutting feed (parameters 1422, 1430)"
    forms = (
        unmeasured(
            "G1 blocks of 2 ms need look-ahead (AI contour control) and its block processing time"
        ),
        Form("parameters", "unverified", "rapid time constants 1620, 1621; ask your manual"),
    )
    sheet_suffix = ".fanuc-rapid.nc"
    remark = ("(", ")")
    upper = True

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """FT1 and FT2 of each axis; at constant acceleration, or as fixed times."""
        today = today_of(machine, "velocity", "acceleration", "jerk")
        with np.errstate(invalid="ignore"):
            bell = np.nan_to_num(today["acceleration"] / today["jerk"])
            ramp = np.nan_to_num(today["velocity"] / today["acceleration"])
        # What the machine file states of its own averages stands.
        for axis in machine.axes:
            at, stated = AXES.index(axis.name), dict(axis.law)
            bell[at] = stated.get("second_average", bell[at])
            ramp[at] = stated.get("first_average", ramp[at])
        speed = {a: float(today["velocity"][AXES.index(a)]) for a in machine.axis_names}

        def second(axis: str) -> Setting:
            return Setting(
                "1621", axis, "ms", "bell time of rapids (FT2)",
                proportional("second_average", 1e-3), 1.0, 0.0, 1000.0, "U",
                "number and range unverified", "parameter page or G10", "not known",
            )  # fmt: skip

        def constant_acceleration(axis: str) -> list[Setting]:
            first = Setting(
                "1620", axis, "ms", f"time to rapid speed (1420: {60.0 * speed[axis]:g} mm/min)",
                ramp_time("acceleration", "velocity", 1e-3), 1.0, 1.0, 4000.0, "U",
                "role M (A-63512EN p. 9), range unverified", "parameter page or G10", "not known",
            )  # fmt: skip
            return [first, second(axis)]

        def constant_time(axis: str) -> list[Setting]:
            first = Setting(
                "1620", axis, "ms", "time constant of rapids (FT1)",
                proportional("first_average", 1e-3), 1.0, 1.0, 4000.0, "U",
                "role M (A-63512EN p. 9), range unverified", "parameter page or G10", "not known",
            )  # fmt: skip
            return [first, second(axis)]

        cannot = ("a rise of the jerk unlike its fall",)
        settings, groups = axis_settings(machine, constant_acceleration)
        fixed = today | {"second_average": bell}
        bells = Scheme(
            self.name, "rapid time constants, constant acceleration",
            FAMILIES["averaged-trapezoid"], fixed, settings, groups,
            notes=(
                "parameter 1603 says whether acceleration or time is constant (bits unverified)",
                ORDER,
            ),
            cannot=cannot,
        )  # fmt: skip
        settings, groups = axis_settings(machine, constant_time)
        times = Scheme(
            self.name, "rapid time constants, constant time", FAMILIES["time-constants"],
            fixed | {"first_average": ramp}, settings, groups,
            notes=(
                "for controls whose rapids take the same time to any speed (1603, unverified)",
                ORDER,
            ),
            cannot=cannot,
        )  # fmt: skip
        known = {"constant-acceleration": bells, "constant-time": times}
        first = "constant-time" if machine.planner == times.family.name else next(iter(known))
        return {first: known[first]} | known

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """One block for each value; P counts the controlled axes from 1."""
        order = machine.axis_names
        return [f"N{s.number} P{order.index(s.axis) + 1} R{n}" for s, n in numbers]

    def frame(self, lines: list[str]) -> list[str]:
        """A stop in front of data setting mode, and its end."""
        return ["G04 P100", "G10 L52", *lines, "G11"]
