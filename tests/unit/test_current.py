"""Outputs that need not be made again, and all that makes them doubtful."""

import os

import pytest

from gcodejerk.machine import find_machine

PROGRAM = b"G21 G90 G94\nG0 X0 Y0 Z0\nG0 X20\nG1 X30 F500\nM2\n"
ARGUMENTS = ["process", "a.ngc", "-m", "m.yaml", "--if-changed"]


@pytest.fixture
def made(command, tmp_path):
    """A program with its output, an hour younger, and a machine file."""
    text = find_machine("vmc").read_text(encoding="utf-8")
    (tmp_path / "m.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "a.ngc").write_bytes(PROGRAM)
    os.utime(tmp_path / "a.ngc", (1e9, 1e9))
    assert command(*ARGUMENTS)[0] == 0
    return tmp_path / "a.jerk.ngc"


def test_what_is_current_is_left_as_it_is(command, made):
    before = made.stat()
    code, out = command(*ARGUMENTS)
    assert (code, "a.jerk.ngc is up to date" in out) == (0, True)
    assert made.stat().st_mtime_ns == before.st_mtime_ns
    assert made.stat().st_ino == before.st_ino


@pytest.mark.parametrize(
    "more",
    [["--profile", "optimal"], ["--expand-cycles"], ["--unroll"], ["--dialect", "mach"],
     ["--no-comments"],
     ["--controller", "fanuc"], ["--no-verify"], ["--report", "r.json"],
     ["--rapid-feed", "5000", "--rapid-clearance", "2"]],
    ids=lambda more: more[0],
)  # fmt: skip
def test_other_options_make_it_again(command, made, more):
    code, out = command(*ARGUMENTS, *more)
    assert (code, "is up to date" in out) == (0, False)


def test_a_younger_program_makes_it_again(command, made, tmp_path):
    os.utime(tmp_path / "a.ngc")
    os.utime(made, (1e9 + 1, 1e9 + 1))
    assert "is up to date" not in command(*ARGUMENTS)[1]


def test_another_machine_file_makes_it_again_and_another_date_does_not(command, made, tmp_path):
    machine = tmp_path / "m.yaml"
    os.utime(machine)
    assert "is up to date" in command(*ARGUMENTS)[1]
    machine.write_text(machine.read_text().replace("frequency: 30 ", "frequency: 31 "))
    assert "is up to date" not in command(*ARGUMENTS)[1]


def test_an_edited_output_is_made_again(command, made):
    good = made.read_bytes()
    made.write_bytes(good.replace(b"G1 X30", b"G1 X31"))
    assert "is up to date" not in command(*ARGUMENTS)[1]
    assert made.read_bytes() == good


def test_another_version_makes_it_again(command, made, monkeypatch):
    from gcodejerk.batch import current

    monkeypatch.setattr(current, "__version__", "9.9.9")
    assert "is up to date" not in command(*ARGUMENTS)[1]


def test_it_needs_an_output(command, made):
    assert command(*ARGUMENTS, "-o", "-")[0] == 2
    assert command(*ARGUMENTS, "--in-place")[0] == 2
