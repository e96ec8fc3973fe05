"""What the optimum costs: distinct rapids, solved for the first time and read from the cache.

    python tests/bench/bench_optimal.py [--rapids 1000] [--machines 100] [--profile optimal]

"cold" begins with an empty cache, "warm" finds every solution there; "times" is cold over warm,
"condition3" the time of the default profile for the same rapids. Then moves one by one, each
planned by itself from an empty cache: on the shipped machines, and on drawn ones of one to three
axes, 8 to 250 Hz, damping 0 to 0.1, 0.05 to 500 mm, and a jerk limit of 1 to 20 times today's or
none (`--machines 0`: neither). `--profile shortest` asks for the shortest time instead.
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


def drawn_machine(random):
    """A machine file."""
    between = lambda low, high: np.exp(random.uniform(np.log(low), np.log(high)))  # noqa: E731
    text = "schema: 1\nname: drawn\nunits: mm\ninterval: 0.001\npositioning: linear\naxes:\n"
    for axis in "XYZ"[: random.integers(1, 4)]:
        speed, acceleration, jerk_time = between(80, 1000), between(300, 10000), between(0.005, 0.1)
        jerk, limited = acceleration / jerk_time, random.random(2) < 0.8
        rapid = f"velocity: {speed:.1f}, acceleration: {acceleration:.0f}"
        limit = f"velocity: {speed:.1f}, acceleration: {acceleration * random.uniform(1, 2):.0f}"
        rapid += f", jerk: {jerk:.0f}" if limited[0] else ""
        limit += f", jerk: {jerk * random.uniform(1, 20):.0f}" if limited.all() else ""
        text += (
            f"  {axis}:\n    resolution: 0.001\n    rapid: {{{rapid}}}\n    limit: {{{limit}}}\n"
        )
        text += "    modes:\n"
        for _ in range(random.integers(1, 4)):
            damping = 0.0 if random.random() < 0.2 else random.uniform(0.0, 0.1)
            text += f"      - {{frequency: {between(8, 250):.2f}, damping: {damping:.4f}, "
            text += "participation: 1.0}\n"
    return text


def alone(name, machines, random, each, profile):
    """Print how long single moves take, each planned by itself."""
    times = []
    for machine in machines:
        axes = [AXES.index(axis.name) for axis in machine.axes if not axis.rotary]
        for _ in range(each):
            move = np.zeros((1, len(AXES)))
            moving = random.random(len(axes)) < 0.6
            moving[random.integers(len(axes))] = True
            move[0, axes] = np.exp(random.uniform(np.log(0.05), np.log(500.0), len(axes))) * moving
            with tempfile.TemporaryDirectory() as folder:
                os.environ[VARIABLE] = folder
                run = lambda m=machine, d=move: plan_moves(d, m, profile)  # noqa: E731
                times.append(best_of(run, 1)[0])
    middle, most, nearly = np.quantile(times, [0.5, 0.9, 0.99])
    below = np.count_nonzero(np.array(times) < 1.0)
    print(
        f"{name:18}{len(times):8}{middle:9.3f}s{most:9.3f}s{nearly:9.3f}s{max(times):9.3f}s"
        f"{below:8} of {len(times)}"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rapids", type=int, default=1000)
    parser.add_argument("--machines", type=int, default=100, help="that are drawn")
    parser.add_argument("--profile", choices=("optimal", "shortest"), default="optimal")
    given = parser.parse_args()
    profile = given.profile
    print(f"{'machine, axes':18}{'rapids':>8}{'mean T':>9}{'cold':>9}{'each':>10}", end="")
    print(f"{'warm':>9}{'times':>7}{'condition3':>12}")
    cases = [("paper", "Z", 60.0), ("vmc", "Z", 60.0), ("vmc", "XY", 60.0), ("drill", "XY", 60.0)]
    cases.append(("router", "XY", 60.0))
    for name, axes, longest in cases:
        machine = Machine.load(find_machine(name))
        displacement = moves(machine, axes, given.rapids, longest)
        with tempfile.TemporaryDirectory() as folder:
            os.environ[VARIABLE] = folder
            run = lambda m=machine, d=displacement: plan_moves(d, m, profile)  # noqa: E731
            cold, plans = best_of(run, 1)
            warm, _ = best_of(run)
        usual, _ = best_of(lambda m=machine, d=displacement: plan_moves(d, m, "condition3"))
        mean = plans.counts.mean() * machine.interval
        print(
            f"{name + ' ' + axes:8}{longest:8.0f}mm{given.rapids:8d}{mean * 1e3:7.0f}ms{cold:8.2f}s"
            f"{cold / given.rapids * 1e3:8.1f}ms{warm:8.2f}s{cold / warm:7.0f}{usual:11.2f}s"
        )
    if not given.machines:
        return
    random = np.random.default_rng(3)
    print(f"\n{'moves one by one':18}{'moves':>8}{'median':>10}{'90 %':>10}{'99 %':>10}", end="")
    print(f"{'most':>10}{'below 1 s':>14}")
    for name in ("vmc", "router", "drill", "paper", "centre", "vmc33"):
        alone(name, [Machine.load(find_machine(name))], random, 100, profile)
    drawn = [Machine.loads(drawn_machine(random)) for _ in range(given.machines)]
    alone("drawn", drawn, random, 4, profile)


if __name__ == "__main__":
    main()
