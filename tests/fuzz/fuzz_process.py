"""Fuzz the whole way from a program to its verified output.

    python tests/fuzz/fuzz_process.py --minutes 60
    python tests/fuzz/fuzz_process.py --replay tests/fuzz/crashes/process/crash-...

Promises: nothing but a GcodejerkError is raised, and never VerifyError, which says that we wrote
something wrong; every byte that is not a rapid's is kept; `verify` accepts every output; what has
no rapid to rewrite is given back as it is, and what was rewritten is not rewritten again; the time
grows with what is read and written, and no faster.

The first line chooses machine, controller, profile and dialect, by its checksum; so the program can
be any bytes, and whatever changes below that line stays with them.
"""

import sys
import time
import zlib
from dataclasses import replace
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import engine

ALLOWANCE, PER_BYTE = 5.0, 60e-6
"""CPU time for one input: [s], and [s] for each byte read and written."""
PROFILES = ("condition3", "conventional", "condition1", "condition2", "cascade")


def load():
    from gcodejerk.errors import GcodejerkError, ProgramError, VerifyError
    from gcodejerk.machine import Machine, find_machine
    from gcodejerk.nc import DIALECTS
    from gcodejerk.rewrite.expanded import TERMINATOR_LENGTH
    from gcodejerk.rewrite.pipeline import process
    from gcodejerk.verification import verify

    machines = [
        Machine.load(find_machine(name)) for name in ("vmc", "centre", "router", "drill", "paper")
    ]
    machines += [replace(machine, positioning="independent") for machine in machines]
    ways = list(product(machines, ("linuxcnc", "linuxcnc", "csv"), PROFILES, DIALECTS))

    def restored(data, result):
        """The original, from what the output has kept of it and the blocks that it replaced."""
        rapids, output, parts, at = result.program.rapids, result.output, [], 0
        for begin, end, row in result.edits.tolist():
            parts.append(output[at:begin])
            at = end
            if row >= 0:
                end_of_block = rapids.end[row] + TERMINATOR_LENGTH[rapids.terminator[row]]
                parts.append(data[rapids.begin[row] : end_of_block])
        return b"".join([*parts, output[at:]])

    def check(data, timed=True):
        machine, controller, profile, dialect = ways[zlib.crc32(data.split(b"\n")[0]) % len(ways)]
        begun = time.process_time()
        chosen = {"controller": controller, "profile": profile, "dialect": dialect}
        try:
            result = process(data, machine, **chosen, verify=controller == "csv")
        except VerifyError:
            raise
        except GcodejerkError as error:
            assert str(error)
            return
        output = result.output
        if controller != "csv":
            assert restored(data, result) == data
            design = replace(machine.design, profile=profile)
            used = replace(machine, controller=controller, design=design)
            found = verify(data, output, used, dialect=dialect)
            assert found.ok, found.violations[:3]
            if result.planned:
                try:
                    process(output, machine, **chosen)
                    raise AssertionError("its own output is taken for a program")
                except ProgramError as error:
                    assert "processed by gcodejerk before" in str(error)
            else:
                assert output == data
        if timed:
            engine.within_linear_time(begun, len(data) + len(output), ALLOWANCE, PER_BYTE)

    return check


if __name__ == "__main__":
    engine.main(load, "process")
