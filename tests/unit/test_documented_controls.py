"""Tables of controls in the documentation: each row follows from the code, and nothing is missing.

What docs/settings.md shows is what `tests/bench/bench_controls.py` prints, row by row; the README
shows a part of it. Lists of controllers and dialects are those of the registries.
"""

import importlib.util
import re
from functools import cache

import pytest

from gcodejerk.emit import controllers, load_controller
from gcodejerk.emit.sheets import Sheets
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import DIALECTS
from tests.unit.test_alike import hold
from tests.unit.test_documentation import PAGES, README, ROOT

SPEC = importlib.util.spec_from_file_location(
    "bench_controls", ROOT / "tests" / "bench" / "bench_controls.py"
)
BENCH = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(BENCH)

CALLED = {
    "acs": "ACS", "csv": "CSV", "elmo": "Elmo", "fanuc": "Fanuc", "galil": "Galil", "grbl": "grbl",
    "haas": "Haas", "json": "JSON", "klipper": "Klipper", "linuxcnc": "LinuxCNC", "mach": "Mach",
    "marlin": "Marlin", "pmac": "PMAC", "ros2": "ROS 2", "siemens": "Siemens",
}  # fmt: skip
"""Controllers, as the README's sentence calls them; `linuxcnc-hal` is LinuxCNC's, with HAL."""
WAYS = {
    "best acceleration": "acceleration",
    "best 1620 and 1621": "constant-acceleration",
    "best acceleration and jerk": "jerk",
    "best shaper": "shaper",
    "FT motion": "ft",
}
"""How the README calls a control's settings, and what they are called in the other table."""


def rows_below(page, head):
    """The rows of the table with this head, as lists of cells."""
    lines = page.split(head + "\n", 1)[1].splitlines()[1:]
    count = next(k for k, line in enumerate([*lines, ""]) if not line.startswith("|"))
    return cells(lines[:count])


def cells(lines):
    """The cells of each row."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def text_of(rows):
    """Rows to compare."""
    return "\n".join(" | ".join(row) for row in rows).encode()


def names_in(cell):
    """What stands in a cell between backquotes."""
    return re.findall(r"`([^`]+)`", cell)


def forms_of(control):
    """The names of a controller's forms."""
    return {form.name for form in load_controller(control).forms}


SETTINGS = rows_below(PAGES["settings.md"], BENCH.HEAD[0])
TUNED = [name for name in sorted(controllers()) if isinstance(load_controller(name), Sheets)]


@cache
def bench():
    """The machine and the rapids of the table."""
    machine = Machine.load(find_machine("vmc"))
    return BENCH.moves_of(ROOT / "samples" / "plate.ngc", machine, "linuxcnc"), machine


def test_every_control_with_settings_is_in_the_table_and_no_other():
    named = [names_in(row[0])[0] for row in SETTINGS if row[0].startswith("`")]
    assert sorted(set(named)) == TUNED
    assert named == sorted(named)
    assert {name for name in controllers() if "parameters" in forms_of(name)} == set(TUNED)


@pytest.mark.parametrize("control", TUNED)
def test_a_row_of_the_table_is_what_its_control_does(control):
    shown = [row for row in SETTINGS if f"`{control}`" in row[0]]
    hold(text_of(cells(BENCH.control_rows(control, *bench()))), text_of(shown))


def test_the_rows_below_the_controls_are_what_streams_do():
    shown = [row for row in SETTINGS if row[0].startswith("**")]
    hold(text_of(cells(BENCH.last_rows(*bench()))), text_of(shown))


def test_the_table_of_the_readme_is_a_part_of_that_of_the_settings():
    best = {row[0]: (row[4], row[5]) for row in SETTINGS}
    today = {row[0]: (row[2], row[3]) for row in SETTINGS}["**today**"]
    profile = "**stream**, {}"
    for what, times, left in rows_below(README, "| on `vmc` | all rapids [s] | residual [um] |"):
        if what == "as the machine file has it today":
            expected = [today]
        elif what.startswith("streams: "):
            # One total stands for both profiles.
            expected = [best[profile.format(name)] for name in names_in(what)]
            assert len({total for total, _ in expected}) == 1
            assert times == expected[0][0]
            times = ", ".join(total for total, _ in expected)
        else:
            way = WAYS[what.rsplit("`", 1)[1].strip(", ")]
            expected = [best[f"`{name}` ({way})"] for name in names_in(what)]
        assert [times, left] == [", ".join(part) for part in zip(*expected, strict=True)], what


def test_the_readme_says_who_gets_streams_and_who_rows():
    said = re.search(
        r"Streams are written for (.*?);\s*rows of .*? for motion\s+controllers \((.*?)\)",
        README, flags=re.DOTALL,
    )  # fmt: skip
    streams, rows = (" ".join(part.split()) for part in said.groups())
    streams = re.sub(r" ?\([^)]*\)", "", streams).replace("and, unmeasured, for ", "")
    streams = [name for name in re.split(r", | and ", streams) if name]
    written = {name for name in controllers() if "stream" in forms_of(name)}
    in_place = {name for name in written if load_controller(name).in_place}
    assert sorted(streams) == sorted(CALLED[name] for name in in_place)
    with_rows = [name for name in controllers() if "pvt" in forms_of(name)]
    assert sorted(rows.split(", ")) == sorted(CALLED[name] for name in with_rows)


def test_what_f_means_is_said_of_every_controller_that_writes_motion():
    table = rows_below(
        PAGES["control.md"],
        "| controller | F of a block | residual in reports, and what has to be better than today's "
        "rapid |",
    )
    points, rows = set(), set()
    for row in table:
        names = set(names_in(row[0])) - {"--as pvt"}
        (rows if "`--as pvt`" in row[0] else points).update(names)
    moving = {name for name in controllers() if forms_of(name) - {"parameters", "pvt"}}
    assert points == moving
    assert rows == {name for name in controllers() if "pvt" in forms_of(name)}


def test_every_controller_with_a_file_of_points_is_in_its_table():
    head = next(line for line in PAGES["points.md"].splitlines() if line.startswith("| controller"))
    listed = [names_in(row[0])[0] for row in rows_below(PAGES["points.md"], head)]
    assert sorted(listed) == sorted(n for n in controllers() if not load_controller(n).in_place)


def test_controls_that_programs_can_set_are_listed():
    listed = [names_in(row[0])[0] for row in rows_below(
        PAGES["parameters.md"], "| controller | lines | act on | old numbers |"
    )]  # fmt: skip
    sets = [name for name in TUNED if load_controller(name).program_way]
    assert sorted(listed) == sets
    said = re.search(r"`process --as parameters` \((.*?)\)", PAGES["settings.md"], re.DOTALL)
    assert sorted(names_in(said[1])) == sets


def test_every_dialect_is_in_the_table_and_no_other():
    rows = rows_below(PAGES["dialects.md"], "| dialect | for | what is special |")
    listed = [name for row in rows for name in names_in(row[0])]
    assert sorted(listed) == sorted(DIALECTS)
