r"""What simulation takes, beside matrix exponentials for the same machine in the same run.

    python tests/bench/bench_simulation.py [--rapids 1000]

The machine is `vmc33`: 33 degrees of freedom, 72 states. First the course of one rapid at 5,000
moments, by the poles and by stepping with a matrix that is computed once; then rapids between drawn
places, each today's way and as planned.
"""

import argparse
import time

import numpy as np
from scipy.linalg import expm

from gcodejerk import Machine, find_machine, plan_move
from gcodejerk.planning.plan import plan_moves
from gcodejerk.simulation.equations import equations_of
from gcodejerk.simulation.moves import Watch
from gcodejerk.simulation.programs import planned_steps, simulate_rapids

MOMENTS = 5000


def cpu(function, *args):
    """CPU time of a call, and what it gives."""
    begin = time.process_time()
    found = function(*args)
    return time.process_time() - begin, found


def stepped(equations, times):
    """As many steps of the free machine, by a matrix exponential computed once."""
    step = expm(equations.A * float(times[1] - times[0]))
    state = np.ones(len(step))
    for _ in times:
        state = step @ state
    return state


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rapids", type=int, default=1000)
    given = parser.parse_args()
    machine = Machine.load(find_machine("vmc33"))
    watch = Watch(equations_of(machine), machine.design.tolerance)
    steps = planned_steps(plan_move({"Z": 1.0}, machine).plans, 0)
    times = np.linspace(0.0, 1.0, MOMENTS)
    rows = [*watch.lag, *watch.places]
    mine, _ = cpu(watch.record, steps, times, rows)
    plain, _ = cpu(stepped, watch.equations, times)
    states = len(watch.equations.A)
    print(f"{states} states, {MOMENTS} moments: {mine:.3f} s, {mine / plain:.2f} of stepping")
    moved = np.zeros((given.rapids, 9))
    drawn = np.random.default_rng(3).uniform(1.0, 300.0, given.rapids)
    moved[np.arange(given.rapids), np.arange(given.rapids) % 3] = drawn
    planned, plans = cpu(plan_moves, moved, machine)
    took, found = cpu(simulate_rapids, plans, watch)
    print(
        f"{len(found)} rapids, {found.distinct} unlike: {took:.2f} s, {took / plain:.0f} times "
        f"the stepping of one; planning them took {planned:.2f} s"
    )


if __name__ == "__main__":
    main()
