"""The machine: a YAML file read into axes, limits and modes."""

from gcodejerk.machine.file.schema import machine_schema
from gcodejerk.machine.file.table import DIALECT_OF_CONTROLLER
from gcodejerk.machine.file.writer import machine_yaml
from gcodejerk.machine.find import find_machine
from gcodejerk.machine.model import Machine
from gcodejerk.machine.parts import (
    BELL,
    FILTERS,
    FREE,
    JERK_LIMITED,
    LAWS,
    LINUXCNC,
    LONE_SHARE,
    PLANNERS,
    STREAM_HEADROOM,
    TRAPEZOIDAL,
    Axis,
    ControllerParameter,
    Design,
    Filter,
    Limits,
    Mode,
    PathLimits,
    ProgramStart,
    Spectrum,
)
from gcodejerk.machine.problems import MachineFileError

__all__ = [
    "BELL",
    "DIALECT_OF_CONTROLLER",
    "FILTERS",
    "FREE",
    "JERK_LIMITED",
    "LAWS",
    "LINUXCNC",
    "LONE_SHARE",
    "PLANNERS",
    "STREAM_HEADROOM",
    "TRAPEZOIDAL",
    "Axis",
    "ControllerParameter",
    "Design",
    "Filter",
    "Limits",
    "Machine",
    "MachineFileError",
    "Mode",
    "PathLimits",
    "ProgramStart",
    "Spectrum",
    "find_machine",
    "machine_schema",
    "machine_yaml",
]
