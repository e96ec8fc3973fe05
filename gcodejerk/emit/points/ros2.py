"""Controller `ros2`: trajectories for ROS 2's joint_trajectory_controller, as YAML.

A document for each rapid, in the form of trajectory_msgs/JointTrajectory: ``joint_names`` and
``points`` with ``positions``, ``velocities`` and ``time_from_start``; in SI, so m and rad.

- With positions and velocities the controller moves on exactly the cubic Hermite; accelerations
  would make it a quintic, so there are none: S, ros2_controllers 94e74de trajectory.cpp, line 434.
- A trajectory begins where the joints are when it arrives, so the first point is the end of the
  first segment: S, trajectory.rst.

The names of the joints are those of ``axis_names``. A joint whose position the program does not
tell is left out (`allow_partial_joints_goal`); one that stands still keeps its position.
"""

from __future__ import annotations

import math

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import PointsController, decimal, names_of
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat

TICK = 1e-9
NANOSECONDS = 1_000_000_000
PLACES, SPEED_PLACES = 12, 9
"""Decimals of positions [m] or [rad] and of velocities."""
M_PER_MM = 1e-3


class Ros2Controller(PointsController):
    """Writes a trajectory for each rapid."""

    name = "ros2"
    suffix = ".yaml"
    form = "pvt"
    between = b"---\n"
    forms = (
        Form(
            "pvt",
            "documented",
            "joint_trajectory_controller: cubic between positions and velocities, SI units; "
            "trajectory_msgs/JointTrajectory as YAML",
        ),
    )
    facts = (
        "joint_trajectory_controller, cubic between positions and velocities: S",
        "positions in m and rad, time from the start; one document a rapid",
    )

    def require(self, machine: Machine) -> None:
        """A joint for each axis."""
        names_of(machine, self.name, "joint name", "joint_name")

    def row_format(self, machine: Machine) -> RowFormat:
        """Nanoseconds, and as fine as doubles."""
        unit = np.array([1.0 / _si(machine, axis) for axis in AXES])
        return RowFormat(TICK, unit * 10.0**-PLACES, unit * 10.0**-SPEED_PLACES)

    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """One document."""
        machine = rows.plans.machine
        part, move = rows.rows_of(index), int(rows.moves[index])
        moving = rows.axes_of(index)
        known = [k for k in map(AXES.index, machine.axis_names) if k in moving or
                 np.isfinite(rapids.start[move, k])]  # fmt: skip
        names = [machine.controller_options.axis_names[AXES[k]] for k in known]
        out = [f"joint_names: [{', '.join(map(_quoted, names))}]", "points:"]
        still = {
            k: _real(round(rapids.start[move, k] * _si(machine, AXES[k]) * 10**PLACES), PLACES)
            for k in known
            if k not in moving
        }
        for row in range(part.start + 1, part.stop):
            positions = [
                still[k] if k in still else _real(int(rows.position[k][row]), PLACES) for k in known
            ]
            velocities = [
                "0.0" if k in still else _real(int(rows.velocity[k][row]), SPEED_PLACES)
                for k in known
            ]
            sec, nanosec = divmod(int(rows.time[row]), NANOSECONDS)
            out.append(
                f"- {{positions: [{', '.join(positions)}], velocities: [{', '.join(velocities)}], "
                f"time_from_start: {{sec: {sec}, nanosec: {nanosec}}}}}"
            )
        return "".join(f"{line}\n" for line in out).encode()


def _si(machine: Machine, axis: str) -> float:
    """Metres for a mm, radians for a degree."""
    rotary = axis in machine.axis_names and machine.axis(axis).rotary
    return math.pi / 180.0 if rotary else M_PER_MM


def _quoted(name: str) -> str:
    """A name that YAML takes for text, whatever it looks like."""
    return f'"{name}"'


def _real(whole: int, places: int) -> str:
    """A number that YAML takes for a real one."""
    text = decimal(whole, places)
    return text if "." in text else f"{text}.0"
