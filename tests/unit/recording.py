"""Records of machines that do not exist: what a sensor would feel, and noise on it."""

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.planning.conventional import conventional_limits, todays_profiles
from gcodejerk.simulation.equations import equations_of
from gcodejerk.simulation.response import Response, profile_steps


def record_of(machine, axis, lengths, *, rate=1600.0, dwell=1.0, noise=25.0, seed=1, begin=0.5):
    """Times [s] and accelerations of the tool along an axis [mm/s^2] while rapids run."""
    equations = equations_of(machine)
    response = Response(equations)
    u = equations.axes.index(axis)
    row = equations.vibration[axis]
    if machine.structure is not None:
        row = equations.table[axis] + row
    seen = response.seen(row) * response.poles**2
    static = response.static(row)
    runs = []
    for length in lengths:
        share = np.zeros((1, len(AXES)))
        share[0, AXES.index(axis)] = abs(length)
        limits = conventional_limits(machine, share, np.ones(1, bool))
        _, profile = todays_profiles(machine, limits, share)
        columns = [AXES.index(name) for name in equations.axes]
        runs.append(profile_steps(profile, np.sign(length) * share, columns))
    total = begin + sum(run.end + dwell for run in runs)
    t = np.arange(0.0, total, 1.0 / rate)
    y = np.zeros(len(t))
    now = begin
    for run in runs:
        behind = t >= now
        since = t[behind] - now
        command = run.command(since)
        felt = (seen @ response.free(run, since)).real
        felt += static[0] @ command[2].T + static[1] @ command[3].T
        if machine.structure is None:
            felt += command[2][:, u]
        y[behind] += felt
        now += run.end + dwell
    return t, y + noise * np.random.default_rng(seed).standard_normal(len(t))
