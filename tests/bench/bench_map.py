"""What a map costs, beside one naive evaluation of the paper's Eq. 28 on the same grid.

    python tests/bench/bench_map.py [--points 1000]

The naive evaluation is the formula as printed, in numpy: a sine of T2 at every point, no damping,
Condition III, infeasible points not looked for. "times" is our time over its time.
"""

import argparse

import numpy as np
from timing import best_of

from gcodejerk.motion.maps import amplitude_map, displacement_map


def equation_28(length, T1, T_SUM, frequency):
    """Eq. 28 over a grid."""
    omega = 2.0 * np.pi * frequency
    T1, T = T1[np.newaxis, :], T_SUM[:, np.newaxis]
    T2 = T / 2.0 - T1
    R = T2 / T1
    J1 = 6.0 * length / (T1**2 * T * (2.0 * R + 1.0))  # noqa: N806
    return 2.0 * J1 / omega * np.abs((1.0 + 1.0 / R) * np.sin(omega * T2) - np.sin(omega * T / 2.0))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=1000)
    points = parser.parse_args().points
    T1, T = np.linspace(0.0002, 0.0451, points), np.linspace(0.0201, 0.0907, points)
    naive, expected = best_of(lambda: equation_28(1.0, T1, T, 30.0), 9)
    print(f"{points} x {points} points{'':22}{'':>10}{'times':>7}")
    print(f"{'Eq. 28, naive':36}{1e3 * naive:8.1f}ms{1.0:7.1f}")
    for condition in ("III", "II", "I"):
        for damping in (0.0, 0.02):
            ours, found = best_of(
                lambda c=condition, z=damping: amplitude_map(1.0, T1, T, 30.0, z, c), 9
            )
            name = f"amplitude_map, {condition}, damping {damping:g}"
            print(f"{name:36}{1e3 * ours:8.1f}ms{ours / naive:7.1f}")
            if condition == "III" and damping == 0.0:
                there = np.isfinite(found)
                np.testing.assert_allclose(found[there], expected[there], rtol=1e-6, atol=1e-6)
    modes = [30.0, 50.0, 90.0, 110.0], [0.02, 0.02, 0.03, 0.03], [1.0, 0.15, 0.3, 0.2]
    ours, _ = best_of(lambda: displacement_map(1.0, T1, T, *modes), 3)
    print(f"{'displacement_map, four modes':36}{1e3 * ours:8.1f}ms{ours / naive:7.1f}")


if __name__ == "__main__":
    main()
