"""Rows for motion controllers are never worse than the control's own rapid either.

A small reader of its own takes the rows of each rapid from a file, which the controller joins by
cubics or, where it has one point in each interval, by straight lines; the modes follow (vibration).
What the streams of `linuxcnc-hal` make of LinuxCNC's planner, its tests with LinuxCNC itself show;
here are those that the drives get as they are.
"""

import csv
import io
import json
import re

import numpy as np
import pytest
import yaml
from hypothesis import example, given, note
from vibration import CALM, KNOWN, Rows, Staircase, cases, hold_to_today

from gcodejerk.machine import Machine
from gcodejerk.rewrite.pipeline import process

HEAD = ("G21 G90 G94 G64", "M9")
PER_UNIT = 10_000.0
"""Counts of every axis that has counts. [1/mm]"""
TICK = 1.0 / 1024.0
"""Galil's. [s]"""
UNIT_TIME = 0.001
"""Fanuc's shortest. [s]"""
ROUNDED = 1.1 / PER_UNIT
"""Both ends are rounded. [mm]"""
OPTIONS = {
    "acs": "axis_names: {X: '0', Y: '1', Z: '2'}, confirmed: [acs-pvspline]",
    "csp": "counts_per_unit: {X: 1e4, Y: 1e4, Z: 1e4}",
    "csv": "",
    "elmo": "counts_per_unit: {X: 1e4, Y: 1e4, Z: 1e4}",
    "fanuc15": "counts_per_unit: {X: 1e4, Y: 1e4, Z: 1e4}, fanuc_distance: general, "
    "axis_names: {X: '1', Y: '2', Z: '3'}",
    "galil": "counts_per_unit: {X: 1e4, Y: 1e4, Z: 1e4}, axis_names: {X: A, Y: B, Z: C}",
    "json": "",
    "linuxcnc-hal": "",
    "pmac": "isx90: 1, axis_names: {X: X, Y: Y, Z: Z}, confirmed: [pmac-colon]",
    "ros2": "axis_names: {X: jx, Y: jy, Z: jz}",
}
FORMS = {"csp": "stream", "fanuc15": "stream", "linuxcnc-hal": "position"}


def sections(text):
    """The lines behind each title, by the line of its rapid."""
    parts = re.split(r"rapid at line ([0-9]+).*\n", text, flags=re.IGNORECASE)
    return {int(n): body.splitlines() for n, body in zip(parts[1::2], parts[2::2], strict=True)}


def motion(start, letters, rows):
    """Rows of (time, {axis: (position, velocity)}) behind a start; axes that are left out stand."""
    t, q, v = [0.0], [[start[a] for a in letters]], [[0.0] * len(letters)]
    for moment, said in rows:
        t.append(moment)
        q.append([said[a][0] if a in said else start[a] for a in letters])
        v.append([said[a][1] if a in said else 0.0 for a in letters])
    return Rows(np.array(t), np.array(q), np.array(v))


def lasting(rows):
    """The same rows with the time since the first, of such with the time since the row before."""
    now = 0.0
    for length, said in rows:
        now += length
        yield now, said


def acs(lines, start, letters):
    def rows():
        for line in lines:
            if found := re.fullmatch(r"POINT \(([0-9,]+)\), (.*)", line):
                axes = [letters[int(k)] for k in found[1].split(",")]
                *numbers, ms = map(float, found[2].split(", "))
                n = len(axes)
                yield (
                    ms / 1e3,
                    dict(zip(axes, zip(numbers[:n], numbers[n:], strict=True), strict=True)),
                )

    return motion(start, letters, lasting(rows()))


def pmac(lines, start, letters):
    def rows():
        for line in lines:
            if line.startswith("PVT"):
                time, *words = line[3:].split()
                said = (word[1:].split(":") for word in words)
                numbers = [(float(p), float(v) * 1e3) for p, v in said]
                yield float(time) / 1e3, dict(zip((w[0] for w in words), numbers, strict=True))

    return motion(start, letters, lasting(rows()))


def elmo(lines, start, letters):
    axes = [name[0] for name in lines[0].split(",")[:-1:2]]

    def rows():
        for line in lines[1:]:
            if not line.startswith("#"):
                *numbers, ms = (float(x) for x in line.split(","))
                pairs = [
                    (p / PER_UNIT, v / PER_UNIT) for p, v in zip(*[iter(numbers)] * 2, strict=True)
                ]
                yield ms / 1e3, dict(zip(axes, pairs, strict=True))

    return motion(start, letters, lasting(rows()))


def galil(lines, start, letters):
    at, ticks, by_tick = dict(start), {}, {}
    for line in lines:
        if found := re.fullmatch(r"PV([A-H])=(-?[0-9]+),(-?[0-9]+),([0-9]+)", line):
            axis = letters["ABCDEFGH".index(found[1])]
            p, v, t = (int(number) for number in found.groups()[1:])
            if t:
                at[axis] += p / PER_UNIT
                ticks[axis] = ticks.get(axis, 0) + t
                by_tick.setdefault(ticks[axis], {})[axis] = at[axis], v / PER_UNIT
    assert all(said.keys() == ticks.keys() for said in by_tick.values())
    return motion(start, letters, ((t * TICK, said) for t, said in sorted(by_tick.items())))


def ros2(lines, start, letters):
    message = yaml.safe_load("\n".join(lines).partition("\n---")[0])
    axes = [name[1].upper() for name in message["joint_names"]]

    def rows():
        for point in message["points"]:
            time = point["time_from_start"]
            metres = zip(point["positions"], point["velocities"], strict=True)
            said = ((p * 1e3, v * 1e3) for p, v in metres)
            yield time["sec"] + time["nanosec"] / 1e9, dict(zip(axes, said, strict=True))

    return motion(start, letters, rows())


def csp(lines, start, letters, dt):
    """Points of each cycle as counts."""
    axes = lines[0].split(",")[1:]
    table = [[int(x) for x in row.split(",")] for row in lines[1:] if not row.startswith("#")]
    q = np.tile([start[a] for a in letters], (len(table), 1))
    assert [row[0] for row in table] == list(range(len(table)))
    for column, axis in enumerate(axes, 1):
        q[:, letters.index(axis)] = [row[column] / PER_UNIT for row in table]
    return Staircase(np.full(len(q) - 1, dt), np.diff(q, axis=0) / dt)


READERS = {"acs": acs, "pmac": pmac, "elmo": elmo, "galil": galil, "ros2": ros2}


def of_fanuc15(output, moves, letters, dt):
    """Records of two bytes for each axis and a check byte, up to one of zeros."""
    found, at = {}, 0
    size = 2 * len(letters) + 1
    while title := re.compile(rb"RAPID AT LINE ([0-9]+)").search(output, at):
        at, steps = output.index(b"G05\n", title.end()) + 4, []
        while any(record := output[at : at + size]):
            assert sum(record[:-1]) & 0xFF == record[-1]
            steps.append(np.frombuffer(record[:-1], dtype=">i2"))
            at += size
        steps = np.array(steps, dtype=float) / PER_UNIT
        found[int(title[1]) - 1 - len(HEAD)] = Staircase(np.full(len(steps), dt), steps / dt)
    return found


def of_json(output, moves, letters):
    found = {}
    for one in json.loads(output)["rapids"]:
        k = one["line"] - 1 - len(HEAD)
        rows = (
            (t, {a: (one[a]["position"][i], one[a]["velocity"][i]) for a in letters if a in one})
            for i, t in enumerate(one["t"])
            if i
        )
        found[k] = motion(moves[k][2], letters, rows)
    return found


def of_csv(output, moves, letters):
    by_line = {}
    for row in csv.DictReader(io.StringIO(output)):
        by_line.setdefault(int(row["block"]) - 1 - len(HEAD), []).append(
            (float(row["t"]), {a: (float(row[a]), float(row[f"{a}_velocity"])) for a in letters})
        )
    return {k: motion(moves[k][2], letters, rows[1:]) for k, rows in by_line.items()}


def of_hal(beside, moves, letters, dt):
    """Shares of the way at the end of each servo period."""
    found = {}
    for part in beside.split("rapid ")[1:]:
        head, *shares = part.splitlines()
        k = int(head.split()[1]) - 1 - len(HEAD)
        way = np.array([moves[k][0].get(a, 0.0) for a in letters])
        share = np.array([0.0, *map(float, shares)])
        found[k] = Staircase(np.full(len(shares), dt), np.diff(share)[:, np.newaxis] * way / dt)
    return found


def motions_of(controller, result, moves, letters, dt):
    """Each rewritten rapid as it is played, by its number from 0."""
    if controller == "fanuc15":
        return of_fanuc15(result.output, moves, letters, dt)
    if controller == "linuxcnc-hal":
        return of_hal((result.beside or b"").decode(), moves, letters, dt)
    output = result.output.decode()
    if controller == "json":
        return of_json(output, moves, letters)
    if controller == "csv":
        return of_csv(output, moves, letters)
    found = {}
    for line, lines in sections(output).items():
        k = line - 1 - len(HEAD)
        body = [one for one in lines if not re.match(r"!|//|REM|#", one)]
        own = (dt,) if controller == "csp" else ()
        reader = csp if controller == "csp" else READERS[controller]
        found[k] = reader(body, moves[k][2], letters, *own)
    return found


@pytest.mark.parametrize("profile", ["condition3", "cascade", "optimal"])
@pytest.mark.parametrize("controller", OPTIONS)
@CALM
@given(case=cases())
@example(case=KNOWN)
def test_no_rows_are_worse_than_the_control_s_own_rapid(controller, profile, case):
    text, axes, _, dt, moves = case
    letters = list(axes)
    blocks = ["G0 " + " ".join(f"{a}{x:.3f}" for a, x in to.items()) for _, to, _ in moves]
    program = "\n".join([*HEAD, *blocks, "M30"]) + "\n"
    if controller == "fanuc15" and dt < UNIT_TIME:
        text, dt = text.replace(f"interval: {dt}", f"interval: {UNIT_TIME}"), UNIT_TIME
    if controller == "linuxcnc-hal":
        case = (text.replace("independent", "linear"), *case[1:])
        text = case[0]
    text += f"dialect: linuxcnc\ncontroller_options: {{{options(controller, letters)}}}\n"
    note(text)
    note(program)
    chosen = {"controller": controller, "form": FORMS.get(controller, "pvt"), "profile": profile}
    result = process(program.encode(), Machine.loads(text), **chosen)
    motions = motions_of(controller, result, moves, letters, dt)
    assert len(motions) == result.planned
    assert case is not KNOWN or len(motions) >= len(moves) - 1
    for k, played in motions.items():
        displacement = [moves[k][0].get(a, 0.0) for a in letters]
        assert played.displacement == pytest.approx(displacement, abs=ROUNDED)
    hold_to_today(case, result, motions, (0.006, 2e-6))


def options(controller, letters):
    """The options of a controller, of the machine's own axes alone."""
    others = "".join(set("XYZ") - set(letters)) or "?"
    return re.sub(rf",? ?[{others}]: [^,}}]+", "", OPTIONS[controller])
