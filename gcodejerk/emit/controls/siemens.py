"""Siemens 840D sl, ONE, 828D: streams as G1 blocks, and the factors of rapids.

The acceleration of G0 is MD32300 times MD32434, its jerk MD32431 times MD32435 (function manual
06/2019 12.2.15, p. 371): the two factors change rapids and nothing else. As a filter of the axis,
MD32402 2 or 4 is one or two moving averages of MD32410 seconds (p. 377), from power on. The units
of the machine data and their ranges are unverified; the factors have no unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import no_shaper, require_jerk, unmeasured
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.emit.sheets import Sheets, axis_settings, today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import TODAY, Relation, Scheme, Setting, share_of_today

JERK_FACTS = (
    "M", "function manual 06/2019 12.2.15 p. 371; range unverified", "machine data, then NEWCONF",
    "no (unverified)",
)  # fmt: skip
FILTER_PAGE = "function manual 06/2019 p. 377 (M), 2-32 ms at 2 ms recommended (808D p. 224)"


class SiemensController(Sheets, GcodeController):
    """Siemens 840D sl, 828D, ONE."""

    name = "siemens"
    forms = (
        unmeasured("G1 blocks of 2 ms need the IPO cycle and look-ahead that keep up with them"),
        Form("parameters", "documented", "G0 factors MD32434, MD32435; axis filter MD32402, 32410"),
    )
    sheet_suffix = ".siemens-setup.txt"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """The factors of G0, or moving averages behind the interpolation."""
        require_jerk(machine, self.name)
        today = today_of(machine, "velocity", "acceleration", "jerk")

        def factors(axis: str) -> list[Setting]:
            return [
                Setting(
                    "MD32434", axis, "-", "G00_ACCEL_FACTOR", share_of_today("acceleration", 1.0),
                    0.01, 0.05, 10.0, *JERK_FACTS,
                ),
                Setting(
                    "MD32435", axis, "-", "G00_JERK_FACTOR", share_of_today("jerk", 1.0),
                    0.01, 0.01, 100.0, *JERK_FACTS,
                ),
            ]  # fmt: skip

        settings, groups = axis_settings(machine, factors)
        fixed = today | {TODAY + name: today[name] for name in ("acceleration", "jerk")}
        soft = Scheme(
            self.name, "factors of rapids (SOFT)", FAMILIES["jerk-limited"], fixed, settings,
            groups, notes=(
                "factors count from 1 as today: multiply by what MD32434 and MD32435 are now",
                "SOFT has to be active, MD20600 MAX_PATH_JERK above the jerks of the axes",
            ),
            cannot=("a rise of the jerk unlike its fall",),
        )  # fmt: skip

        def averages(axis: str) -> list[Setting]:
            kind = Relation("filter", lambda x, q: x, lambda q: q["filter"])
            time = Relation("filter_for", lambda x, q: x, lambda q: q["filter_for"])
            return [
                Setting(
                    "MD32434", axis, "-", "G00_ACCEL_FACTOR", share_of_today("acceleration", 1.0),
                    0.01, 0.05, 10.0, *JERK_FACTS,
                ),
                Setting("MD32402", axis, "-", "AX_JERK_MODE", kind, 1.0, 0.0, 2.0, "M", FILTER_PAGE,
                        "machine data", "yes", names=("off", "2", "4")),
                Setting("MD32410", axis, "s", "AX_JERK_TIME", time, 0.001, 0.001, 0.1, "M",
                        FILTER_PAGE, "machine data", "yes"),
            ]  # fmt: skip

        settings, groups = axis_settings(machine, averages)
        own = no_shaper(machine) | {"filter_damping": np.zeros(len(AXES))}
        own["filter_for"] = np.full(len(AXES), 0.01)
        filtered = Scheme(
            self.name, "moving averages of the axes", FAMILIES["jerk-limited"], fixed | own,
            settings, groups, shaped=("average", "triangle"),
            notes=(
                "type 4 needs MD32411 equal to MD32410; all axes of a contour need the same filter",
                "a filter rounds corners of cutting paths, too",
            ),
            cannot=("a rise of the jerk unlike its fall",),
        )  # fmt: skip
        return {"jerk": soft, "filter": filtered}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Machine data by their names."""
        out = []
        for setting, number in numbers:
            if number == "off":
                out.append(f"$MA_AX_JERK_ENABLE[{setting.axis}] = 0")
                continue
            out.append(f"$MA_{setting.meaning}[{setting.axis}] = {number}")
            if setting.number == "MD32402":
                out.append(f"$MA_AX_JERK_ENABLE[{setting.axis}] = 1")
        return out
