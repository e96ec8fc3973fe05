"""LinuxCNC's own settings against vibration: jerk limits of 2.10, accelerations of 2.9.

2.10 (S, docs/src/config/ini-config.adoc at 5c41560): [TRAJ] PLANNER_TYPE 1 with MAX_LINEAR_JERK
along the path and MAX_JERK of axes and joints moves in seven segments. 2.9 has accelerations only.
Both are lines of the INI file; no program sets them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gcodejerk.emit.sheets import Sheets, axis_settings, today_of
from gcodejerk.machine import LINUXCNC, LONE_SHARE, Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import Scheme, Setting, proportional

PAGE = ("S", "LinuxCNC 5c41560, ini-config.adoc", "the INI file", "yes")


class LinuxcncSettings(Sheets):
    """Lines of its INI."""

    sheet_suffix = ".linuxcnc-jerk.ini.txt"
    remark = ("# ", "")

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """The jerk limits of 2.10, or the accelerations of 2.9; by the version, if it is stated."""
        known = {"2.10": self._jerks(machine), "2.9": self._accelerations(machine)}
        version = machine.controller_options.version
        first = version if version in known else "2.10"
        return {first: known[first]} | known

    def _jerks(self, machine: Machine) -> Scheme:
        """Type 1 planner: seven segments."""

        def both(axis: str) -> list[Setting]:
            return [
                Setting("MAX_ACCELERATION", axis, "mm/s^2", "acceleration of the axis",
                        proportional("acceleration", 1.0), 1.0, 1.0, 1e9, *PAGE),
                Setting("MAX_JERK", axis, "mm/s^3", "jerk of the axis (2.10)",
                        proportional("jerk", 1.0), 1.0, 1.0, 1e9, *PAGE),
            ]  # fmt: skip

        settings, groups = axis_settings(machine, both)
        return Scheme(
            self.name, "jerk limits (LinuxCNC 2.10)", FAMILIES["jerk-limited"],
            today_of(machine, "velocity", "acceleration", "jerk"), settings, groups,
            notes=(
                "needs LinuxCNC 2.10 or later: 2.9 has no jerk limit and ignores these keys",
                "the limits hold for feeds, too; the same numbers in [JOINT_n] of each axis",
            ),
            cannot=("a rise of the jerk unlike its fall",),
        )  # fmt: skip

    def _accelerations(self, machine: Machine) -> Scheme:
        """2.9: trapezoids of velocity, a lone G0 with half of the acceleration."""
        share = LONE_SHARE if machine.planner == LINUXCNC else 1.0

        def one(axis: str) -> list[Setting]:
            return [
                Setting("MAX_ACCELERATION", axis, "mm/s^2", "acceleration of the axis",
                        proportional("acceleration", share), 1.0, 1.0, 1e9, *PAGE),
            ]  # fmt: skip

        settings, groups = axis_settings(machine, one)
        today = today_of(machine, "velocity", "acceleration")
        today["acceleration"] = today["acceleration"] * share
        return Scheme(
            self.name, "accelerations (LinuxCNC 2.9)", FAMILIES["trapezoidal"], today, settings,
            groups,
            notes=(
                "the limits hold for feeds, too; the same numbers in [JOINT_n] of each axis",
                "streams (`gcodejerk process`) leave far less in the same time",
            ),
            cannot=("a jerk limit",),
        )  # fmt: skip

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """An excerpt of the INI."""
        per_unit = 25.4 if machine.inch else 1.0
        out = []
        jerks = [float(n) for s, n in numbers if s.number == "MAX_JERK"]
        if jerks:
            most = f"{max(jerks) / per_unit:.6g}"
            out += ["[TRAJ]", "PLANNER_TYPE = 1", f"MAX_LINEAR_JERK = {most}"]
        axis = ""
        for setting, number in numbers:
            if setting.axis != axis:
                axis = setting.axis
                out.append(f"[AXIS_{axis}]")
            scale = 1.0 if machine.axis(axis).rotary else per_unit
            out.append(f"{setting.number} = {float(number) / scale:.6g}")
        return out
