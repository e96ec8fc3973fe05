"""Fuzz the reader: any bytes are a program or a ProgramError, in every dialect, in linear time.

    python tests/fuzz/fuzz_reader.py --minutes 60
    python tests/fuzz/fuzz_reader.py --replay tests/fuzz/crashes/reader/crash-...

Promises: nothing but ProgramError is raised; the quick and the careful reading find the same; every
rapid's block lies in the file; twice the program takes no more than twice the time, generously.
"""

import io
import sys
import time
import zlib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import engine

ALLOWANCE, PER_BYTE = 1.0, 30e-6
"""CPU time for one input: [s], and [s] for each byte. Plain lines take 0.1 us a byte."""
EVERY = 256
"""The time of a long program is looked at for one input and dialect in so many: in all dialects at
once it takes longer than one input may."""


def load():
    from gcodejerk.errors import ProgramError
    from gcodejerk.nc import DIALECTS, read_program
    from gcodejerk.testing.programs import differences

    def read(data, dialect):
        try:
            return read_program(io.BytesIO(data), dialect=dialect)
        except ProgramError as error:
            assert str(error)
            return None

    def check(data, timed=True):
        for dialect in DIALECTS:
            begun = time.process_time()
            program = read(data, dialect)
            assert not differences(data, dialect=dialect)
            if timed:
                engine.within_linear_time(begun, 3 * len(data), ALLOWANCE, PER_BYTE)
            if program is None:
                continue
            rapids = program.rapids
            assert program.size == len(data)
            assert ((rapids.begin >= 0) & (rapids.begin < rapids.end)).all()
            assert (rapids.end <= len(data)).all()
            assert (rapids.end[:-1] <= rapids.begin[1:]).all(), "blocks overlap"
            if timed and zlib.crc32(data + dialect.encode()) % EVERY == 0:
                grows_linearly(read, data, dialect)

    return check


def grows_linearly(read, data, dialect):
    """Twice the file may not take more than three times as long."""
    times = []
    copies = 50_000 // max(len(data), 1) + 1
    for attempt in range(4):
        for n in (copies, 2 * copies):
            begun = time.process_time()
            read(n * (data + b"\n"), dialect)
            times.append(time.process_time() - begun)
        short, long = times[-2:]
        # Something else may have had the cache; what is quadratic is so every time.
        if long < 3.0 * short + 0.2:
            return
        assert attempt < 3, f"{short:.2f} s, but {long:.2f} s for twice the program"


if __name__ == "__main__":
    engine.main(load, "reader")
