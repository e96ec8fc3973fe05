"""Files of rows and points for every motion controller, compared as bytes.

One program and one machine for all; what each controller has to be told is in `OPTIONS`.
`pytest --update-golden` writes them anew.
"""

import io
import re
from pathlib import Path

import pytest
import yaml

from gcodejerk import Machine, process, verify
from gcodejerk.verification.rows.files import stated_profile
from tests.unit.test_alike import hold_golden, same_arithmetic

HERE = Path(__file__).parent / "rows"
COUNTS = {"X": 10000, "Y": 10000, "A": 4000}
NUMBERS = {"X": "1", "Y": "2", "A": "3"}
OPTIONS = {
    "csv": {},
    "json": {},
    "pmac": {},
    "pmac-confirmed": {"confirmed": ["pmac-colon"], "isx90": 1000},
    "galil": {"counts_per_unit": COUNTS, "axis_names": {"X": "A", "Y": "B", "A": "C"}},
    "elmo": {"counts_per_unit": COUNTS},
    "acs": {"axis_names": {"X": "0", "Y": "1", "A": "4"}},
    "ros2": {"axis_names": {"X": "gantry_x", "Y": "gantry_y", "A": "table"}},
    "csp": {"counts_per_unit": COUNTS},
    "fanuc15": {
        "counts_per_unit": {"X": 1000, "Y": 1000, "A": 1000},
        "axis_names": NUMBERS,
        "fanuc_distance": "general",
    },
}
"""Name of the file -> controller_options of its machine; in front of a dash, the controller."""
BINARY = {"fanuc15"}
"""Where bytes are all that can be compared: only on the arithmetic that the file was made with."""


def made(name):
    """The machine and the result for one file."""
    values = yaml.safe_load((HERE / "machine.yaml").read_text())
    controller = name.partition("-")[0]
    options = {"controller_options": OPTIONS[name]} if OPTIONS[name] else {}
    machine = Machine.from_dict(values | {"controller": controller} | options)
    form = "pvt" if controller == "csv" else "stream"
    program = (HERE / "program.ngc").read_bytes()
    return machine, program, process(program, machine, form=form, name="program.ngc")


@pytest.mark.parametrize("name", OPTIONS)
def test_output_is_the_golden_one(name, request):
    machine, program, result = made(name)
    if name not in BINARY or same_arithmetic():
        hold_golden(result.output, HERE / f"out.{name}", request)
    assert result.verification.ok
    assert verify(program, result.output, machine).rewritten == result.planned >= 4


@pytest.mark.parametrize("name", sorted(set(OPTIONS) - {"csv"}))
def test_every_file_of_rows_says_its_profile(name):
    values = yaml.safe_load((HERE / "machine.yaml").read_text())
    written = (HERE / f"out.{name}").read_bytes()
    assert stated_profile(io.BytesIO(written)) == Machine.from_dict(values).design.profile
    other = re.sub(rb"condition3", b"cascade", written, flags=re.IGNORECASE)
    assert stated_profile(io.BytesIO(other)) == "cascade"
    assert stated_profile(io.BytesIO(other.replace(b"cascade", b"sinus"))) is None


@pytest.mark.parametrize("name", sorted(set(OPTIONS) - {"csv", "json"}))
def test_heads_and_titles_are_short(name):
    _, _, result = made(name)
    marks = (b"//", b"REM", b"#", b"!", b"(")
    lines = [x for x in result.output.split(b"\n") if x.startswith(marks) and b"PVT" not in x]
    assert max(map(len, lines)) < 70
    assert all(line.isascii() for line in lines)
