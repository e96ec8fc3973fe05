"""`gcodejerk parameters`: what it prints, writes and refuses."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gcodejerk.cli import app
from gcodejerk.errors import GcodejerkError
from gcodejerk.machine import Machine, find_machine

SAMPLES = Path(__file__).parents[2] / "samples"
PLATE = str(SAMPLES / "plate.ngc")


def run(*arguments):
    return CliRunner().invoke(app, ["parameters", *map(str, arguments)])


def refused(*arguments):
    """The message of a run that is refused."""
    done = run(*arguments)
    assert done.exit_code == 1
    assert isinstance(done.exception, GcodejerkError)
    return str(done.exception)


def test_figure(tmp_path):
    pytest.importorskip("matplotlib")
    figure = tmp_path / "f.png"
    done = run("--lengths", "5:50", "-m", "paper", "--controller", "grblhal", "--plot", figure)
    assert done.exit_code == 0, done.output
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_sheet_and_json(tmp_path):
    sheet, record = tmp_path / "s.txt", tmp_path / "r.json"
    done = run(PLATE, "-m", "vmc", "--controller", "grbl", "-o", sheet, "--json", record)
    assert done.exit_code == 0, done.output
    found = json.loads(record.read_text())
    assert found["controller"] == "grbl"
    assert found["rapids"] == {"distinct": 10, "all": 19}
    assert found["gains"] is True
    assert found["chosen"]["time"] <= found["today"]["time"]
    assert found["chosen"]["residual"] < 0.5 * found["today"]["residual"]
    text = sheet.read_text()
    for setting in found["settings"]:
        assert f"{setting['number']}={setting['new']}" in text
    times = [point["time"] for point in found["curve"]]
    left = [point["residual"] for point in found["curve"]]
    assert times == sorted(times)
    assert left == sorted(left, reverse=True)
    assert len(found["robustness"]["chosen"]) == len(found["robustness"]["frequency_error"])


def test_without_programs_it_is_tuned_up_to_the_longest_travel(tmp_path):
    given, own = tmp_path / "given.json", tmp_path / "own.json"
    asked = ("-m", "vmc33", "--controller", "grbl", "--no-curve", "--json")
    assert run(*asked, own).exit_code == 0
    travels = [axis.travel for axis in Machine.load(find_machine("vmc33")).axes if axis.travel]
    longest = max(high - low for low, high in travels)
    assert longest > 1.0
    assert run("--lengths", f"1:{longest}", *asked, given).exit_code == 0
    assert own.read_bytes() == given.read_bytes()
    done = run(PLATE, "--lengths", "1:5", *asked, "-")
    assert done.exit_code == 2
    assert "leave --lengths out" in done.output


def test_standard_output_takes_the_sheet_alone():
    done = run("--lengths", "5:50", "-m", "paper", "--controller", "grbl", "-o", "-")
    assert done.exit_code == 0
    assert done.stdout.startswith("; gcodejerk")
    assert "\n$122=" in done.stdout


def test_lengths_and_more_time(tmp_path):
    done = run("--lengths", "5:50", "-m", "paper", "--controller", "siemens", "--time", "1.2")
    assert done.exit_code == 0
    assert "MD32435 Z" in done.stdout
    assert "-o NAME.siemens-setup.txt" in done.stdout


def test_numbers_of_the_users_are_tried():
    done = run("--lengths", "5:50", "-m", "paper", "--controller", "fanuc", "--try", "1620 Z=160",
               "--try", "1621 Z=33")  # fmt: skip
    assert done.exit_code == 0
    assert "fanuc, 1620 Z = 160, 1621 Z = 33" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            (PLATE, "-m", "vmc", "--controller", "fanuc", "--try", "1620 X=160.5"),
            "1620 X = 160.5 cannot be set: 1 to 4000 ms in steps of 1",
        ),
        (
            (PLATE, "-m", "vmc", "--controller", "fanuc", "--try", "1620 X=9000"),
            "the nearest is 4000",
        ),
        ((PLATE, "-m", "vmc", "--controller", "haas"), "nothing is known that could be set"),
        ((PLATE, "-m", "vmc", "--controller", "twincat"), "axes.X.rapid.jerk"),
        ((PLATE, "-m", "vmc", "--controller", "fanuc", "--settings", "x"), "it has: constant-acc"),
        (("absent.nc", "-m", "vmc"), "absent.nc"),
    ],
)
def test_refusals_name_the_remedy(arguments, said):
    assert said in refused(*arguments)


def test_program_without_rapids_writes_nothing(tmp_path):
    program, sheet = tmp_path / "p.ngc", tmp_path / "s.txt"
    program.write_text("G21 G90 G94\nG1 X1 F100\nM2\n")
    assert "there is no rapid whose way is known" in refused(
        program, "-m", "vmc", "--controller", "grbl", "-o", sheet
    )
    assert not sheet.exists()


@pytest.mark.parametrize(
    "arguments",
    [
        (PLATE, "--lengths", "1:2", "-m", "vmc"),
        ("--lengths", "5", "-m", "vmc"),
        ("--lengths", "9:1", "-m", "vmc"),
        (PLATE, "-m", "vmc", "--goal", "best"),
        (PLATE, "-m", "vmc", "--try", "1620"),
        (PLATE, "-m", "vmc", "--plot", "x.gif"),
        (PLATE, "-m", "vmc", "-o", "a", "--json", "a"),
    ],
)
def test_wrong_usage(arguments):
    assert run(*arguments).exit_code == 2
