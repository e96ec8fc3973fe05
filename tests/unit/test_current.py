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


@pytest.mark.parametrize("more", [[], ["--unroll"], ["--report", "r.json"]])
def test_a_program_that_came_with_its_old_date_is_made_again(command, made, tmp_path, more):
    # mv, cp -p, rsync -t and archives keep the date: a shop would have run last week's part.
    command(*ARGUMENTS, *more)
    other = tmp_path / "other.ngc"
    other.write_bytes(PROGRAM.replace(b"X20", b"X25"))
    os.utime(other, (9e8, 9e8))
    other.replace(tmp_path / "a.ngc")
    assert "is up to date" not in command(*ARGUMENTS, *more)[1]
    assert b"(gcodejerk: G0 X25)" in made.read_bytes()
    assert "is up to date" in command(*ARGUMENTS, *more)[1]


def test_the_same_program_with_another_date_is_current(command, made, tmp_path):
    (tmp_path / "copy.ngc").write_bytes(PROGRAM)
    os.utime(tmp_path / "copy.ngc", (9e8, 9e8))
    (tmp_path / "copy.ngc").replace(tmp_path / "a.ngc")
    assert "is up to date" in command(*ARGUMENTS)[1]


def test_how_strict_a_run_was_no_output_says(command, made, tmp_path):
    (tmp_path / "a.ngc").write_bytes(PROGRAM.replace(b"G0 X20", b"G0 X[#1]"))
    assert command(*ARGUMENTS)[0] == 0
    assert command(*ARGUMENTS, "--strict")[0] == 1


def test_a_report_does_not_replace_the_output(command, made, tmp_path):
    for name in ("x.json", "./x.json", str(tmp_path / "x.json")):
        code, out = command(*ARGUMENTS[:-1], "-o", "x.json", "--report", name)
        assert (code, "would hold the output and the report" in out) == (1, True), out
    assert not (tmp_path / "x.json").exists()
