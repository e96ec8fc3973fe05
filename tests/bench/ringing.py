"""The sample record samples/ringing.csv, and the program that it is of.

`python tests/bench/ringing.py`: the machine vmc33 runs `machine test-program`, and a cheap sensor
feels it, 25 mm/s^2 of noise, 800 times a second.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "unit"))


def main() -> None:
    """Write both files."""
    from recording import record_of

    from gcodejerk.identification import commanded_rapids, excitation, rapids_program
    from gcodejerk.machine import Machine, find_machine

    machine = Machine.load(find_machine("vmc33"))
    text = rapids_program(machine, [excitation(machine, "Z", 50.0, 2)], 2, 1.0)
    lengths = [one.length for one in commanded_rapids(text.encode(), machine)]
    t, y = record_of(machine, "Z", lengths, rate=800.0)
    rows = [f"{time:.5f},{value / 1000.0:.3f}\n" for time, value in zip(t, y, strict=True)]
    (ROOT / "samples" / "ringing.ngc").write_text(text)
    (ROOT / "samples" / "ringing.csv").write_text("time [s],az [m/s^2]\n" + "".join(rows))


if __name__ == "__main__":
    main()
