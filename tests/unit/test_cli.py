"""The command line: arguments, files, exit codes, and what a user reads."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gcodejerk import cli
from gcodejerk.errors import GcodejerkError

PROGRAM = b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1. (up)\nG1 X5 F100\nG0 X40\nM2\n"
ROOT = Path(__file__).parents[2]


class Ran:
    """What a command printed, and its exit status."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("COLUMNS", raising=False)
    (tmp_path / "part.nc").write_bytes(PROGRAM)
    return tmp_path


@pytest.fixture
def run(folder):
    def command(*arguments, input=None):
        result = CliRunner().invoke(cli.app, [str(a) for a in arguments], input=input)
        if isinstance(result.exception, GcodejerkError):
            # `main` turns these into a message on standard error and exit status 1.
            return Ran(1, result.stdout, str(result.exception))
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return Ran(result.exit_code, result.stdout, result.stderr)

    return command


def test_process_writes_beside_the_input_and_leaves_it_alone(run, folder):
    done = run("process", "part.nc", "--machine", "vmc")
    assert done.code == 0
    assert "3 rapids, 2 rewritten" in done.out
    assert (folder / "part.nc").read_bytes() == PROGRAM
    output = (folder / "part.jerk.nc").read_bytes()
    assert b"gcodejerk stamp" in output
    assert sorted(p.name for p in folder.iterdir()) == ["part.jerk.nc", "part.nc"]


def test_standard_input_goes_to_standard_output(run):
    done = run("process", "-", "-m", "vmc", input=PROGRAM)
    assert done.code == 0
    assert done.out.startswith("(gcodejerk stamp")
    assert "2 rewritten" in done.err


def test_in_place_replaces_the_program_and_keeps_its_mode(run, folder):
    (folder / "part.nc").chmod(0o640)
    assert run("process", "part.nc", "-m", "vmc", "--in-place").code == 0
    assert b"gcodejerk stamp" in (folder / "part.nc").read_bytes()
    assert (folder / "part.nc").stat().st_mode & 0o777 == 0o640


def test_a_processed_program_is_refused_unless_forced(run, folder):
    assert run("process", "part.nc", "-m", "vmc", "-o", "out.nc").code == 0
    again = run("process", "out.nc", "-m", "vmc")
    assert again.code == 1
    assert "out.nc:1: this program has been processed" in again.err
    assert not (folder / "out.jerk.nc").exists()
    assert run("process", "out.nc", "-m", "vmc", "--force").code == 0


@pytest.mark.parametrize("name", ["part.nc", "./part.nc", "link.nc"])
def test_an_output_that_is_the_input_is_refused(run, folder, name):
    (folder / "link.nc").symlink_to("part.nc")
    done = run("process", "part.nc", "-m", "vmc", "-o", name)
    assert done.code == 1
    assert "is the input itself" in done.err
    assert (folder / "part.nc").read_bytes() == PROGRAM


def test_a_report_over_the_input_is_refused(run, folder):
    (folder / "part.json").write_bytes(PROGRAM)
    done = run("process", "part.json", "-m", "vmc", "--report", "part.json")
    assert done.code == 1
    assert (folder / "part.json").read_bytes() == PROGRAM


def test_check_writes_nothing_and_tells_by_its_status(run, folder):
    done = run("process", "part.nc", "-m", "vmc", "--check")
    assert (done.code, "would be changed" in done.out) == (3, True)
    (folder / "still.nc").write_bytes(b"G21 G90\nG1 X1 F100\nM2\n")
    assert run("process", "still.nc", "-m", "vmc", "--check").code == 0
    assert sorted(p.name for p in folder.iterdir()) == ["part.nc", "still.nc"]


def test_strict_refuses_a_program_with_rapids_left_alone(run, folder):
    done = run("process", "part.nc", "-m", "vmc", "--strict")
    assert done.code == 1
    assert "1 left alone (1 start unknown)" in done.err
    assert [p.name for p in folder.iterdir()] == ["part.nc"]


def test_diff_shows_what_patch_would_apply(run, folder):
    done = run("process", "part.nc", "-m", "vmc", "--diff")
    assert done.code == 0
    assert run("process", "part.nc", "-m", "vmc", "-o", "out.nc").code == 0
    (folder / "d.diff").write_text(done.out)
    subprocess.run(["patch", "-s", "part.nc", "d.diff"], check=True, cwd=folder)
    assert (folder / "part.nc").read_bytes() == (folder / "out.nc").read_bytes()


def test_several_programs_go_to_a_folder_and_one_bad_one_stops_none(run, folder):
    (folder / "bad.nc").write_bytes(b"G0 X1\0\n")
    (folder / "b.nc").write_bytes(PROGRAM)
    files = ("part.nc", "bad.nc", "b.nc")
    for jobs in ("1", "2"):
        done = run("process", *files, "-m", "vmc", "--output-dir", "out", "--jobs", jobs)
        assert done.code == 1
        assert "bad.nc:1" in done.err
        assert sorted(p.name for p in (folder / "out").iterdir()) == ["b.nc", "part.nc"]


def test_report_is_strict_json(run, folder):
    assert run("process", "part.nc", "-m", "vmc", "--report", "r.json").code == 0
    record = json.loads((folder / "r.json").read_text())
    assert record["input"] == "part.nc"
    assert record["output"] == "part.jerk.nc"
    assert record["machine"] == "vmc.yaml"
    assert record["verified"] is True
    assert [r["status"] for r in record["rapids"]] == ["left", "planned", "planned"]


def test_csv_has_one_row_per_interval(run, folder):
    assert run("process", "part.nc", "-m", "centre").code == 0
    rows = (folder / "part.jerk.csv").read_text().splitlines()
    assert rows[0] == "block,t,X,Y,Z"
    assert rows[1] == "3,0,0.0000,0.0000,0.0000"
    assert sum(row.startswith("3,") for row in rows) == 41


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["process", "part.nc", "-m", "vmc", "-o", "a", "--in-place"], "choose one of"),
        (["process", "part.nc", "b.nc", "-m", "vmc", "-o", "a"], "one program"),
        (["process", ".", "-m", "vmc", "-o", "a"], "one program"),
        (["process", ".", "-m", "vmc", "--report", "r.json"], "one program"),
        (["process", "-", "part.nc", "-m", "vmc"], "give it alone"),
        (
            ["process", "part.nc", "-m", "vmc", "--report", "r.txt"],
            ".json, a page .html to look at, or -",
        ),
        (["process", "-", "-m", "vmc", "--in-place"], "needs a file"),
        (["process", "-m", "vmc"], "Missing argument"),
        (["process", "part.nc"], "no machine: state --machine"),
        (["plan", "-m", "vmc", "Z"], "AXIS=LENGTH"),
        (["plan", "-m", "vmc", "Z=1", "Z=2"], "twice"),
        (["nonsense"], "No such command"),
    ],
)
def test_wrong_usage_is_status_2(run, folder, arguments, words):
    done = run(*arguments)
    assert done.code == 2
    assert words in re.sub(r"\s+", " ", done.err)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["process", "none.nc", "-m", "vmc"], "there is no file none.nc"),
        (["process", "part.nc", "-m", "vmc", "-o", "."], "is a folder"),
        (["inspect", ".", "-m", "vmc"], "is a folder"),
        (["process", "part.nc", "-m", "wmc"], "did you mean 'vmc'"),
        (["process", "part.nc", "-m", "vmc", "--as", "pvt"], "cannot write --as pvt"),
        (["process", "part.nc", "-m", "vmc", "--profile", "zv"], "adds time to every rapid"),
        (["process", "part.nc", "-m", "vmc", "-o", "no/where.nc"], "cannot be written"),
        (["plan", "-m", "vmc", "Q=1"], "has no axis 'Q'"),
        (["plan", "-m", "vmc", "Z=1", "--time", "0.02"], "allow at least 0.028 s"),
        (["plan", "-m", "vmc", "Z=1", "--T1", "0.03"], "outside 0 < T1 < T_SUM/2"),
        (
            ["plan", "-m", "vmc", "Z=1", "--time", "0.04", "--T1", "0.0005"],
            "shorter than the interval",
        ),
        (["plan", "-m", "vmc", "Z=nan"], "expected a length"),
        (["plan", "-m", "vmc", "Z=1", "--plot", "a.bmp"], "use .png, .svg, .pdf"),
        (["machine", "check", "none.yaml"], "none.yaml"),
    ],
)
def test_a_refusal_is_status_1_with_a_remedy_and_nothing_written(run, folder, arguments, words):
    done = run(*arguments)
    assert done.code == 1
    assert words in done.err
    assert "\n  " in done.err, "a remedy stands on a line of its own"
    assert [p.name for p in folder.iterdir()] == ["part.nc"]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        pytest.param(b"", "bad.nc: file is empty", id="empty"),
        pytest.param(b"\0\1\2\3" * 100, "bad.nc:1:1: file holds the byte 0x00", id="NUL bytes"),
        pytest.param(
            b"G0 X1\nM2\n" + b"\0" * 200, "bad.nc:3:1: file holds the byte 0x00", id="padded"
        ),
        pytest.param("G0 X1\n".encode("utf-16"), "bad.nc:1:1: file is UTF-16", id="UTF-16"),
        pytest.param("G0 X1\n".encode("utf-16-be"), "bad.nc:1:1: file seems to be UTF-16", id="BE"),
        pytest.param("G0 X1\n".encode("utf-16-le"), "bad.nc:1:2: file seems to be UTF-16", id="LE"),
        pytest.param(
            b"\xff\xd8\xff\xe0" + bytes(range(256)) * 8,
            "no NC program but a picture (JPEG)",
            id="JPEG",
        ),
        pytest.param(
            b"G0 X1 " + b" " * 3_000_000 + b"\n",
            "bad.nc:1:65537: line has more",
            id="one long line",
        ),
    ],
)
def test_files_that_are_no_programs_are_refused_with_their_place(run, folder, data, said):
    (folder / "bad.nc").write_bytes(data)
    done = run("process", "bad.nc", "-m", "vmc")
    assert done.code == 1
    assert said in done.err
    assert sorted(p.name for p in folder.iterdir()) == ["bad.nc", "part.nc"]


@pytest.mark.parametrize(
    "block",
    [
        b"G0 X5 (open",
        b"G0 X4..2",
        b"G0 X99999999999999999999",
        b"G0 X1 X2",
        b"G0 G1 X5",
        b"G0 X\xff5",
    ],
)
def test_a_block_that_is_not_understood_passes_through(run, folder, block):
    (folder / "odd.nc").write_bytes(PROGRAM.replace(b"M2", block + b"\nG0 Z5\nM2"))
    assert run("process", "odd.nc", "-m", "vmc").code == 0
    output = (folder / "odd.jerk.nc").read_bytes()
    assert b"\n" + block + b"\n" in output


def test_plan_prints_the_papers_numbers(run):
    done = run("plan", "-m", "paper", "Z=1", "--time", "0.040", "--T1", "0.001")
    assert done.code == 0
    assert "13209.3 -> 5696.8" in done.out
    assert "13170.3 -> 5679.8" in done.out


def test_plan_writes_report_stream_and_figure(run, folder):
    done = run(
        "plan", "-m", "vmc", "z=1", "X=2", "--json", "p.json", "--csv", "p.csv", "--plot", "p.png"
    )
    assert done.code == 0
    assert json.loads((folder / "p.json").read_text())["rapids"][0]["end"] == {"Z": 1.0, "X": 2.0}
    assert (folder / "p.csv").read_text().startswith("t,X,Y,Z\n0,0,0,0\n")
    assert (folder / "p.png").read_bytes().startswith(b"\x89PNG")


def test_inspect_shows_every_rapid_and_why_one_is_left(run):
    done = run("inspect", "part.nc", "-m", "vmc")
    assert done.code == 0
    assert "left alone: start unknown" in re.sub(r"\s+", " ", done.out)
    assert "condition3" in done.out
    record = json.loads(run("inspect", "part.nc", "-m", "vmc", "--json").out)
    assert record["summary"]["planned"] == 2


def test_machine_check_and_schema(run, folder):
    assert "good" in run("machine", "check", "router").out
    (folder / "m.yaml").write_text(
        "interval: 0.001\npositioning: linear\naxes:\n  Z: {rapids: 1}\n"
    )
    done = run("machine", "check", "m.yaml")
    assert done.code == 1
    assert "m.yaml:4:7" in done.err
    assert "'rapid'" in done.err
    assert json.loads(run("machine", "schema").out)["type"] == "object"


@pytest.mark.parametrize(
    ("dialect", "warnings"), [("linuxcnc", 1), ("klipper", 1), ("mach", 1), ("auto", 0)]
)
def test_machine_check_runs_the_startup_codes(run, folder, dialect, warnings):
    text = (ROOT / "machines" / "vmc.yaml").read_text()
    text = text.replace("dialect: linuxcnc", f"dialect: {dialect}", 1)
    (folder / "m.yaml").write_text(text + "program:\n  startup: G21 G90 G77.7\n")
    done = run("machine", "check", "m.yaml")
    assert done.code == 0
    assert done.out.count("warning: program.startup: ") == warnings
    assert ("m.yaml:85:12" in done.out) == (warnings > 0)


def test_a_machine_file_beside_the_program_is_found(run, folder):
    (folder / "job").mkdir()
    (folder / "job" / "part.nc").write_bytes(PROGRAM)
    text = (ROOT / "machines" / "vmc.yaml").read_text()
    (folder / "job" / "mine.yaml").write_text(text)
    assert run("process", "job/part.nc", "-m", "mine.yaml").code == 0


def test_controllers_lists_ours_with_confidence(run):
    out = run("controllers").out
    assert "linuxcnc" in out
    assert "measured" in out


def test_main_prints_errors_without_a_traceback(folder):
    done = subprocess.run(
        [sys.executable, "-m", "gcodejerk.cli", "process", "none.nc", "-m", "vmc"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.startswith("there is no file none.nc")
    assert "Traceback" not in done.stderr


def test_a_reader_that_closes_its_end_gets_no_traceback(folder):
    done = subprocess.run(
        ["bash", "-c", f"'{sys.executable}' -m gcodejerk.cli machine schema | head -1"],
        capture_output=True, text=True, check=False, env=os.environ,
    )  # fmt: skip
    assert done.stdout.strip() == "{"
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(("given", "threads"), [(None, "1"), ("4", "4")])
def test_linear_algebra_has_one_thread_unless_the_user_says_otherwise(given, threads):
    code = (
        "import os, sys; from gcodejerk.cli import main; early = 'numpy' in sys.modules\n"
        "sys.argv = ['gcodejerk', '--version']\n"
        "try: main()\n"
        "except SystemExit: print(early, os.environ['OPENBLAS_NUM_THREADS'])\n"
    )
    own = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    own |= {} if given is None else {"OPENBLAS_NUM_THREADS": given}
    run = subprocess.run(
        [sys.executable, "-c", code], env=own, capture_output=True, text=True, check=True
    )
    assert run.stdout.splitlines()[-1] == f"False {threads}"


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed_do_not_matter(tmp_path, closed):
    """As services start programs."""
    call = f"{sys.executable} -m gcodejerk.cli plan --machine vmc Z=1 --csv m.csv {closed}"
    done = subprocess.run(["sh", "-c", call], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "m.csv").read_text().startswith("t,X,Y,Z")
