"""How the benchmarks time: the least of some runs, since a machine is only ever slowed down."""

import time


def best_of(function, repeats=3):
    """Least of some wall times, and the result."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        result = function()
        times.append(time.perf_counter() - begin)
    return min(times), result
