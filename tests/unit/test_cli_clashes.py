"""No command writes over what it reads, under whatever name; nor two results to one place."""

import shutil
from pathlib import Path

import pytest

from gcodejerk.machine import find_machine

SAMPLES = Path(__file__).parents[2] / "samples"
READ = {
    "a machine file, by a plan": "plan -m m.yaml Z=1 --json {m.yaml}",
    "by its table": "plan -m m.yaml Z=1 --csv {m.yaml}",
    "by a comparison": "compare -m m.yaml Z=1 --json {m.yaml}",
    "by a map": "map -m m.csv --axis Z --length 1 -o {m.csv}",
    "by a simulation": "simulate -m m.yaml Z=1 --json {m.yaml}",
    "by a test program": "machine test-program -m m.yaml -o {m.yaml}",
    "by parameters": "parameters -m m.yaml plate.ngc --no-curve -o {m.yaml}",
    "a program, by parameters": "parameters -m m.yaml plate.ngc --no-curve -o {plate.ngc}",
    "by their record": "parameters -m m.yaml plate.ngc --no-curve --json {plate.ngc}",
    "a program, by a simulation": "simulate -m m.yaml plate.ngc --csv {plate.ngc}",
    "a record": "identify ringing.csv --axis Z -o {ringing.csv}",
    "a record, by figures": "identify ringing.csv --axis Z --json {ringing.csv}",
    "a configuration": "machine new printer.cfg --force -o {printer.cfg}",
    "a program": "process plate.ngc -m m.yaml --force -o {plate.ngc}",
}
"""Commands, and the file that each would lose."""
TWICE = (
    "plan -m m.yaml Z=1 --csv {} --json {}",
    "compare -m m.yaml Z=1 --json {} --plot {}",
    "simulate -m m.yaml Z=1 --csv {} --json {}",
    "identify ringing.csv --axis Z -o {} --json {}",
    "process plate.ngc -m m.yaml -o {} --report {}",
)


@pytest.fixture
def files(tmp_path):
    for name in ("plate.ngc", "ringing.csv"):
        shutil.copy(SAMPLES / name, tmp_path)
    for name in ("m.yaml", "m.csv"):
        shutil.copy(find_machine("vmc"), tmp_path / name)
    (tmp_path / "printer.cfg").write_text(
        "[printer]\nkinematics: cartesian\nmax_velocity: 300\nmax_accel: 3000\n"
    )
    return tmp_path


@pytest.mark.parametrize("name", READ)
def test_what_is_read_is_not_written(command, files, name):
    text = READ[name]
    lost = text[text.index("{") + 1 : text.index("}")]
    before = (files / lost).read_bytes()
    (files / "link").symlink_to(files / lost)
    (files / "hard").hardlink_to(files / lost)
    for other in (lost, f"./{lost}", str(files / lost), "link", "hard"):
        if other in ("link", "hard") and "map" in text:
            continue  # a map is known by the end of its name
        code, out = command(*text.replace("{" + lost + "}", other).split())
        assert code == 1, out
        assert "choose another name" in out
        assert (files / lost).read_bytes() == before


def test_results_that_nobody_wants_may_go_to_one_place(command, files):
    text = "plan -m m.yaml Z=1 --csv /dev/null --json /dev/null"
    code, out = command(*text.split())
    assert code == 0, out


@pytest.mark.parametrize("text", TWICE)
def test_one_file_does_not_hold_two_results(command, files, text):
    suffix = ".svg" if "--plot" in text else ".json"
    for names in ((f"x{suffix}", f"x{suffix}"), (f"x{suffix}", f"./x{suffix}")):
        code, out = command(*text.format(*names).split())
        assert code in (1, 2), out
        assert not (files / f"x{suffix}").exists()
