"""How fast rapids are planned, all of a program together, beside one after the other.

    python tests/bench/bench_planning.py [--rapids 10000] [--alone 100]

Rapids of distinct lengths on the shipped machines, one to three axes. "Alone" plans a sample of
them by one call each, as a program would that planned at every rapid it meets; "times" is its time
for all of them over that of the one call.
"""

import argparse

import numpy as np
from timing import best_of

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, find_machine
from gcodejerk.planning.batch import NumberFormat
from gcodejerk.planning.designs import _remembered
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.stream import make_streams


def moves(machine, axes, count, longest):
    """Displacements of distinct lengths, from just above the least to the longest."""
    random = np.random.default_rng(7)
    out = np.zeros((count, len(AXES)))
    length = np.geomspace(1.01 * machine.design.minimum_length, longest, count)
    direction = random.normal(size=(count, len(axes)))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    for k, axis in enumerate(axes):
        out[:, AXES.index(axis)] = length * direction[:, k]
    return random.permutation(out)


def planned_anew(displacement, machine):
    """Plan moves, with nothing remembered of earlier runs."""
    _remembered.cache_clear()
    return plan_moves(displacement, machine)


def points_of(plans, displacement):
    """Sample and round every planned move; how many points that are."""
    zero = np.zeros_like(displacement)
    windows = make_streams(plans, NumberFormat(zero, np.full_like(zero, 1e-4), zero), 2)
    return sum(int(batch.grid.blocks.sum()) for window in windows for batch in window)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rapids", type=int, default=10_000)
    parser.add_argument("--alone", type=int, default=100)
    given = parser.parse_args()
    print(
        f"{'machine, axes':16}{'rapids':>8}{'planned':>9}{'as today':>9}{'together':>10}",
        end="",
    )
    print(f"{'each':>9}{'alone':>9}{'times':>7}{'streams':>9}{'points':>10}")
    cases = [
        ("vmc", "Z", 1.9),
        ("vmc", "Z", 300.0),
        ("vmc", "XYZ", 300.0),
        ("drill", "XY", 300.0),
        ("router", "XYZ", 300.0),
    ]
    for name, axes, longest in cases:
        machine = Machine.load(find_machine(name))
        displacement = moves(machine, axes, given.rapids, longest)
        together, plans = best_of(lambda m=machine, d=displacement: planned_anew(d, m))
        few = displacement[: given.alone]
        alone, _ = best_of(
            lambda m=machine, d=few: [plan_moves(d[k : k + 1], m) for k in range(len(d))], 1
        )
        each, single = together / len(displacement), alone / len(few)
        writing, points = best_of(lambda p=plans, d=displacement: points_of(p, d), 1)
        print(f"{name + ' ' + axes:10}{longest:4.0f}mm{len(displacement):8}", end="")
        print(
            f"{int(plans.planned.sum()):9}{int((~plans.planned).sum()):9}{together:9.2f}s",
            end="",
        )
        print(f"{1e6 * each:7.0f}us{1e6 * single:7.0f}us{single / each:7.1f}", end="")
        print(f"{writing:8.2f}s{points:10}")


if __name__ == "__main__":
    main()
