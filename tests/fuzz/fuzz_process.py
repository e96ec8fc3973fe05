"""Fuzz the whole way from a program to its verified output.

    python tests/fuzz/fuzz_process.py --minutes 60
    python tests/fuzz/fuzz_process.py --replay tests/fuzz/crashes/process/crash-...

Promises: nothing but a GcodejerkError is raised, and never VerifyError, which says that we wrote
something wrong; every byte that is not a rapid's is kept; `verify` accepts every output; what has
no rapid to rewrite is given back as it is, and what was rewritten is not rewritten again; the time
grows with what is read and written, and no faster.

The first line chooses machine, controller, profile, dialect and what is written out first, by its
checksum; so the program can be any bytes, and whatever changes below that line stays with them.
Half of the machines are drawn: other axes, and what a machine file may say of programs.
"""

import random
import sys
import time
import zlib
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import engine

ALLOWANCE, PER_BYTE = 5.0, 60e-6
"""CPU time for one input: [s], and [s] for each byte read and written."""
PROFILES = ("condition3", "conventional", "condition1", "condition2", "cascade")
CONTROLLERS = ("linuxcnc", "csv", "fanuc", "haas", "siemens", "grbl", "mach", "marlin", "klipper")
FRONTS = ({}, {}, {"expand_cycles": True}, {"unroll": True})
STATED = (
    "startup: G21 G90",
    "startup: G21 G90 G94 G17 G40 G49 G54 G64 G80",
    "startup: G20 G90",
    "start: {X: 0, Y: 0, Z: 100}",
    "offsets: {G54: {X: 1, Y: 2, Z: 3}, G55: {X: 0, Y: 0, Z: 0}, H1: 80}",
    "home: {X: 0, Y: 0, Z: 0}",
    "tool_change: {Z: 0}",
    "resume_after_stop: same",
    "decimal_point: calculator",
    "m_before: [M3, M8]",
    "harmless: [M62, M150, G187]",
)
"""What the owner of a drawn machine may say of programs; one line for each key."""


def described(draw):
    """The text of a machine file that is drawn."""
    lines = ["interval: 0.001", f"positioning: {draw.choice(['linear', 'independent'])}", "axes:"]
    for axis in "XYZ" + "".join(draw.sample("ABCUVW", draw.randrange(3))):
        jerk = draw.choice(["", ", jerk: 2.0e+4", ", jerk: 3.0e+5"])
        rapid = f"velocity: {draw.choice([100, 600])}, acceleration: {draw.choice([500, 5000])}"
        mode = f"frequency: {draw.randint(8, 120)}, damping: 0.02, participation: 0.5"
        lines += [
            f"  {axis}:",
            f"    resolution: {draw.choice(['1.0e-3', '1.0e-4', '0.01'])}",
            f"    rapid: {{{rapid}{jerk}}}",
            f"    modes: [{{{mode}}}]",
        ]
        kind = draw.choice(["", "type: linear", "wrap: none", "wrap: sign", "wrap: shortest"])
        lines += [f"    {kind}"] if axis in "ABC" else []
    lines += draw.choice([[], ["spindle: mill"], ["spindle: laser"]])
    stated = {entry.split(":")[0]: entry for entry in draw.sample(STATED, draw.randrange(6))}
    lines += ["program:"] * bool(stated) + [f"  {entry}" for entry in stated.values()]
    return "\n".join(lines)


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

    def way(head):
        draw = random.Random(zlib.crc32(head))
        machine = draw.choice([draw.choice(machines), Machine.loads(described(draw), "drawn")])
        chosen = {
            "controller": draw.choice(CONTROLLERS),
            "profile": draw.choice(PROFILES),
            "dialect": draw.choice(list(DIALECTS)),
        }
        return machine, chosen, draw.choice(FRONTS)

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
        machine, chosen, front = way(data.split(b"\n")[0])
        controller, profile, dialect = chosen.values()
        begun = time.process_time()
        by_itself = bool(front) or controller == "csv"
        try:
            result = process(data, machine, **chosen, **front, verify=by_itself)
        except VerifyError:
            raise
        except GcodejerkError as error:
            assert str(error)
            return
        output = result.output
        if not by_itself:
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
