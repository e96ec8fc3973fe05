"""What it costs to tune a control: CPU time over numbers of distinct rapids and of settings.

    python tests/bench/bench_tuning.py [--moves 500 5000]

Rapids of X are drawn on the machine vmc, and Fanuc's two time constants chosen for them (two
settings that are chosen together); then rapids of three axes and all six. Ratios of times within
one run are what counts.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

from gcodejerk.emit import load_controller
from gcodejerk.machine import Machine, find_machine
from gcodejerk.parameters import GOALS, Moves, tune


def drawn(machine, count, axes):
    """Distinct rapids of some axes, one or two of them at a time."""
    random = np.random.default_rng(7)
    rows = np.zeros((count, 9))
    one = random.integers(0, axes, count)
    rows[np.arange(count), one] = random.uniform(1.0, 500.0, count).round(3)
    if axes > 1:
        both = np.flatnonzero(random.random(count) < 0.3)
        rows[both, (one[both] + 1) % axes] = random.uniform(-100.0, 100.0, len(both)).round(3)
    return Moves.of(rows, np.ones(count, dtype=bool), np.full(count, np.inf), machine)


def main():
    """Print a row for each case."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--moves", type=int, nargs="+", default=[500, 5000])
    options = parser.parse_args()
    vmc = Machine.load(find_machine("vmc"))
    one_axis = replace(vmc, axes=vmc.axes[:1], modes=())
    emitter = load_controller("fanuc")
    for machine, axes in ((one_axis, 1), (vmc, 3)):
        for goal in GOALS:
            for count in options.moves:
                moves = drawn(machine, count, axes)
                scheme = emitter.scheme(machine)
                begin = time.process_time()
                found = tune(scheme, moves, machine, goal=goal, curve=False)
                spent = time.process_time() - begin
                print(
                    f"{len(scheme.settings)} settings, {len(moves):5d} rapids, {goal:5s}: "
                    f"{spent:6.2f} s CPU, {found.judged:4d} judged on all; "
                    f"{1e3 * found.today.value:.3g} -> {1e3 * found.chosen.value:.3g} um",
                    flush=True,
                )


if __name__ == "__main__":
    main()
