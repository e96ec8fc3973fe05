"""Options that `process` was given and that `verify` is not: the stamp tells them."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import verify

ROOT = Path(__file__).parents[2]
VMC = Machine.load(find_machine("vmc"))
PLATE = (ROOT / "samples/plate.ngc").read_bytes()
OPTIONS = [
    ["--profile", "shortest"],
    ["--profile", "conventional"],
    ["--profile", "cascade", "--no-comments"],
    ["--expand-cycles"],
    ["--expand-cycles", "--profile", "shortest", "--no-comments"],
    ["--unroll"],
    ["--unroll", "--expand-cycles", "--no-comments"],
    ["--controller", "mach"],
    ["--controller", "grbl", "--no-comments", "--profile", "condition2"],
    ["--dialect", "linuxcnc", "--profile", "shortest"],
]


@pytest.fixture
def run(command, tmp_path):
    shutil.copy(ROOT / "samples/plate.ngc", tmp_path)
    return command


@pytest.mark.parametrize("options", OPTIONS, ids=" ".join)
def test_options_need_not_be_repeated(run, options):
    assert run("process", "plate.ngc", "-m", "vmc", *options)[0] == 0
    code, out = run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc")
    assert code == 0, out
    assert "nothing else changed" in out


def test_a_dialect_that_was_given_is_taken_from_the_stamp(run, tmp_path):
    text = "G21 G90 G94 G64 F500\nG0 X0 Y0 Z0\nG0 X20\nM2\n"
    (tmp_path / "a.nc").write_text(text)
    assert run("process", "a.nc", "-m", "vmc", "--dialect", "mach")[0] == 0
    code, out = run("verify", "a.nc", "a.jerk.nc", "-m", "vmc")
    assert (code, "1 of its 2" in out) == (0, True)


def test_a_stamp_of_another_machine_file_is_said_to_be_one(run):
    assert run("process", "plate.ngc", "-m", "vmc")[0] == 0
    code, out = run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "router")
    assert code == 1
    assert "another machine file" in out


def test_a_damaged_file_is_refused_under_the_stamps_options_too(run, tmp_path):
    assert run("process", "plate.ngc", "-m", "vmc", "--profile", "shortest")[0] == 0
    path = tmp_path / "plate.jerk.ngc"
    path.write_bytes(path.read_bytes().replace(b"G1 X", b"G1 Y", 1))
    assert run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc")[0] == 1


def test_the_profile_is_taken_from_the_stamp_in_python_as_well():
    made = process(PLATE, VMC, profile="shortest")
    assert verify(PLATE, made.output, VMC).ok


def test_the_name_in_a_stamp_is_nothing_but_text_to_any_control():
    """grbl holds the feed at ``!``, Fanuc ends a program at ``%``, in comments too."""
    named = replace(VMC, name="Öl! #2 %~?;(A)")
    made = process(PLATE, named).output
    (stamp,) = [line for line in made.decode("ascii").splitlines() if "stamp" in line]
    assert stamp.endswith(" -l- #2 -----A-)")
    assert verify(PLATE, made, named).ok
