"""What files of controls share: parameters without streams, and what nobody has measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form, WithoutStreams
from gcodejerk.emit.sheets import Sheets, axis_settings, today_of
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.parameters import Relation, Scheme, Setting, proportional
from gcodejerk.planning.plans import Modes


def unmeasured(note: str) -> Form:
    """Streams as G1 blocks, on a control of which nobody has measured how it follows them."""
    return Form("stream", "unverified", f"{note}; watch a first run without a workpiece")


class SettingsOnly(Sheets, WithoutStreams):
    """A control that we write settings for, and no points."""


def require_jerk(machine: Machine, name: str) -> None:
    """Refuse a machine whose rapids have no jerk, for a control that sets a share of it."""
    for axis in machine.axes:
        if math.isinf(axis.rapid.jerk):
            raise EmitError(
                f"controller {name} sets a share of today's jerk, and {machine.source} has no "
                f"axes.{axis.name}.rapid.jerk",
                "state the jerk of the control's rapids as it is set today",
            )


def acceleration(
    number: str, axis: str, unit: str, per_unit: float, limits: tuple[float, float, float],
    facts: tuple[str, str, str, str], meaning: str = "acceleration of rapids",
) -> Setting:  # fmt: skip
    """A setting that is an acceleration.

    Parameters
    ----------
    number, axis, unit, meaning
        As those of a `Setting`.
    per_unit : float
        mm/s^2 of one unit.
    limits : tuple of float
        Step, lowest, highest number.
    facts : tuple of str
        Mark, source, where it is set, restart.
    """
    return Setting(
        number, axis, unit, meaning, proportional("acceleration", per_unit), *limits, *facts
    )


def jerk(
    number: str, axis: str, unit: str, per_unit: float, limits: tuple[float, float, float],
    facts: tuple[str, str, str, str], meaning: str = "jerk of rapids",
) -> Setting:  # fmt: skip
    """A setting that is a jerk; parameters as for `acceleration`, `per_unit` in mm/s^3."""
    return Setting(number, axis, unit, meaning, proportional("jerk", per_unit), *limits, *facts)


def shaper_of(
    kinds: Sequence[str], axis: str, facts: tuple[str, str, str, str], called: tuple[str, str],
    frequency: tuple[float, float, float],
) -> list[Setting]:  # fmt: skip
    """An axis's shaper, by its type and frequency.

    Parameters
    ----------
    kinds : sequence of str
        The control's words, the first for none.
    axis : str
        The axis, or `ALL`.
    facts : tuple of str
        Mark, source, where it is set, restart.
    called : tuple of str
        What the control calls the two.
    frequency : tuple of float
        Step, lowest, highest. [Hz]
    """
    which = Relation("filter", lambda x, q: x, lambda q: q["filter"])
    made_for = Relation("filter_for", lambda x, q: x, lambda q: q["filter_for"])
    return [
        Setting(called[0], axis, "-", "kind of input shaper", which, 1.0, 0.0,
                float(len(kinds) - 1), *facts, names=tuple(kinds)),
        Setting(called[1], axis, "Hz", "frequency of the shaper", made_for, *frequency, *facts),
    ]  # fmt: skip


def no_shaper(machine: Machine) -> dict[str, Array]:
    """Quantities of axes whose shapers are off, made for the mode of each that shakes most."""
    modes = Modes.of(machine)
    frequency, damping = np.full(len(AXES), 50.0), np.full(len(AXES), 0.0)
    for at in range(len(AXES)):
        strength = np.array([mode.participation_of(AXES[at]) for mode in modes.modes])
        if np.any(strength):
            weight = np.abs(strength) / np.array([mode.frequency for mode in modes.modes]) ** 2
            mode = modes.modes[int(weight.argmax())]
            frequency[at], damping[at] = mode.frequency, mode.damping
    return {"filter": np.zeros(len(AXES)), "filter_for": frequency, "filter_damping": damping}


OFF = "off"
SHAPED = "XYZ"
"""Axes that firmwares have shapers for."""
NO_JERK = "a jerk limit: only the acceleration can be set"


def path_acceleration(machine: Machine) -> dict[str, float]:
    """What the path may do today; where the machine file does not say, no axis hinders it."""
    own = max(axis.rapid.acceleration for axis in machine.axes)
    return {"acceleration": _along(machine, own)}


def shared_acceleration(machine: Machine, today: dict[str, Array]) -> dict[str, float]:
    """The one acceleration of Klipper: it keeps none of an axis but Z's (max_z_accel).

    Parameters
    ----------
    machine : Machine
        Its axes.
    today : dict of str to ndarray, shape (9,)
        Quantities of the axes: those that share it lose their own.

    Returns
    -------
    dict of str to float
        That of the path today: the least of the axes that share it. [mm/s^2]
    """
    sharing = [a for a in machine.axes if not a.rotary and a.name != "Z"] or list(machine.axes)
    for axis in sharing:
        today["acceleration"][AXES.index(axis.name)] = np.inf
    own = min(axis.rapid.acceleration for axis in sharing)
    return {"acceleration": _along(machine, own)}


def _along(machine: Machine, otherwise: float) -> float:
    """Acceleration of the path today, or what axes say of it."""
    stated = machine.path.rapid.acceleration
    return stated if math.isfinite(stated) else otherwise


def shaped_scheme(
    name: str, machine: Machine, title: str, first: Setting, kinds: Mapping[str, str],
    facts: tuple[str, str, str, str], called: tuple[str, str], axes: str = SHAPED,
    shared: bool = False,
) -> Scheme:  # fmt: skip
    """An acceleration along the path, and a shaper for each axis.

    Parameters
    ----------
    first : Setting
        The acceleration.
    kinds : mapping of str to str
        The control's word for each of our kinds of shapers.
    called : tuple of str
        What the control calls kind and frequency.
    axes : str
        That have shapers.
    shared : bool
        The acceleration along the path is all that holds for the axes, but for Z.
    """
    settings: list[Setting] = [first]
    groups = []
    words = [OFF, *kinds.values()]
    for axis in machine.axis_names:
        if axis in axes and not machine.axis(axis).rotary:
            settings += shaper_of(words, axis, facts, called, (0.1, 5.0, 500.0))
            groups.append((0, len(settings) - 2, len(settings) - 1))
    fixed = today_of(machine, "velocity", "acceleration") | no_shaper(machine)
    path = shared_acceleration(machine, fixed) if shared else path_acceleration(machine)
    return Scheme(
        name, title, FAMILIES["trapezoidal"], fixed, tuple(settings), tuple(groups) or ((0,),),
        path, tuple(kinds),
        notes=("a rapid needs the highest F: these firmwares move G0 at F",),
        cannot=("a jerk limit",),
    )  # fmt: skip


def trapezoid_scheme(
    name: str, machine: Machine, number: str, facts: tuple[str, str, str, str], title: str,
    limits: tuple[float, float, float],
) -> Mapping[str, Scheme]:  # fmt: skip
    """A control whose only number is the acceleration of each axis; `number` may hold its index."""

    def one(axis: str) -> list[Setting]:
        called = number.format(120 + AXES.index(axis))
        return [acceleration(called, axis, "mm/s^2", 1.0, limits, facts)]

    settings, groups = axis_settings(machine, one)
    scheme = Scheme(
        name, title, FAMILIES["trapezoidal"], today_of(machine, "velocity", "acceleration"),
        settings, groups, cannot=(NO_JERK,),
    )  # fmt: skip
    return {"acceleration": scheme}


class AxisJerks(SettingsOnly):
    """A board with acceleration and jerk of each axis."""

    facts: tuple[str, str, str, str]
    called: tuple[str, str]
    notes_for_user: tuple[str, ...] = ()

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """Acceleration and jerk of the axes."""

        def both(axis: str) -> list[Setting]:
            return [
                acceleration(self.called[0], axis, "mm/s^2", 1.0, (1.0, 1.0, 1e7), self.facts),
                jerk(self.called[1], axis, "mm/s^3", 1.0, (1.0, 1.0, 1e10), self.facts),
            ]

        settings, groups = axis_settings(machine, both)
        scheme = Scheme(
            self.name, "acceleration and jerk of rapids", FAMILIES["jerk-limited"],
            today_of(machine, "velocity", "acceleration", "jerk"), settings, groups,
            notes=self.notes_for_user, cannot=("a rise of the jerk unlike its fall",),
        )  # fmt: skip
        return {"jerk": scheme}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """A list for whoever sets them."""
        return [f"{s.axis}: {s.number} = {n} {s.unit}" for s, n in numbers]
