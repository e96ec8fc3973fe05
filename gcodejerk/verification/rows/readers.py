"""Readers of the files of rows, one function a format: from lines to numbers.

What a controller makes of the text is written down here a second time, from the same manuals:
samples of 1/1024 s and relative counts (Galil), ms since the row before (Elmo, ACS, PMAC), seconds
since the start in SI (ROS 2), rows from the start on (csv, json).

Rule: every number is read from the text by itself; nothing of an emitter is imported.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.verification.rows.moves import Array, Move, NoRowError, Steps

_REAL = r"(-?[0-9]{1,12}(?:\.[0-9]{1,15})?)"
_WHOLE = r"(-?[0-9]{1,15})"


@dataclass(frozen=True, slots=True)
class Body:
    """What stands below a title: axes, times, positions and velocities, without the start."""

    axes: tuple[int, ...]
    times: list[float]
    """Since the start. [s]"""
    position: list[list[float]]
    velocity: list[list[float]]


Parse = Callable[[Sequence[str], Machine], Body]


@dataclass(frozen=True, slots=True)
class TextFormat:
    """A format of titled blocks of lines."""

    comment: str
    parse: Parse
    steps: Callable[[Machine], Steps]
    relative: bool = False
    inert: bool = False
    """Its lines may all be comments."""
    whole: bool = False
    """The first row stands at the start."""


def _counts(machine: Machine) -> Array:
    given = machine.controller_options.counts_per_unit
    return np.array([given.get(axis, 1.0) for axis in AXES])


def _named(machine: Machine) -> dict[str, int]:
    """Index of an axis by the name that the controller has for it."""
    names = machine.controller_options.axis_names
    return {names.get(a, a): AXES.index(a) for a in machine.axis_names}


def _matched(pattern: str, line: str, what: str) -> re.Match[str]:
    found = re.fullmatch(pattern, line)
    if found is None:
        raise NoRowError(f"expected {what}, found '{line[:60]}'")
    return found


def _axis(name: str, named: dict[str, int]) -> int:
    if name not in named:
        raise NoRowError(f"there is no axis '{name}'")
    return named[name]


def _galil(lines: Sequence[str], machine: Machine) -> Body:
    counts, named = _counts(machine), _named(machine)
    columns: dict[int, list[tuple[int, int, int]]] = {}
    done: list[str] = []
    for line in lines[:-1]:
        letter, *numbers = _matched(
            rf"PV([A-H])={_WHOLE},{_WHOLE},{_WHOLE}", line, "PVA=p,v,t"
        ).groups()
        p, v, t = map(int, numbers)
        if (done and letter == done[-1]) or (letter in done):
            raise NoRowError(f"a segment of {letter} behind its end")
        if (p, v, t) == (0, 0, 0):
            done.append(letter)
        elif t <= 0:
            raise NoRowError(f"a segment of {letter} lasts {t} samples")
        else:
            columns.setdefault(_axis(letter, named), []).append((p, v, t))
    _matched(f"BT{''.join(done)}", lines[-1], f"BT{''.join(done)}")
    axes = tuple(columns)
    clocks = {tuple(np.cumsum([t for _, _, t in column]).tolist()) for column in columns.values()}
    if len(clocks) != 1 or len(done) != len(axes):
        raise NoRowError("the axes have segments of different times, or no end")
    samples = clocks.pop()
    position = [[float(x) for x in np.cumsum([p for p, _, _ in columns[a]]) / counts[a]]
                for a in axes]  # fmt: skip
    velocity = [[v / float(counts[a]) for _, v, _ in columns[a]] for a in axes]
    return Body(axes, [s / 1024.0 for s in samples], _rows(position), _rows(velocity))


def _rows(columns: list[list[float]]) -> list[list[float]]:
    return [list(row) for row in zip(*columns, strict=True)]


def _elmo(lines: Sequence[str], machine: Machine) -> Body:
    counts = _counts(machine)
    names = lines[0].split(",")
    letters = [name[0] for name in names[:-1:2]]
    wanted = [f"{a}_{what}" for a in letters for what in ("position", "velocity")] + ["time_ms"]
    named = {a: AXES.index(a) for a in machine.axis_names}
    axes = tuple(_axis(letter, named) for letter in letters)
    if names != wanted or len(set(axes)) < len(axes):
        raise NoRowError("expected X_position,X_velocity,time_ms")
    time, times, position, velocity = 0, [], [], []
    for line in lines[1:]:
        pattern = ",".join([_WHOLE] * len(names))
        numbers = [int(x) for x in _matched(pattern, line, "whole numbers").groups()]
        time += numbers[-1]
        times.append(1e-3 * time)
        position.append([x / float(counts[a]) for x, a in zip(numbers[:-1:2], axes, strict=True)])
        velocity.append([x / float(counts[a]) for x, a in zip(numbers[1:-1:2], axes, strict=True)])
    return Body(axes, times, position, velocity)


def _pmac(lines: Sequence[str], machine: Machine) -> Body:
    per_second = 1000.0 / (machine.controller_options.isx90 or 1000.0)
    if len(lines) < 3 or (lines[0], lines[-1]) != ("BLOCKSTART", "BLOCKSTOP"):
        raise NoRowError("expected moves between BLOCKSTART and BLOCKSTOP")
    axes: tuple[int, ...] | None = None
    quarter, times, position, velocity = 0, [], [], []
    for line in lines[1:-1]:
        ms, rest = _matched(rf"PVT{_REAL}((?: [A-Z]{_REAL}:{_REAL})+)", line, "PVT1 X1:1").group(
            1, 2
        )
        words = re.findall(rf"([A-Z]){_REAL}:{_REAL}", rest)
        own = tuple(AXES.find(letter) for letter, _, _ in words)
        ticks = round(4000.0 * float(ms))
        if axes not in (None, own) or -1 in own or abs(4000.0 * float(ms) - ticks) > 1e-6:
            raise NoRowError("other axes than before, or a time that is no quarter of 1 us")
        axes, quarter = own, quarter + ticks
        times.append(quarter * 0.25e-6)
        position.append([float(p) for _, p, _ in words])
        velocity.append([float(v) * per_second for _, _, v in words])
    assert axes is not None
    return Body(axes, times, position, velocity)


def _acs(lines: Sequence[str], machine: Machine) -> Body:
    group = _matched(r"PVSPLINE (\([0-9,]+\))", lines[0], "PVSPLINE (0)")[1]
    if len(lines) < 3 or lines[-1] != f"ENDS {group}":
        raise NoRowError(f"expected points between PVSPLINE and ENDS {group}")
    named = _named(machine)
    axes = tuple(_axis(number, named) for number in group[1:-1].split(","))
    k, time, times, position, velocity = len(axes), 0, [], [], []
    for line in lines[1:-1]:
        pattern = rf"POINT {re.escape(group)}, {', '.join([_REAL] * 2 * k)}, ([0-9]{{1,9}})"
        numbers = _matched(pattern, line, f"POINT {group}, ...").groups()
        time += int(numbers[-1])
        times.append(1e-3 * time)
        position.append([float(x) for x in numbers[:k]])
        velocity.append([float(x) for x in numbers[k : 2 * k]])
    return Body(axes, times, position, velocity)


def _ros2(lines: Sequence[str], machine: Machine) -> Body:
    names = _matched(r'joint_names: \[("[^"]+"(?:, "[^"]+")*)\]', lines[0], "joint_names: [...]")
    named = _named(machine)
    axes = tuple(_axis(name[1:-1], named) for name in names[1].split(", "))
    if len(lines) < 3 or lines[1] != "points:":
        raise NoRowError("expected points:")
    unit = [
        180.0 / math.pi if machine.axis(AXES[a]).rotary else 1e3 for a in axes
    ]  # of a radian, of a metre
    several = ", ".join([_REAL] * len(axes))
    pattern = (
        rf"- \{{positions: \[{several}\], velocities: \[{several}\], "
        r"time_from_start: \{sec: ([0-9]{1,9}), nanosec: ([0-9]{1,9})\}\}"
    )
    times, position, velocity = [], [], []
    for line in lines[2:]:
        *numbers, sec, nanosec = _matched(pattern, line, "a point").groups()
        times.append((int(sec) * 1_000_000_000 + int(nanosec)) * 1e-9)
        values = [float(x) for x in numbers]
        position.append([x * u for x, u in zip(values[: len(axes)], unit, strict=True)])
        velocity.append([x * u for x, u in zip(values[len(axes) :], unit, strict=True)])
    return Body(axes, times, position, velocity)


def _csp(lines: Sequence[str], machine: Machine) -> Body:
    counts = _counts(machine)
    named = {a: AXES.index(a) for a in machine.axis_names}
    first, *letters = lines[0].split(",")
    axes = tuple(_axis(letter, named) for letter in letters)
    if first != "cycle" or not axes or len(set(axes)) < len(axes):
        raise NoRowError("expected cycle,X")
    times, position = [], []
    pattern = ",".join([_WHOLE] * (1 + len(axes)))
    for k, line in enumerate(lines[1:]):
        cycle, *values = [int(x) for x in _matched(pattern, line, "whole numbers").groups()]
        if cycle != k or max(map(abs, values)) >= 1 << 31:
            raise NoRowError(f"expected cycle {k}, and positions of 32 bits")
        times.append(cycle * machine.interval)
        position.append([x / float(counts[a]) for x, a in zip(values, axes, strict=True)])
    return Body(axes, times, position, [[0.0] * len(axes) for _ in times])


def record_move(line: int, rapid: int, data: bytes, machine: Machine) -> Move:
    """A move from the binary records of a Fanuc 15i; n axes of 2 bytes and a check byte each."""
    n = len(machine.axes)
    rows = np.frombuffer(data, np.uint8).reshape(-1, 2 * n + 1).astype(np.int64)
    if (rows[:, :-1].sum(axis=1) % 256 != rows[:, -1]).any():
        raise NoRowError("a check byte is not the sum of its record")
    high, low = rows[:, 0:-1:2], rows[:, 1:-1:2]
    if machine.controller_options.fanuc_distance == "special":
        if ((high | low) & 1).any():
            raise NoRowError("the low bit of a byte is set, which the special format has not")
        value = (high >> 1) * 128 + (low >> 1)
        value = np.where(value >= 1 << 13, value - (1 << 14), value)
    else:
        value = high * 256 + low
        value = np.where(value >= 1 << 15, value - (1 << 16), value)
    places = [int(machine.controller_options.axis_names[a]) - 1 for a in machine.axis_names]
    value = value[:, places]
    letters = np.flatnonzero(value.any(axis=0))
    axes = tuple(AXES.index(machine.axis_names[k]) for k in letters.tolist())
    counts = _counts(machine)[list(axes)]
    position = np.cumsum(np.concatenate([np.zeros((1, len(axes))), value[:, letters]]), axis=0)
    t = np.arange(len(position), dtype=np.float64) * machine.interval
    position = position / counts
    return Move(line, rapid, axes, np.asarray(t), position, np.zeros_like(position), relative=True)


def _same(position: float, velocity: float, tick: float, **more: float) -> Callable[..., Steps]:
    """The same steps for all axes."""

    def steps(machine: Machine) -> Steps:
        return Steps(np.full(len(AXES), position), np.full(len(AXES), velocity), tick, **more)

    return steps


def _pmac_steps(machine: Machine) -> Steps:
    per_second = 1000.0 / (machine.controller_options.isx90 or 1000.0)
    return _same(1e-7, 1e-5 * per_second, 0.25e-6, longest=4.0959998)(machine)


def _in_counts(tick: float, **more: float) -> Callable[[Machine], Steps]:
    """Whole counts, and counts per second."""

    def steps(machine: Machine) -> Steps:
        return Steps(1.0 / _counts(machine), 1.0 / _counts(machine), tick, **more)

    return steps


def _si_steps(machine: Machine) -> Steps:
    rotary = np.array([a in machine.axis_names and machine.axis(a).rotary for a in AXES])
    unit = np.where(rotary, 180.0 / math.pi, 1e3)
    return Steps(1e-12 * unit, 1e-9 * unit, 1e-9)


TEXTS = {
    "galil": TextFormat("REM ", _galil, _in_counts(1.0 / 1024.0, most=255.0), relative=True),
    "elmo": TextFormat("# ", _elmo, _in_counts(1e-3)),
    "pmac": TextFormat("// ", _pmac, _pmac_steps, inert=True),
    "acs": TextFormat("! ", _acs, _same(1e-7, 1e-5, 1e-3), inert=True),
    "csp": TextFormat(
        "# ", _csp, lambda machine: _in_counts(machine.interval)(machine), whole=True
    ),
    "ros2": TextFormat("# ", _ros2, _si_steps),
}
"""The formats of titled blocks, by controller."""
RECORDS = _in_counts(1e-3)
"""Whole increments; the unit time is the machine's interval, a number of ms."""
CYCLIC = ("csp", "fanuc15")
"""Of these the points are an interval apart, with straight lines between them."""
DOUBLES = _same(1e-9, 1e-6, 1e-9)
"""What tables and JSON are written in."""


def made(line: int, rapid: int, body: Body, text: TextFormat, residual: float | None) -> Move:
    """A move from the rows below a title; its start is the program's."""
    if not body.times:
        raise NoRowError("there are no rows")
    k = len(body.axes)
    if text.whole:
        t, p, v = (np.array(x) for x in (body.times, body.position, body.velocity))
        return Move(line, rapid, body.axes, t, p, v, residual=residual)
    position = np.array([[0.0 if text.relative else np.nan] * k, *body.position])
    velocity = np.array([[0.0] * k, *body.velocity])
    t = np.array([0.0, *body.times])
    return Move(line, rapid, body.axes, t, position, velocity, text.relative, residual)


def json_move(line: int, text: str) -> Move:
    """A move from the line of a JSON document that holds it."""
    try:
        value: Any = json.loads(text)
        letters = [key for key in value if len(key) == 1 and key in AXES]
        columns = [np.array(value["t"], dtype=float)]
        for letter in letters:
            for what in ("position", "velocity"):
                columns.append(np.array(value[letter][what], dtype=float))
        rows = np.stack(columns, axis=1)
        rapid, residual = int(value["line"]), float(value["residual"])
    except (ValueError, KeyError, TypeError) as error:
        raise NoRowError(f"this is no rapid: {error}") from None
    axes = tuple(AXES.index(letter) for letter in letters)
    return Move(line, rapid, axes, rows[:, 0], rows[:, 1::2], rows[:, 2::2], residual=residual)


def table_move(line: int, rapid: int, rows: Array, columns: Sequence[int]) -> Move:
    """A move from rows of a table: t, then position and velocity of every axis of the machine."""
    known: NDArray[np.bool_] = np.logical_not(np.isnan(rows[:, 1::2]).all(axis=0))
    axes = tuple(a for a, k in zip(columns, list(known), strict=True) if k)
    position, velocity = rows[:, 1::2][:, known], rows[:, 2::2][:, known]
    if (rows[:, 2::2][:, ~known] != 0.0).any():
        raise NoRowError("an axis moves whose position is not told")
    return Move(line, rapid, axes, rows[:, 0], position, velocity)
