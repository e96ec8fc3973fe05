"""Many programs in one run: each on its own, whatever happens to the others."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.batch import jobs
from gcodejerk.batch.files import PREFIX
from gcodejerk.batch.jobs import Job, run_jobs
from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import Settings

COMMAND = [sys.executable, "-m", "gcodejerk.cli"]
PROGRAM = b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1. (up)\nG1 X5 F100\nG0 X40\nM2\n"
POSTED = Path(__file__).parents[3] / "shared" / "hosts" / "nc"
JOBS = pytest.mark.parametrize("jobs", [1, 2])


@pytest.fixture
def shop(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a.nc", "b.ngc", "lathe/c.TAP", "lathe/deep/a.nc"):
        (tmp_path / "shop" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "shop" / name).write_bytes(PROGRAM)
    return tmp_path / "shop"


def files(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if not p.is_dir())


def process(*arguments):
    return subprocess.run(
        [*COMMAND, "process", *map(str, arguments), "-m", "vmc"],
        capture_output=True, text=True, errors="backslashreplace", check=False,
    )  # fmt: skip


@JOBS
def test_a_folder_is_processed_into_another_one_with_its_tree(shop, jobs):
    done = process("shop", "--output-dir", "out", "--jobs", jobs)
    assert done.returncode == 0
    assert files(Path("out")) == files(shop)
    assert b"gcodejerk stamp" in Path("out/lathe/deep/a.nc").read_bytes()
    assert done.stdout.splitlines()[-1] == (
        "4 programs: 8 rapids rewritten, 4 left alone; none failed"
    )
    assert [line.split(":")[0] for line in done.stdout.splitlines()[:-1]] == [
        "shop/a.nc", "shop/b.ngc", "shop/lathe/c.TAP", "shop/lathe/deep/a.nc"
    ]  # fmt: skip


def test_a_second_run_over_a_folder_does_not_take_outputs_for_programs(shop):
    for _ in range(2):
        done = process("shop")
        assert done.returncode == 0
        assert done.stdout.splitlines()[-1].startswith("4 programs")
    assert len(files(shop)) == 8
    assert process(".", "--output-dir", "shop/out").returncode == 0
    again = process(".", "--output-dir", "shop/out")
    assert again.stdout.splitlines()[-1].startswith("4 programs")


@JOBS
def test_failures_of_every_kind_stop_nobody_else(shop, jobs):
    (shop / "binary.nc").write_bytes(b"G0 X1\0\n")
    (shop / "empty.nc").write_bytes(b"")
    (shop / "nothing").mkdir()
    # The folder for this output cannot be made, since a file of its name is there.
    (shop / "x").mkdir()
    (shop / "x" / "d.nc").write_bytes(PROGRAM)
    Path("out").mkdir()
    Path("out/x").write_bytes(b"in the way")
    done = process("shop", "none.nc", "shop/nothing", "--output-dir", "out", "--jobs", jobs)
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    for words in (
        "shop/nothing holds no program", "shop/binary.nc:1:6: file holds the byte 0x00",
        "shop/empty.nc: file is empty", "there is no file none.nc", "out/x cannot be made a folder",
    ):  # fmt: skip
        assert words in done.stderr
    assert files(Path("out")) == ["a.nc", "b.ngc", "lathe/c.TAP", "lathe/deep/a.nc", "x"]
    assert done.stdout.splitlines()[-1] == (
        "9 programs: 8 rapids rewritten, 4 left alone; 5 failed"
    )


def test_a_bug_in_one_file_is_told_with_its_traceback_and_stops_nobody(shop, monkeypatch):
    vmc = Machine.load(find_machine("vmc"))
    whole = jobs.process_file

    def sometimes(source, target, machine, settings, name, *more):
        if name == "shop/b.ngc":
            raise ZeroDivisionError("drawn")
        return whole(source, target, machine, settings, name, *more)

    monkeypatch.setattr(jobs, "process_file", sometimes)
    names = ["shop/a.nc", "shop/b.ngc", "shop/lathe/c.TAP"]
    asked = [Job(name, name + ".out", None, "write", False, False) for name in names]
    first, second, third = run_jobs(asked, vmc, Settings(), 1, None)
    assert (first.planned, third.planned) == (2, 2)
    assert "bug of gcodejerk" in second.error
    assert "ZeroDivisionError: drawn" in second.error
    with pytest.raises(ZeroDivisionError):
        list(run_jobs(asked[1:2], vmc, Settings(), 1, None))
    assert not Path("shop/b.ngc.out").exists()


def test_two_outputs_of_one_name_are_wrong_usage_before_anything_is_written(shop):
    done = process("shop", "shop/lathe/deep", "--output-dir", "out")
    assert done.returncode == 2
    words = " ".join(re.sub(r"[^\w./]+", " ", done.stderr).split())
    assert "shop/a.nc and shop/lathe/deep/a.nc would both be written to out/a.nc" in words
    assert not Path("out").exists()
    (shop / "b.nc").write_bytes(PROGRAM)  # beside b.ngc
    assert process("shop", "--controller", "csv").returncode == 2
    assert len(files(shop)) == 5


def test_an_output_over_another_input_is_wrong_usage(shop):
    done = process("shop/a.nc", "shop/lathe/deep/a.nc", "--output-dir", "shop/lathe/deep")
    assert done.returncode == 2
    assert (shop / "lathe/deep/a.nc").read_bytes() == PROGRAM


def test_reports_go_to_a_folder_of_their_own(shop):
    done = process("shop", "--output-dir", "out", "--report", "reports/", "--jobs", 2)
    assert done.returncode == 0
    assert files(Path("reports")) == [name + ".json" for name in files(shop)]
    record = json.loads(Path("reports/lathe/c.TAP.json").read_text())
    assert (record["input"], record["output"]) == ("shop/lathe/c.TAP", "out/lathe/c.TAP")


@JOBS
def test_check_of_many_writes_nothing(shop, jobs):
    before = files(shop)
    done = process("shop", "--check", "--jobs", jobs)
    assert done.returncode == 3
    assert done.stdout.splitlines() == [
        *(f"shop/{name}: would be changed" for name in before),
        "4 programs: 8 rapids would be rewritten, 4 left alone; none failed",
    ]
    assert files(shop) == before


def test_in_place_takes_a_folder(shop):
    assert process("shop", "--in-place", "--jobs", 2).returncode == 0
    assert len(files(shop)) == 4
    assert all(b"stamp" in (shop / name).read_bytes() for name in files(shop))


def test_a_name_that_is_not_utf8_is_processed_and_shown(shop):
    with open(b"shop/\xff.nc", "wb") as file:
        file.write(PROGRAM)
    done = process("shop", "--report", "reports/")
    assert done.returncode == 0
    assert "shop/\\udcff.nc: 3 rapids" in done.stdout
    assert os.path.exists(b"shop/\xff.jerk.nc")
    with open(b"reports/\xff.nc.json", encoding="utf-8") as file:
        assert json.load(file)["input"] == "shop/\udcff.nc"
    difference = process("shop/\udcff.nc", "--diff")
    assert difference.returncode == 0
    assert difference.stdout.startswith("--- shop/\\xff.nc\n")


def test_a_machine_file_in_the_folder_is_found(shop):
    shutil.copy(find_machine("vmc"), shop / "mine.yaml")
    done = subprocess.run(
        [*COMMAND, "process", "shop", "--check", "-m", "mine.yaml"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "4 programs" in done.stdout


class Stuck:
    """A run with two jobs, one of which waits for what will not come through a pipe."""

    def __init__(self, jobs, hang_up=signal.SIG_DFL):
        os.mkfifo("stuck.nc")
        self.run = subprocess.Popen(
            [*COMMAND, "process", "shop/a.nc", "stuck.nc", "shop/b.ngc", "-m", "vmc",
             "--output-dir", "out", "--jobs", str(jobs)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
            # Who runs the tests behind nohup hands down that hang-ups are ignored.
            preexec_fn=lambda: signal.signal(signal.SIGHUP, hang_up),
        )  # fmt: skip
        self.pipe = open("stuck.nc", "wb")  # noqa: SIM115 - returns when the other end is open
        self.until(lambda: Path("out/a.nc").exists() and (jobs == 1 or Path("out/b.ngc").exists()))
        # Behind Python's last look before the read that waits, a signal is seen with the next one.
        time.sleep(0.3)

    @staticmethod
    def until(condition):
        for _ in range(600):
            if condition():
                return
            time.sleep(0.1)
        pytest.fail("nothing happened for a minute")

    def who_waits(self):
        """The process that holds the pipe."""
        for process in Path("/proc").iterdir():
            if process.name.isdigit() and int(process.name) != os.getpid():
                try:
                    held = [os.readlink(fd) for fd in (process / "fd").iterdir()]
                except OSError:
                    continue
                if str(Path("stuck.nc").absolute()) in held:
                    return int(process.name)
        raise AssertionError("nobody holds the pipe")

    def end(self):
        out, err = self.run.communicate(timeout=60)
        self.pipe.close()
        assert "Traceback" not in err
        left = [p.name for p in Path("out").iterdir() if p.name.startswith(PREFIX)]
        assert left == []
        return self.run.returncode, out, err


def test_a_worker_that_is_killed_fails_its_program_only(shop):
    run = Stuck(2)
    os.kill(run.who_waits(), signal.SIGKILL)
    status, out, err = run.end()
    assert status == 1
    assert "stuck.nc: the process that worked on it died (signal 9)" in err
    assert out.splitlines()[-1] == "3 programs: 4 rapids rewritten, 2 left alone; 1 failed"
    assert files(Path("out")) == ["a.nc", "b.ngc"]


@JOBS
@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_asked_to_end_it_ends_quietly_and_leaves_nothing_half_written(shop, jobs, number, status):
    run = Stuck(jobs)
    os.killpg(run.run.pid, number)  # as a terminal does
    assert run.end()[0] == status
    assert files(Path("out")) == (["a.nc"] if jobs == 1 else ["a.nc", "b.ngc"])


def test_behind_nohup_it_goes_on(shop):
    run = Stuck(2, hang_up=signal.SIG_IGN)
    os.killpg(run.run.pid, signal.SIGHUP)
    run.pipe.close()
    status, out, _ = run.end()
    assert status in (0, 1)  # 128 and more are signals
    assert out.splitlines()[-1].startswith("3 programs: 4 rapids rewritten")
    assert files(Path("out")) == ["a.nc", "b.ngc"]


@pytest.mark.skipif(not POSTED.is_dir(), reason=f"no {POSTED}: the posted programs are not here")
@pytest.mark.parametrize(("machine", "jobs"), [("vmc", ["1", "2"]), ("router", ["2"])])
def test_programs_that_freecad_posts_go_through_in_one_run(
    tmp_path, machine, jobs, command, request
):
    tree = tmp_path / "in"
    most = np.inf if request.config.getoption("--long") else 20_000
    for path in (p for p in POSTED.glob("*__linuxcnc*.ngc") if p.stat().st_size < most):
        place = tree / path.stem.split("__")[0] / path.name
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, place)
    assert len(files(tree)) >= 5
    run = [*COMMAND, "process", "in", "-m", machine, "--output-dir"]
    for many in jobs:
        done = subprocess.run(
            [*run, f"out{many}", "--jobs", many],
            cwd=tmp_path, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert f"{len(files(tree))} programs" in done.stdout
        assert "none failed" in done.stdout
    for name in files(tree):
        outputs = [tmp_path / f"out{many}" / name for many in jobs]
        assert len({output.read_bytes() for output in outputs}) == 1
        assert command("verify", tree / name, outputs[0], "-m", machine)[0] == 0
