"""Runs a harness: guided by coverage for hours, for a few hundred inputs in a test, or once more.

A harness is a function that takes bytes and raises where a promise is broken. With `atheris`
(libFuzzer for Python, `pip install atheris`) inputs that reach new code are kept and changed
further; without it the seeds alone are changed, which finds less, and it says so.

What breaks a promise is saved under `crashes/`, what reached new code under `corpus/`, both beside
this file and not in git.
"""

import argparse
import hashlib
import random
import signal
import subprocess
import sys
import time
import traceback
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from mutation import mutate

MOST_BYTES = 100_000
SLOWEST = 60
"""An input that takes longer hangs: the longest, of empty lines, takes 40 in all dialects. [s]"""
MOST_MEMORY = 3072
"""Of one round. [MiB]"""
ROUND = 3.0
"""How long one process of a guided run lasts. [min]"""


def seeds():
    """The programs that everything begins with."""
    return [path.read_bytes() for path in sorted((HERE / "seeds").iterdir())]


def main(load, name):
    """The command line of a harness; `load` imports what is tested and gives the harness."""
    options = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__)
    options.add_argument("--minutes", type=float, default=1.0)
    options.add_argument("--seed", type=int, default=0, help="0: another one each time")
    options.add_argument("--replay", nargs="+", metavar="FILE", help="run saved inputs once more")
    options.add_argument("--round", action="store_true", help=argparse.SUPPRESS)
    options.add_argument("--blind", action="store_true", help="do not use atheris")
    given = options.parse_args()
    if given.replay:
        harness = load()
        for file in given.replay:
            print(file)
            harness(Path(file).read_bytes())
        return
    crashes, corpus = HERE / "crashes" / name, HERE / "corpus" / name
    for folder in (crashes, corpus):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        if given.blind:
            raise ImportError
        import atheris
    except ImportError:
        print("without atheris: inputs are drawn blindly (pip install atheris)")
        sys.exit(blind(load(), given.minutes, given.seed or time.time_ns(), crashes))
    if given.round:
        guided(atheris, load, given.minutes, given.seed, crashes, corpus)
    sys.exit(rounds(given.minutes, given.seed))


def rounds(minutes, seed):
    """Fuzz in processes of a few minutes each, which share the corpus, until a promise is broken.

    An instrumented process grows by some 0.2 MB with each input (the same inputs without atheris
    take 60 MB whatever their number), so an hour of it would end for lack of memory.
    """
    end = time.monotonic() + 60 * minutes
    while (left := (end - time.monotonic()) / 60) > 0:
        command = [sys.executable, sys.argv[0], "--round", "--minutes", str(min(left, ROUND))]
        run = subprocess.run([*command, "--seed", str(seed)], check=False)
        if run.returncode:
            return run.returncode
        seed += seed > 0
    return 0


def guided(atheris, load, minutes, seed, crashes, corpus):
    """Hand over to libFuzzer, which does not come back; it stops at the first promise broken."""
    with atheris.instrument_imports(include=["gcodejerk"]):
        harness = load()

    def custom(data, most, seed):
        draw = random.Random(seed)
        if draw.randrange(4) == 0:
            return atheris.Mutate(data, most)
        return mutate(data, draw, most)

    arguments = [
        sys.argv[0],
        f"-max_total_time={max(1, int(60 * minutes))}",
        f"-max_len={MOST_BYTES}",
        f"-timeout={SLOWEST}",
        f"-rss_limit_mb={MOST_MEMORY}",
        f"-artifact_prefix={crashes}/",
        *([f"-seed={seed}"] if seed else []),
        str(corpus),
        str(HERE / "seeds"),
    ]
    atheris.Setup(arguments, harness, custom_mutator=custom)
    atheris.Fuzz()


def blind(harness, minutes, seed, crashes):
    """Change seeds until the time is over; the number of different promises broken."""
    draw, begun, found, runs = random.Random(seed), time.monotonic(), set(), 0
    kept = seeds()
    signal.signal(signal.SIGALRM, _too_slow)
    while time.monotonic() < begun + 60 * minutes:
        data = mutate(draw.choice(kept), draw, MOST_BYTES)
        runs += 1
        signal.alarm(SLOWEST)
        try:
            harness(data)
        except Exception as error:
            where = repr(
                [(f.filename, f.lineno) for f in traceback.extract_tb(error.__traceback__)]
            )
            if where not in found:
                found.add(where)
                file = crashes / f"crash-{hashlib.sha1(data).hexdigest()}"
                file.write_bytes(data)
                traceback.print_exc()
                print(f"saved: {file}", flush=True)
        finally:
            signal.alarm(0)
    print(f"{runs} inputs, {len(found)} promises broken; seed {seed}")
    return len(found) > 0


def _too_slow(number, frame):
    raise TimeoutError(f"more than {SLOWEST} s")


def within_linear_time(begun, size, allowance, per_byte):
    """Break the promise of linear time: so many seconds, and so many more for each byte."""
    took = time.process_time() - begun
    assert took <= allowance + per_byte * size, f"{took:.1f} s for {size} bytes"
