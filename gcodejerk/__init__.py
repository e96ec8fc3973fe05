"""gcodejerk: rapids that do not shake the machine.

`import gcodejerk` is cheap: each name below is loaded when it is first used.

What is promised from one version to the next: the names in `__all__`, what `gcodejerk.testing` and
`gcodejerk.emit.base` export, and `gcodejerk.nc.read_program`. Everything else may move.

Examples
--------
>>> import gcodejerk
>>> vmc = gcodejerk.Machine.load(gcodejerk.find_machine("vmc"))
>>> plan = gcodejerk.plan_move({"Z": 1.0}, vmc)
>>> plan.time, plan.conventional_time
(0.04, 0.04)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gcodejerk._version import __version__ as __version__

if TYPE_CHECKING:
    from gcodejerk.errors import (
        EmitError,
        GcodejerkError,
        MachineError,
        PlanError,
        ProgramError,
        VerifyError,
    )
    from gcodejerk.machine import Machine, find_machine
    from gcodejerk.motion import residual_acceleration
    from gcodejerk.motion.amplitudes import residual
    from gcodejerk.motion.maps import amplitude_map
    from gcodejerk.planning.move import Plan, plan_move
    from gcodejerk.rewrite.pipeline import process
    from gcodejerk.rewrite.result import RapidResult, Result
    from gcodejerk.verification import Verification, verify

_HOMES = {
    "gcodejerk.errors": (
        "EmitError", "GcodejerkError", "MachineError", "PlanError", "ProgramError", "VerifyError",
    ),
    "gcodejerk.machine": ("Machine", "find_machine"),
    "gcodejerk.motion": ("residual_acceleration",),
    "gcodejerk.motion.amplitudes": ("residual",),
    "gcodejerk.motion.maps": ("amplitude_map",),
    "gcodejerk.planning.move": ("Plan", "plan_move"),
    "gcodejerk.rewrite.pipeline": ("process",),
    "gcodejerk.rewrite.result": ("RapidResult", "Result"),
    "gcodejerk.verification": ("Verification", "verify"),
}  # fmt: skip

__all__ = [
    "EmitError",
    "GcodejerkError",
    "Machine",
    "MachineError",
    "Plan",
    "PlanError",
    "ProgramError",
    "RapidResult",
    "Result",
    "Verification",
    "VerifyError",
    "amplitude_map",
    "find_machine",
    "plan_move",
    "process",
    "residual",
    "residual_acceleration",
    "verify",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    for home, names in _HOMES.items():
        if name in names:
            value = getattr(import_module(home), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module 'gcodejerk' has no attribute {name!r}")
