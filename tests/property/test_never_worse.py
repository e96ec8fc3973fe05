"""What is written is never worse than the control's own rapid, in every controller's G-code.

Nothing here is ours but the command: a small reader takes the blocks from the output, a control
that holds F over its blocks runs them as a staircase of velocity, and the modes follow (vibration).
"""

import re
from math import ceil

import numpy as np
import pytest
from hypothesis import example, given, note
from vibration import CALM, KNOWN, Staircase, cases, hold_to_today

from gcodejerk.machine import Machine
from gcodejerk.rewrite.pipeline import process

HEADS = {
    "csv": "G21 G90 G94 G64",
    "linuxcnc": "G21 G90 G94 G64",
    "fanuc": "O1\nG21 G17 G40 G49 G80 G90 G94 G64",
    "haas": "O1\nG21 G17 G40 G80 G90 G94 G64",
    "siemens": "G71 G17 G40 G90 G94 G64",
    "grbl": "G21 G90 G17 G94",
    "mach": "G21 G90 G17 G94 G64",
    # F, at which their G0 runs, is out of reach.
    "marlin": "G21\nG90\nG0 F900000",
    "klipper": "G21\nG90\nG0 F900000",
}
DIALECTS = {"csv": "linuxcnc"}
WORD = re.compile(r"([XYZF])(-?[0-9.]+)")


def streams(output, blocks, starts):
    """Points [mm] and F [mm/min] of each rewritten rapid, by its number from 0."""
    found, inside = {}, None
    at, k = None, 0
    for line in output.splitlines():
        if "gcodejerk: " in line:
            k = blocks.index(line.partition("gcodejerk: ")[2].rstrip(")"), k)
            inside, k = k, k + 1
            at, found[inside] = dict(starts[inside][2]), []
        elif inside is None and line in blocks[k:]:  # left alone
            k = blocks.index(line, k) + 1
        elif inside is not None and line.startswith("G1"):
            words = {letter: float(number) for letter, number in WORD.findall(line)}
            feed = words.pop("F")
            at = at | words
            found[inside].append((feed, at))
        elif inside is not None and line.startswith("G0"):
            if len(found[inside]) > 1:
                inside = None
            else:  # what leads in
                found[inside] = []
    return found


def tables(output, starts):
    """The same of a table: time and points."""
    header, *rows = (line.split(",") for line in output.splitlines())
    by_line = {}
    for row in rows:
        values = dict(zip(header[1:], map(float, row[1:]), strict=True))
        by_line.setdefault(int(row[0]), []).append((values.pop("t"), values))
    return {line - 3: by_line[line] for line in by_line}


def staircase(blocks, start, letters):
    """What a control runs that holds F over each block."""
    t, v, at = [], [], np.array([start[a] for a in letters])
    for feed, point in blocks:
        to = np.array([point[a] for a in letters])
        length = np.linalg.norm(to - at)
        if length > 0.0:
            t.append(60.0 * length / feed)
            v.append((to - at) / t[-1])
        at = to
    return Staircase(np.array(t), np.array(v))


def periods(blocks, start, letters, dt):
    """The same of LinuxCNC, in every servo period: speeds change linearly within blocks, from the
    least F of two neighbours to the next, and positions pass a filter."""
    q = np.array([[p[a] for a in letters] for p in (start, *(p for _, p in blocks))])
    feed = np.array([f for f, _ in blocks]) / 60.0
    speed = np.concatenate([[0.0], np.minimum(feed[:-1], feed[1:])])
    length = np.linalg.norm(np.diff(q, axis=0), axis=1)
    # The tail, of a step of servo, holds its speed; what leads in is a thousandth of a step.
    lasts = 2.0 * length[:-1] / (speed[:-1] + speed[1:])
    at = np.concatenate([[0.0], np.cumsum(lasts)])
    moment = np.arange(-2, ceil(at[-1] / dt - 1e-3) + 4) * dt
    k = np.clip(np.searchsorted(at, moment) - 1, 0, len(lasts) - 1)
    tau = np.clip(moment - at[k], 0.0, lasts[k])
    way = speed[k] * tau + (speed[k + 1] - speed[k]) * tau**2 / (2.0 * lasts[k])
    x = q[k] + (way / length[k])[:, np.newaxis] * (q[k + 1] - q[k])
    x = (x[:-2] + 4.0 * x[1:-1] + x[2:]) / 6.0
    return Staircase(np.full(len(x) - 1, dt), np.diff(x, axis=0) / dt)


@pytest.mark.parametrize("profile", ["condition3", "cascade", "optimal"])
@pytest.mark.parametrize("controller", HEADS)
@CALM
@given(case=cases())
@example(case=KNOWN)
def test_no_written_rapid_is_worse_than_the_control_s_own(controller, profile, case):
    text, axes, _, dt, moves = case
    note(text)
    blocks = ["G0 " + " ".join(f"{a}{x:.3f}" for a, x in to.items()) for _, to, _ in moves]
    program = "\n".join([HEADS[controller], "M9", *blocks, "M30"]) + "\n"
    note(program)
    startup = "G71" if controller == "siemens" else ""  # which its F counts in
    said = text.replace("decimal_point", f"startup: '{startup}'\n  decimal_point")
    machine = Machine.loads(said + f"dialect: {DIALECTS.get(controller, controller)}\n")
    result = process(program.encode(), machine, controller=controller, profile=profile)
    output, letters = result.output.decode(), list(axes)
    found = tables(output, moves) if controller == "csv" else streams(output, blocks, moves)
    assert len(found) == result.planned
    assert case is not KNOWN or len(found) >= len(moves) - 1
    motions = {}
    for k, points in found.items():
        if controller == "csv":
            times = np.array([t for t, _ in points])
            q = np.array([[p[a] for a in letters] for _, p in points])
            steps = np.diff(times)
            motions[k] = Staircase(steps, np.diff(q, axis=0) / steps[:, np.newaxis])
        elif controller == "linuxcnc":
            motions[k] = periods(points, moves[k][2], letters, dt)
        else:
            motions[k] = staircase(points, moves[k][2], letters)
    # The band is judged to 0.5 %; of LinuxCNC's motion between the points a curve is a guess.
    guessed = controller == "linuxcnc"
    slack = (0.05, 3e-3) if guessed else (0.006, 2e-6)
    hold_to_today(case, result, motions, slack, reported=not guessed)
