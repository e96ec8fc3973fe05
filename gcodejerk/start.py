"""What a program may assume when it starts, as its machine file says it.

Rule: `nc` knows no machines and `machine` no programs; the one place where they meet is here, so
that everyone who reads a program for a machine reads it from the same start.
"""

from __future__ import annotations

from gcodejerk.machine import Machine
from gcodejerk.nc import Start


def program_start(machine: Machine) -> Start:
    """Where and in which modes programs of a machine start.

    Parameters
    ----------
    machine : Machine
        Its `program` section, its unit, and whether X is a diameter.

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
    >>> start = program_start(machine)
    >>> dict(start.positions), dict(start.tool_lengths)
    ({'Z': 100.0}, {1: 87.2})
    """
    program = machine.program
    return Start(
        positions=program.start,
        offsets=program.offsets,
        tool_lengths=program.tool_lengths,
        startup=program.startup,
        decimal_point=program.decimal_point,
        wraps={axis.name: axis.wrap for axis in machine.axes if axis.wrap is not None},
        resume=program.resume_after_stop,
        spindle=machine.spindle,
        diameter=any(axis.diameter for axis in machine.axes),
    )
