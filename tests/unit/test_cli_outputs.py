"""What `process` never overwrites, and what it never keeps to itself."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SAMPLES = Path(__file__).parents[2] / "samples"


@pytest.fixture
def folder(tmp_path):
    shutil.copy(SAMPLES / "plate.ngc", tmp_path)
    return tmp_path


@pytest.fixture
def run(command, folder):
    return command


def test_quiet_keeps_the_notes(run, folder):
    loud = run("process", "plate.ngc", "-m", "vmc", "--controller", "grbl", "--dialect", "linuxcnc")
    notes = [line for line in loud[1].splitlines() if ": note: " in line]
    assert notes
    (folder / "plate.jerk.ngc").unlink()
    code, out = run(
        "process", "-q", "plate.ngc", "-m", "vmc", "--controller", "grbl", "--dialect", "linuxcnc"
    )
    assert (code, out.splitlines()) == (0, notes)


def test_a_foreign_output_is_refused_unless_forced(run, folder):
    mine = folder / "plate.jerk.ngc"
    mine.write_text("G0 X1 (by hand)\n")
    code, out = run("process", "plate.ngc", "-m", "vmc")
    assert code == 1
    assert "was not written by gcodejerk" in out
    assert mine.read_text() == "G0 X1 (by hand)\n"
    assert [p.name for p in folder.iterdir() if p.name.startswith(".~")] == []
    assert run("process", "plate.ngc", "-m", "vmc", "--force")[0] == 0
    assert b"gcodejerk stamp" in mine.read_bytes()
    assert run("process", "plate.ngc", "-m", "vmc")[0] == 0, "our own output may be replaced"


def test_an_output_that_loses_nothing_may_be_replaced(run, folder):
    (folder / "out.ngc").write_bytes((folder / "plate.ngc").read_bytes())
    assert run("process", "plate.ngc", "-m", "vmc", "-o", "out.ngc")[0] == 0
    (folder / "none.nc").write_text("G21 G1 X1 F1\nM2\n")
    for _ in range(2):
        assert run("process", "none.nc", "-m", "vmc", "-o", "none.jerk.nc")[0] == 0


def test_a_table_of_ours_may_be_replaced_and_another_one_not(run, folder):
    arguments = ("process", "plate.ngc", "-m", "vmc", "--controller", "csv")
    assert run(*arguments)[0] == run(*arguments)[0] == 0
    (folder / "plate.jerk.csv").write_text("name,price\n")
    assert run(*arguments)[0] == 1


def test_a_foreign_report_is_refused_and_ours_is_replaced(run, folder):
    arguments = ("process", "plate.ngc", "-m", "vmc", "--report", "r.json")
    assert run(*arguments)[0] == run(*arguments)[0] == 0
    (folder / "r.json").write_text('{"mine": 1}')
    assert run(*arguments)[0] == 1
    assert (folder / "r.json").read_text() == '{"mine": 1}'


@pytest.mark.parametrize("force", [[], ["--force"]])
def test_the_machine_file_is_never_an_output(run, folder, force):
    from gcodejerk.machine import find_machine

    text = Path(find_machine("vmc")).read_bytes()
    (folder / "mill.yaml").write_bytes(text)
    (folder / "m.yaml").symlink_to(folder / "mill.yaml")
    for name in ("mill.yaml", "./mill.yaml", "m.yaml"):
        code, out = run("process", "plate.ngc", "-m", "mill.yaml", "-o", name, *force)
        assert (code, "is the machine file" in out) == (1, True)
    code, out = run("process", "plate.ngc", "-m", "vmc", "-o", "plate.ngc", *force)
    assert (code, "is the input itself" in out) == (1, True)
    assert (folder / "mill.yaml").read_bytes() == text


def test_a_report_on_standard_output_is_the_one_of_a_file_and_has_it_to_itself(folder):
    command = [sys.executable, "-m", "gcodejerk.cli", "process", "plate.ngc", "-m", "vmc"]
    said = subprocess.run([*command, "--report", "-"], cwd=folder, capture_output=True, check=True)
    subprocess.run([*command, "--report", "r.json"], cwd=folder, capture_output=True, check=True)
    assert json.loads(said.stdout) == json.loads((folder / "r.json").read_bytes())
    assert b"plate.ngc: " in said.stderr


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (("-o", "-"), "standard output holds one"),
        (("--diff",), "--report - has standard output to itself"),
        (("--json",), "--report - has standard output to itself"),
        (("--if-changed",), "name a report"),
        (("other.ngc",), "--report FILE take one program"),
    ],
)
def test_what_else_goes_to_standard_output_is_refused_beside_a_report(run, folder, more, message):
    shutil.copy(folder / "plate.ngc", folder / "other.ngc")
    code, said = run("process", "plate.ngc", *more, "-m", "vmc", "--report", "-")
    assert code == 2
    assert message in " ".join(said.replace("│", " ").split())
    assert sorted(p.name for p in folder.iterdir()) == ["other.ngc", "plate.ngc"]
