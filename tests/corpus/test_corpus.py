"""Every real program at hand: processed in its dialect, verified, and what became of it in a table.

`table.md` beside this file is that table; `pytest --update-golden` writes it anew, and its
difference is reviewed like code. The programs are those of ../shared, which are not ours to copy.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from gcodejerk import Machine, process, verify
from gcodejerk.reasons import CERTAIN, REASONS

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
TABLE = Path(__file__).with_name("table.md")
POSTS = {
    **{name: name for name in ("linuxcnc", "fanuc", "grbl", "marlin")},
    **{"mach3_mach4": "mach", "uccnc": "uccnc", "centroid": "centroid"},
}
"""Post-processor of FreeCAD -> dialect."""
CORPUS = {
    "easy_gcode_plot__TEST_TURN.NC": "fanuc-lathe-a",
    "easy_gcode_plot__": "fanuc",
    "gEdit__f": "fanuc",
    "gEdit__l01": "fanuc-lathe-a",
    "gEdit__s04": "siemens",
    "gEdit__h01": "klartext",
    "gcode-rs__mach3": "mach",
    "gcode-rs__reprap": "marlin",
    "cncjs__": "grbl",
}
"""Beginning of a file's name -> dialect; the first that fits."""
SPINDLE = {"cncjs__jsdc-laser.gcode": "laser", "gcode-rs__mach3_plasma.gcode": "plasma"}
"""What M3 starts, where it is no spindle."""
CONTROLLER = {
    **{"heidenhain-iso": "csv", "klartext": "csv", "uccnc": "mach", "centroid": "mach"},
}
"""Dialect -> what writes its streams, where no controller has its name."""
STARTUP = {
    "fanuc": "G90 G17 G21 G94",
    "fanuc-lathe-a": "G99 G21",
    "siemens": "G90 G71",
    "heidenhain-iso": "",
    "klartext": "",
    "marlin": "",
}
"""Codes in force when a program starts, as the machine of such a shop would be set up."""
MACHINE = """
interval: 0.001
positioning: linear
axes:
  X:
    diameter: {diameter}
    rapid: {{velocity: 500, acceleration: 3000, jerk: 100000}}
    modes: [{{name: bed, frequency: 30, damping: 0.02, participation: 1.0}}]
  Y:
    rapid: {{velocity: 500, acceleration: 3000, jerk: 100000}}
    modes: [{{name: column, frequency: 40, damping: 0.02, participation: 1.0}}]
  Z:
    rapid: {{velocity: 400, acceleration: 3000, jerk: 100000}}
    modes: [{{name: head, frequency: 45, damping: 0.03, participation: 1.0}}]
  B: {{rapid: {{velocity: 90, acceleration: 300, jerk: 10000}}}}
{spindle}
program: {{decimal_point: calculator, startup: "{startup}"}}
"""


def programs():
    """Files of ../shared and their dialects."""
    found = []
    for folder in (SHARED / "corpus", SHARED / "hosts" / "nc"):
        for path in sorted(folder.glob("*")) if folder.exists() else []:
            if path.suffix == ".md":
                continue
            if folder.name == "nc":
                dialect = POSTS[path.stem.split("__")[1]]
            else:
                dialect = next(d for start, d in CORPUS.items() if path.name.startswith(start))
            found.append((path, dialect))
    return found


def machine_for(dialect, name):
    """A machine of the kind that reads a dialect, as the shop would describe it."""
    turns = "lathe" in dialect or dialect == "siemens"
    startup = STARTUP.get(dialect, "G90 G17 G21")
    burns = dialect in ("grbl", "mach", "marlin", "uccnc", "centroid")
    spindle = f"spindle: {SPINDLE.get(name, 'mill')}" if burns else ""
    described = Machine.loads(
        MACHINE.format(diameter=str(turns).lower(), startup=startup, spindle=spindle)
    )
    controller = CONTROLLER.get(dialect, dialect.split("-")[0])
    return replace(described, controller=controller, dialect=dialect)


def row_of(path, dialect):
    """Process, verify what came out by the files alone, and sum up."""
    machine, data = machine_for(dialect, path.name), path.read_bytes()
    # A table is verified by what has written it, all else here, from the two files.
    table = machine.controller == "csv"
    result = process(data, machine, name=path.name, verify=table)
    if not table:
        proof = verify(data, result.output, machine)
        assert proof.ok, (path.name, proof.violations[:3])
        assert proof.rewritten == result.planned
        assert result.planned or result.output == data
    reasons = result.plans.reason
    left = Counter(str(REASONS[r]) for r in reasons if r != CERTAIN)
    why = ", ".join(f"{reason} {count}" for reason, count in sorted(left.items()))
    return f"| {path.name} | {dialect} | {len(reasons)} | {result.planned} | {why} |"


HEAD = ["| file | dialect | rapids | rewritten | left alone |", "|---|---|---|---|---|"]
PARTS = 3
"""Of the programs, for as many cores."""
ABSENT = pytest.mark.skipif(
    not programs(), reason="../shared is not here: no real programs to read"
)


@ABSENT
@pytest.mark.parametrize("part", range(PARTS))
def test_every_real_program_is_processed_and_verified(part, request):
    if request.config.getoption("--update-golden"):
        pytest.skip("the table is being written")
    rows = [row_of(path, dialect) for path, dialect in programs()[part::PARTS]]
    assert rows == TABLE.read_text().splitlines()[len(HEAD) + part :: PARTS]


@ABSENT
def test_the_table_has_a_row_for_every_program(request):
    if request.config.getoption("--update-golden"):
        rows = [row_of(path, dialect) for path, dialect in programs()]
        TABLE.write_text("\n".join([*HEAD, *rows, ""]))
    head, rows = TABLE.read_text().splitlines()[:2], TABLE.read_text().splitlines()[2:]
    assert head == HEAD
    assert [row.split(" | ")[0] for row in rows] == [f"| {path.name}" for path, _ in programs()]
