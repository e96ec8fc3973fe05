"""No option does nothing: each does what its name says, or is refused with what helps instead."""

import json
import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gcodejerk import cli

SAMPLES = Path(__file__).parents[2] / "samples"
SPECTRUM = "config/resonances_x.csv"

IDLE = {
    # command: what helps, as the message says it
    "process plate.ngc -m vmc --json -o -": "standard output holds one",
    "process - -m vmc --json": "standard output holds one",
    "process plate.ngc -m vmc --json --diff": "standard output holds one",
    "process plate.ngc -m vmc --json -v": "--report",
    "process - -m vmc --output-dir out": "-o FILE",
    "process - -m vmc --if-changed": "name one",
    "process plate.ngc -m vmc --as parameters --profile cascade": "leave --profile out",
    "process plate.ngc --revert --profile cascade": "--revert puts originals back",
    "process plate.ngc --revert --controller grbl": "no --controller beside it",
    "process plate.ngc --revert -m vmc": "no --machine beside it",
    "process plate.ngc --revert --force": "no --force beside it",
    "process plate.ngc -m vmc --report r.json --report r.html": "--report stands twice",
    "process plate.ngc -m vmc --report r.json --report s.json": "--report stands twice",
    "verify plate.ngc plate.ngc -m vmc --json -q": "choose one",
    "plan -m vmc Z=1 --plot a.png --plot a.svg": "--plot stands twice",
    "identify ringing.csv --axis Z -m vmc": "--program FILE",
    "identify ringing.csv --axis Z --channel x": "--program FILE",
    "identify ringing.csv --axis Z --rate 100 --time t": "choose one",
    f"identify {SPECTRUM} --axis X --unit g": "leave --unit out",
    f"identify {SPECTRUM} --axis X --rate 100": "leave --rate out",
    f"identify {SPECTRUM} --axis X -m vmc --program ringing.ngc --channel x": "leave --program out",
    "parameters -m vmc --controller fanuc --lengths 1:5 --dialect grbl": "leave --dialect out",
    "parameters -m vmc --controller fanuc --lengths 1:5 --try 1=1 -o -": "leave --try out",
    "parameters -m vmc --controller fanuc --lengths 1:5 --try 1=1 --json -": "leave --try out",
    "machine new config/printer.cfg --force": "name the file with -o",
    "machine test-program -m vmc --json -o -": "standard output holds one",
    "install --machine vmc": "name the host",
    "install --remove": "name the host",
    "install octoprint . --remove -m vmc": "leave --machine out",
    "install freecad . --remove --base linuxcnc": "leave --base out",
    "install linuxcnc x.ini --form filter -m vmc --linuxcnc-version 2.9": "--linuxcnc-version",
    "install linuxcnc x.ini --remove --linuxcnc-version 2.9": "--linuxcnc-version",
    "install linuxcnc x.ini --remove --form filter -m vmc": "leave --machine out",
}


WRONG = {
    "process plate.ngc -m vmc --profile foo": "there is no profile 'foo'",
    "process plate.ngc -m vmc --controller linuxnc": "did you mean 'linuxcnc'?",
    "process plate.ngc -m vmc --dialect fanucc": "did you mean fanuc?",
    "inspect plate.ngc -m vmc --dialect foo": "dialect 'foo' is not known",
    "simulate plate.ngc -m vmc --profile foo": "there is no profile 'foo'",
    "simulate plate.ngc -m vmc --dialect foo": "dialect 'foo' is not known",
    "verify plate.ngc plate.ngc -m vmc --dialect foo": "dialect 'foo' is not known",
    "parameters plate.ngc -m vmc --controller foo": "there is no controller 'foo'",
    "machine new config/printer.cfg --controller foo": "there is no controller 'foo'",
    "plan -m vmc Z=1 --profile foo": "there is no profile 'foo'",
    "plan -m vmc Z=1 --time -1": "expected more than zero",
    "plan -m vmc Z=1 --T1 0": "expected more than zero",
    "compare -m vmc Z=1 --time 0": "expected more than zero",
    "simulate Z=1 -m vmc --time nan": "expected more than zero",
    "map -m vmc --axis Z --length 0": "--length 0 is no move",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("GCODEJERK_MACHINE", raising=False)
    for name in ("plate.ngc", "ringing.csv", "ringing.ngc"):
        shutil.copy(SAMPLES / name, tmp_path)
    shutil.copytree(SAMPLES / "config", tmp_path / "config")
    return tmp_path


def call(text, **given):
    return CliRunner().invoke(cli.app, text.split(), **given)


@pytest.mark.parametrize("text", WRONG)
def test_a_value_that_no_machine_could_take_is_wrong_usage(folder, text):
    done = call(text)
    said = re.sub(r"\s+", " ", done.output.replace("│", " "))
    assert done.exit_code == 2, said
    assert WRONG[text] in said


@pytest.mark.parametrize("text", IDLE)
def test_an_option_that_would_do_nothing_is_refused(folder, text):
    before = sorted(folder.rglob("*"))
    done = call(text, input=(folder / "plate.ngc").read_bytes())
    said = re.sub(r"\s+", " ", done.output.replace("│", " "))
    assert done.exit_code == 2, said
    assert IDLE[text] in said
    assert sorted(folder.rglob("*")) == before


def test_an_option_that_may_be_given_again_may(folder):
    done = call("machine test-program -m vmc --axis Z --axis X --json")
    assert [one["axis"] for one in json.loads(done.stdout)["rapids"]] == ["Z", "X"]


def test_a_difference_may_be_checked_for_too(folder):
    done = call("process plate.ngc -m vmc --check --diff")
    assert done.exit_code == 3
    assert done.stdout.startswith("--- plate.ngc")
    assert call("process plate.ngc -m vmc --diff").exit_code == 0


def test_what_is_checked_from_standard_input_is_told_on_standard_output(folder):
    done = call("process - -m vmc --check --json", input=(folder / "plate.ngc").read_bytes())
    assert (done.exit_code, json.loads(done.stdout)["changed"]) == (3, True)


@pytest.mark.parametrize(
    "words",
    [
        *("--in-place", "--in-place --backup", "--output-dir out", "-o out.ngc", "--if-changed"),
        *("--report r.json", "--report r.html -o out.ngc", "--controller csv --no-comments"),
    ],
)
def test_a_trial_of_a_run_takes_the_words_of_the_run_and_writes_nothing(folder, words):
    before = sorted(folder.rglob("*"))
    assert call(f"process plate.ngc -m vmc {words} --check").exit_code == 3
    assert call(f"process plate.ngc -m vmc {words} --diff").exit_code in (0, 2)
    assert sorted(folder.rglob("*")) == before


def test_the_last_of_two_options_counts_where_they_name_no_file(folder):
    assert call("process plate.ngc -m router --machine vmc -o out.ngc").exit_code == 0
    assert b"Small vertical" in (folder / "out.ngc").read_bytes()[:100]


def test_a_machine_of_the_environment_is_nobodys_option(folder, monkeypatch):
    monkeypatch.setenv("GCODEJERK_MACHINE", "vmc33")
    assert call("identify ringing.csv --axis Z").exit_code == 0
    monkeypatch.setenv("GCODEJERK_MACHINE", "vmc")
    assert call("process plate.ngc --in-place --backup").exit_code == 0
    assert call("process plate.ngc --revert").exit_code == 0


def test_originals_come_back_quietly(folder):
    assert call("process plate.ngc -m vmc --in-place --backup").exit_code == 0
    done = call("process plate.ngc --revert -q")
    assert (done.exit_code, done.output) == (0, "")


@pytest.mark.parametrize(
    ("words", "options"),
    [("--controller grbl", "--dialect linuxcnc"), ("--controller csv", ""), ("--unroll", "")],
)
def test_profiles_are_of_streams_for_linuxcnc(folder, words, options):
    done = call(f"process plate.ngc -m vmc {words} {options} --report r.json")
    assert done.exit_code == 0, done.output
    output = "plate.jerk.csv" if "csv" in words else "plate.jerk.ngc"
    done = call(f"verify plate.ngc {output} -m vmc {options} --report r.json")
    assert (done.exit_code, "leave --report out" in done.output) == (2, True)
    assert call(f"verify plate.ngc {output} -m vmc {options}").exit_code == 0


def test_a_test_program_is_written_and_its_lengths_are_told(folder):
    done = call("machine test-program -m vmc --axis Z --repeats 7 --dwell 1.5 --json -o ring.ngc")
    record = json.loads(done.stdout)
    assert (record["repeats"], record["dwell"], record["program"]) == (7, 1.5, "ring.ngc")
    call("machine test-program -m vmc --axis Z --repeats 7 --dwell 1.5 -o same.ngc")
    assert (folder / "ring.ngc").read_bytes() == (folder / "same.ngc").read_bytes()


@pytest.mark.parametrize("words", ["-o - --points 5", "--json", "-o x.csv --json --points 5"])
def test_a_map_on_standard_output_is_nothing_else(folder, words):
    done = call(f"map -m vmc --axis Z --length 1 {words}")
    assert done.exit_code == 0, done.output
    if "--json" in words:
        json.loads(done.stdout)
    else:
        assert done.stdout.startswith("T1,T_SUM,amplitude\n")


def test_columns_of_a_spectrum_are_chosen(folder):
    told = json.loads(call(f"identify {SPECTRUM} --axis X --column psd_y --json -").stdout)
    usual = json.loads(call(f"identify {SPECTRUM} --axis X --json -").stdout)
    assert told != usual
    done = call(f"identify {SPECTRUM} --axis X --column no_such")
    assert done.exit_code == 1
    assert "no column 'no_such'" in str(done.exception)
