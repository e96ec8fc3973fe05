"""What a controller's emitter is, and how emitters are found.

An emitter turns streams into text. It knows the controller's language and nothing of how a profile
was designed. Emitters are found through the entry points `gcodejerk.controllers`, ours and those of
other packages alike; listing them loads none.
"""

from __future__ import annotations

import difflib
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import DIALECTS, Dialect, Program, Rapids
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat
from gcodejerk.start import Start
from gcodejerk.units import MM_PER_INCH

GROUP = "gcodejerk.controllers"
API = 1
MOST_DECIMALS = 9


ONE_FRAME = (
    "positions are those of the program: where it changes its work system, tool length or G92 "
    "between rapids, another offset lies between them and the drives from there on, which the file "
    "does not say (docs/points.md)"
)
"""Of files of absolute positions."""
CONFIRM = "confirm with your machine's manual before use"
"""Said of every fact that nobody could verify."""


@dataclass(frozen=True, slots=True)
class Form:
    """One way in which an emitter can write, and how far its facts can be trusted."""

    name: str
    """stream, pvt or parameters"""
    confidence: str
    """measured, documented or unverified"""
    note: str


@dataclass(frozen=True, slots=True)
class Options:
    """What a user may choose about the text."""

    comments: bool = True
    """Name the original block in a comment in front of its stream."""
    dialect: Dialect = DIALECTS["linuxcnc"]
    """In which the program is written, and the streams in it."""


class Controller(ABC):
    """An emitter: what every one has, and what most leave as it is here.

    A controller of another package derives from this class, or from `emit.gcode.GcodeController`
    where it writes G1 blocks, and is found by its entry point. `load_controller` says what is
    missing.
    """

    name: str = ""
    """That of its entry point."""
    api: int = API
    """Of this class, as it was when the emitter was written."""
    in_place: bool = True
    """The streams replace blocks of the program; otherwise they are a file of their own."""
    suffix: str = ""
    """Of the output's name; empty for that of the input."""
    unblended: str = ""
    """Axes between whose blocks the control stops: their rapids are left alone."""
    play: Play = Play.TABLE
    """What the control makes of the points: what is left in the modes is judged by that. `verify`
    takes every controller but `linuxcnc` for one that moves in straight lines between them."""
    forms: tuple[Form, ...] = ()
    """What it can write; at least one."""
    form: str = "stream"
    """The one that it writes."""
    beside: str = ""
    """What is added to the output's name for a file of samples that belongs to it; empty: none."""
    longest: int | None = None
    """Samples of the longest move that it can write."""
    repeats: bool = False
    """Where blocks, modes, ways and places of two streams are the same, their texts are."""
    joins: bool = True
    """Its texts depend on whether the line right in front has a stream."""
    between: bytes = b""
    """What stands between two moves of a file of its own."""

    @property
    def apart(self) -> bool:
        """Texts depend on rows and blocks alone, not on which of the program they are."""
        return self.repeats

    def in_form(self, form: str) -> Controller:
        """The emitter for one of its forms.

        Raises
        ------
        EmitError
            It does not have that form.
        """
        names = [f.name for f in self.forms]
        if form not in names:
            raise EmitError(
                f"controller {self.name} cannot write --as {form} in this version",
                f"it can write: {', '.join(names)}",
            )
        return self

    def require(self, machine: Machine) -> None:
        """Refuse a machine file that does not say what the text needs, before anything is read."""
        return

    def opening(self, newline: bytes, sums: tuple[int, int] = (0, 0)) -> bytes:
        """Lines below the stamp, of a length that the sums of the file beside do not change."""
        return b""

    def beside_header(self, machine: Machine) -> bytes:
        """First lines of the file beside."""
        return b""

    def render_beside(self, batch: Batch, rapids: Rapids) -> list[bytes]:
        """What the file beside holds of each move of a batch."""
        return [b""] * len(batch)

    def start(self, machine: Machine) -> Start:
        """What a program may assume that is read to be written for this controller."""
        own = replace(machine, controller=self.name)
        return replace(own.program_start(), restores=self.in_place)

    def stride(self, interval: float) -> int:
        """Intervals from one written point to the next."""
        return 1

    @abstractmethod
    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """Steps and origins for all rapids of a program."""

    def unguardable(
        self, program: Program, source: BinaryIO, machine: Machine, dialect: Dialect
    ) -> NDArray[np.bool_]:
        """Rapids that are left alone, since the guard that the machine file wants cannot be there.

        Raises
        ------
        EmitError
            The controller has no such guard, or the program leaves no room for it.
        """
        if machine.controller_options.override_guard:
            raise EmitError(
                f"the machine file wants override_guard, which controller {self.name} cannot write",
                "take it out of controller_options, or choose --controller linuxcnc",
            )
        return np.zeros(len(program.rapids), dtype=np.bool_)

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """What a user of these streams has to know."""
        return []

    def header(self, machine: Machine) -> bytes:
        """First lines of a file of its own; empty for streams in place."""
        return b""

    def footer(self, digest: str) -> bytes:
        """Last lines of a file of its own, from the sum of all in front in hexadecimal digits."""
        return b""

    def end_steps(self, machine: Machine) -> NDArray[np.float64] | None:
        """Steps (9,) in which points begin and end too [mm] or [deg]; None: as the program says."""
        return None

    def row_format(self, machine: Machine) -> RowFormat:
        """Ticks and steps of rows, for a controller that plays cubics (`Play.CUBIC`)."""
        raise self._lacks("rows")

    def render_rows(self, rows: Rows, rapids: Rapids, blocks: Sequence[bytes]) -> list[bytes]:
        """Text of each move of a batch of rows, for such a controller."""
        raise self._lacks("rows")

    def _lacks(self, what: str) -> EmitError:
        """What is said where something is asked of a controller that it does not write."""
        return EmitError(
            f"controller {self.name} writes no {what}", "`gcodejerk controllers` shows what it does"
        )

    @abstractmethod
    def render(
        self,
        batch: Batch,
        rapids: Rapids,
        blocks: Sequence[bytes],
        newline: bytes,
        options: Options,
    ) -> list[bytes]:
        """Text of each move of a batch.

        Parameters
        ----------
        batch : Batch
            b moves.
        rapids : Rapids
            The program's; row i of the plans is rapid i.
        blocks : sequence of bytes
            The b original blocks, without line ends.
        newline : bytes
            Line end where a block has none of its own.
        options : Options
            The user's choices.

        Returns
        -------
        list of bytes
            b texts, each with its line end.
        """


class WithoutStreams(Controller):
    """A controller that takes no streams: it is told rows, or only has settings."""

    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """There are none."""
        raise self._lacks("streams")

    def render(
        self,
        batch: Batch,
        rapids: Rapids,
        blocks: Sequence[bytes],
        newline: bytes,
        options: Options,
    ) -> list[bytes]:
        """There are none."""
        raise self._lacks("streams")


@cache
def controllers() -> Mapping[str, EntryPoint]:
    """Every emitter that is installed, by name: the same as long as a process lives."""
    return MappingProxyType({entry.name: entry for entry in entry_points(group=GROUP)})


def controller_of(machine: Machine, chosen: str | None = None) -> Controller:
    """Load the emitter that was chosen, or the machine file's own.

    Parameters
    ----------
    machine : Machine
        Names one.
    chosen : str, optional
        Instead of it.

    Returns
    -------
    Controller

    Raises
    ------
    EmitError
        As `load_controller`; with its place where the machine file names it.
    """
    try:
        return load_controller(chosen or machine.controller)
    except EmitError as error:
        error.place = None if chosen else machine.named_at.get("controller")
        raise


def load_controller(name: str) -> Controller:
    """Load an emitter.

    Parameters
    ----------
    name : str
        Of its entry point.

    Returns
    -------
    Controller

    Raises
    ------
    EmitError
        There is none of that name, it cannot be loaded, or it was written for another version.
    """
    found = controllers()
    if name not in found:
        near = difflib.get_close_matches(name, found, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise EmitError(
            f"there is no controller {name!r}",
            f"{hint}available: {', '.join(sorted(found)) or 'none (gcodejerk is not installed)'}",
        )
    entry = found[name]
    try:
        made = entry.load()()
    except Exception as error:
        raise EmitError(
            f"{_named(name, entry)} cannot be loaded: {type(error).__name__}: {error}",
            "repair or remove that package",
        ) from error
    if getattr(made, "api", None) != API:
        raise EmitError(
            f"{_named(name, entry)} has api {getattr(made, 'api', None)}, expected {API}",
            "install a version of it that fits this gcodejerk",
        )
    if not isinstance(made, Controller):
        raise EmitError(
            f"{_named(name, entry)} is a {type(made).__name__}, which is no "
            "gcodejerk.emit.base.Controller",
            "derive its class from that one",
        )
    if made.name != name or not made.forms:
        lacks = f"calls itself {made.name!r}" if made.name != name else "has no forms"
        raise EmitError(
            f"{_named(name, entry)} {lacks}",
            f"give its class name = {name!r} and at least one Form",
        )
    kind = type(made)
    missing = [
        method
        for method in ("row_format", "render_rows")
        if made.play is Play.CUBIC and getattr(kind, method) is getattr(Controller, method)
    ]
    if missing:
        raise EmitError(
            f"{_named(name, entry)} plays cubics and has no {' and no '.join(missing)}",
            "define them, or give its class another play",
        )
    return made


def _named(name: str, entry: EntryPoint) -> str:
    """An emitter and the package that it is part of, whose metadata take their time to read."""
    origin = f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.value
    return f"controller {name!r} of {origin}"


def decimal_step(resolution: float) -> tuple[int, int]:
    """A resolution as (whole number, decimals): 0.0005 is 5 with 4 decimals.

    A resolution that no nine decimals can write becomes the next finer power of ten.

    Examples
    --------
    >>> decimal_step(0.0005), decimal_step(1 / 3200), decimal_step(0.0001 / 25.4)
    ((5, 4), (3125, 7), (1, 6))
    """
    for decimals in range(MOST_DECIMALS + 1):
        whole = resolution * 10**decimals
        if whole >= 1.0 - 1e-9 and abs(whole - round(whole)) < 1e-6 * whole:
            return round(whole), decimals
    return 1, min(MOST_DECIMALS, math.ceil(-math.log10(resolution) - 1e-9))


def axis_steps(
    machine: Machine, inch: bool, doubles: bool = True
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Step of every axis of `AXES` as whole numbers and decimals, in the program's unit.

    In inches a step is a power of ten, since the resolution in mm has no short form there: the next
    finer one where the control computes in doubles. Others round each number to their least
    increment, which is coarser than the resolution, never finer: 0.0001 in for 0.001 mm (IS-B);
    there, and for a resolution that no nine decimals write, it is the next coarser power of ten.
    """
    whole, decimals = np.ones(len(AXES), dtype=np.int64), np.zeros(len(AXES), dtype=np.int64)
    for axis in machine.axes:
        k = AXES.index(axis.name)
        unit = MM_PER_INCH if inch and not axis.rotary else 1.0
        exact, places = decimal_step(axis.resolution)
        writes = abs(exact / 10**places - axis.resolution) < 1e-6 * axis.resolution
        if unit == 1.0 and (doubles or writes):
            whole[k], decimals[k] = exact, places
            continue
        place = -math.log10(axis.resolution / unit)
        decimals[k] = max(0, math.ceil(place - 1e-9) if doubles else math.floor(place + 1e-9))
    return whole, decimals


def step_sizes(machine: Machine, inch: bool, doubles: bool = True) -> NDArray[np.float64]:
    """The same steps in mm and degrees."""
    whole, decimals = axis_steps(machine, inch, doubles)
    size = whole / 10.0**decimals
    if inch:
        for axis in machine.axes:
            if not axis.rotary:
                size[AXES.index(axis.name)] *= MM_PER_INCH
    return np.asarray(size, dtype=np.float64)
