"""Feed moves that count as rapids: LinuxCNC's interpreter goes to the same places, at their F."""

import difflib
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from interpreter import run_oracle

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process
from gcodejerk.start import RapidFeed

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]
TABLE = Path(__file__).parent / "linuxcnc" / "sim.tbl"
HEAD = "G17 G21 G40 G49 G54 G64 G80 G90 G94 G97\n"
PROGRAMS = {
    "absolute": "G0 X0 Y0 Z15\nG1 X20 Y10 F5000\nZ5\nZ1 F300\nX22\nG2 X24 Y8 I2 J0\nG1 Z15 F5000\n"
    "X60\nZ5\nZ-1 F300\nX70\nY3\nM2\n",
    "increments": "G0 X0 Y0 Z15\nG91\nG1 X20 Y10 F5000\nZ-10\nZ-4 F300\nX2\nZ14 F5000\nX40\nG90\n"
    "Z-1 F300\nX70\nM2\n",
    "words": "G0 X0 Y0 Z15\nN10 G1 X20 F5000 (over) M8\nN20 Y30 S500\nN30 F200 X21 Z2\nX25\nM2\n",
    "inch": "G20\nG0 X0 Y0 Z1\nG1 X2 F200\nZ.7\nZ-.1 F10\nX2.5\nM2\n",
}
SAID = {"inch": RapidFeed(200.0, 0.2)}


def calls(path):
    """What the interpreter does in each line, with the F of each feed move."""
    run = run_oracle(path, "--tool-table", TABLE)
    assert run.returncode == 0, run.stderr
    feed, out = None, {}
    for words in (line.split() for line in run.stdout.splitlines()):
        number, what = int(words[0]), words[1]
        if what == "FEEDRATE":
            feed = float(words[2])
            continue
        if what == "FEED" and out.get("at") == words[2:]:
            continue  # a motion of no length
        if what in ("TRAVERSE", "FEED"):
            out["at"] = words[2:]
        moves = what in ("TRAVERSE", "FEED")
        values = [round(float(w), 6) if moves else w for w in words[2:]]
        out.setdefault(number, []).append((what, tuple(values), feed if what == "FEED" else None))
    return out


@pytest.mark.parametrize("name", PROGRAMS)
def test_lines_that_were_kept_do_what_they_did(tmp_path, name):
    program = (HEAD + PROGRAMS[name]).encode()
    machine = Machine.load(find_machine("vmc"))
    machine = replace(machine, rapid_feed=SAID.get(name, RapidFeed(5000.0, 5.0)))
    result = process(program, machine)
    assert sum(rapid.rewritten for rapid in result.rapids) >= 2
    for stem, data in (("before", program), ("after", result.output)):
        (tmp_path / f"{stem}.ngc").write_bytes(data)
    before, after = (calls(tmp_path / f"{stem}.ngc") for stem in ("before", "after"))
    lines = program.splitlines(), result.output.splitlines()
    kept = difflib.SequenceMatcher(None, *lines, autojunk=False).get_matching_blocks()
    compared = 0
    for one, other, size in kept:
        for k in range(size):
            assert before.get(one + k + 1, []) == after.get(other + k + 1, []), lines[0][one + k]
            compared += 1
    assert compared >= len(lines[0]) - sum(rapid.rewritten for rapid in result.rapids)
