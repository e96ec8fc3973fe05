"""What the optimum costs: distinct rapids, solved for the first time and read from the cache.

    python tests/bench/bench_optimal.py [--rapids 1000]

"cold" begins with an empty cache, "warm" finds every solution there; "times" is cold over warm,
"condition3" the time of the default profile for the same rapids.
"""

import argparse
import os
import tempfile

import numpy as np
from timing import best_of

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, find_machine
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.solution_cache import VARIABLE


def moves(machine, axes, count, longest):
    """Displacements of distinct lengths in distinct directions."""
    random = np.random.default_rng(7)
    out = np.zeros((count, len(AXES)))
    for axis in axes:
        size = random.uniform(1.0, longest, count)
        out[:, AXES.index(axis)] = size * random.choice([-1.0, 1.0], count)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rapids", type=int, default=1000)
    given = parser.parse_args()
    print(f"{'machine, axes':18}{'rapids':>8}{'mean T':>9}{'cold':>9}{'each':>10}", end="")
    print(f"{'warm':>9}{'times':>7}{'condition3':>12}")
    cases = [("paper", "Z", 60.0), ("vmc", "Z", 60.0), ("vmc", "XY", 60.0), ("drill", "XY", 60.0)]
    for name, axes, longest in cases:
        machine = Machine.load(find_machine(name))
        displacement = moves(machine, axes, given.rapids, longest)
        with tempfile.TemporaryDirectory() as folder:
            os.environ[VARIABLE] = folder
            run = lambda m=machine, d=displacement: plan_moves(d, m, "optimal")  # noqa: E731
            cold, plans = best_of(run, 1)
            warm, _ = best_of(run)
        usual, _ = best_of(lambda m=machine, d=displacement: plan_moves(d, m, "condition3"))
        mean = plans.counts.mean() * machine.interval
        print(
            f"{name + ' ' + axes:8}{longest:8.0f}mm{given.rapids:8d}{mean * 1e3:7.0f}ms{cold:8.2f}s"
            f"{cold / given.rapids * 1e3:8.1f}ms{warm:8.2f}s{cold / warm:7.0f}{usual:11.2f}s"
        )


if __name__ == "__main__":
    main()
