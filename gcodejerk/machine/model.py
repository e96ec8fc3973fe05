"""A machine: its description, and how one is read from a file.

Rule: `file` makes a `Description` of a text and knows no `Machine`; so the class can have its own
constructors without a circle.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.file.document import read_text
from gcodejerk.machine.file.loader import load_text
from gcodejerk.machine.file.table import DIALECT_OF_CONTROLLER
from gcodejerk.machine.file.writer import settings_text
from gcodejerk.machine.parts import Description
from gcodejerk.machine.problems import MachineFileError
from gcodejerk.start import Start


@dataclass(frozen=True, slots=True, repr=False)
class Machine(Description):
    """A machine as its YAML file describes it, in mm (or deg), s and Hz."""

    def __repr__(self) -> str:
        return f"<Machine {self.name!r}: {' '.join(self.axis_names)}, {self.controller}>"

    @classmethod
    def load(cls, path: str | Path) -> Machine:
        """Read a machine file.

        Parameters
        ----------
        path : str or Path
            The file; `find_machine` turns the name of a shipped machine into its path.

        Returns
        -------
        Machine
            What it describes.

        Raises
        ------
        MachineFileError
            The file cannot be read or is wrong; lists everything that is.
        """
        return cls.loads(read_text(path), str(path))

    @classmethod
    def loads(cls, text: str, name: str = "<machine>") -> Machine:
        """Read a machine from the text of its file; otherwise as `load`.

        Parameters
        ----------
        text : str
            YAML.
        name : str
            What messages call the file. Its folder is where the names of spectrum files begin.

        Examples
        --------
        >>> machine = Machine.loads('''
        ... interval: 0.001
        ... positioning: linear
        ... axes:
        ...   Z:
        ...     rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
        ...     modes: [{frequency: 30, damping: 0.02}]
        ... ''')
        >>> machine.axis("Z").limit.jerk
        5000000.0
        >>> machine.all_modes()[0][1].name
        '30 Hz'
        """
        return cls._of(load_text(text, name))

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], name: str = "<machine>") -> Machine:
        """Read a machine from what its file would hold; otherwise as `loads`.

        Parameters
        ----------
        values : mapping
            Keys and values as in a machine file, of plain types: dict, list, str, numbers, None.
        name : str
            As for `loads`.

        Raises
        ------
        MachineFileError
            A key or value is wrong; lists everything that is, by its keys and without lines.

        Examples
        --------
        >>> rapid = {"velocity": 600, "acceleration": 5000, "jerk": 5e5}
        >>> axes = {"Z": {"rapid": rapid}}
        >>> Machine.from_dict({"interval": 0.001, "positioning": "linear", "axes": axes})
        <Machine '<machine>': Z, linuxcnc>
        """
        try:
            text = yaml.safe_dump(_plain(values), sort_keys=False)
        except yaml.representer.RepresenterError as error:
            raise MachineError(
                f"{name} holds {error.args[-1]!r}, expected what YAML can hold",
                "give plain dictionaries, lists, strings and numbers",
            ) from None
        try:
            return cls.loads(text, name)
        except MachineFileError as error:
            # Lines of a text that the user never saw lead nowhere.
            raise MachineFileError(
                MachineError(e.problem, e.remedy, Place(name)) for e in error.problems
            ) from None

    @classmethod
    def _of(cls, described: Description) -> Machine:
        """The machine of a description."""
        return cls(**{field.name: getattr(described, field.name) for field in fields(described)})

    @property
    def settings_hash(self) -> str:
        """Eight hex digits that change with anything that a machine file can say."""
        return hashlib.sha256(settings_text(self).encode()).hexdigest()[:8]

    def program_start(self) -> Start:
        """Where and in which modes programs of this machine start.

        Returns
        -------
        Start
            For `nc.read_program`.

        Examples
        --------
        >>> machine = Machine.loads('''
        ... interval: 0.001
        ... positioning: linear
        ... axes:
        ...   Z: {rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}}
        ... program: {start: {Z: 100}, offsets: {H1: 87.2}}
        ... ''')
        >>> start = machine.program_start()
        >>> dict(start.positions), dict(start.tool_lengths)
        ({'Z': 100.0}, {1: 87.2})
        """
        return Start(
            positions=self.program.start,
            offsets=self.program.offsets,
            tool_lengths=self.program.tool_lengths,
            startup=self.program.startup,
            startup_at=self.named_at.get("program.startup"),
            decimal_point=self.program.decimal_point,
            wraps={axis.name: axis.wrap for axis in self.axes if axis.wrap is not None},
            linear={a.name: not self.inch for a in self.axes if a.name in "ABC" and not a.rotary},
            resume=self.program.resume_after_stop,
            harmless=frozenset(self.program.harmless),
            home=self.program.home,
            tool_change=self.program.tool_change,
            m_before=frozenset(int(name[1:]) for name in self.program.m_before),
            m_after=frozenset(int(name[1:]) for name in self.program.m_after),
            spindle=self.spindle,
            rapid_feed=self.rapid_feed,
            diameter=any(axis.diameter for axis in self.axes),
            cycles=self.program.cycles,
            unrolled_lines=self.program.unrolled_lines,
            limits={axis.name: axis.largest() for axis in self.axes},
            along=self.path.largest(),
            straight=self.positioning == "linear",
            control=DIALECT_OF_CONTROLLER.get(self.controller, ""),
            subprograms={} if self.subprograms is None else self.subprograms.files,
        )


def _plain(value: Any) -> Any:
    """Mappings, sequences and numbers of any library as those that YAML writes."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value.item() if hasattr(value, "item") else value
