"""Outputs appear in one move or not at all, and inputs are never touched."""

import os
import resource
import signal
import subprocess
import sys
import time

import pytest

from gcodejerk.batch.files import PREFIX, new_file, open_input, same_file
from gcodejerk.errors import EmitError, ProgramError

COMMAND = [sys.executable, "-m", "gcodejerk.cli", "process", "part.nc", "-m", "vmc"]


def program(rapids):
    lines = ["G21 G90 G94 G64", "G0 X0 Y0 Z5"]
    for k in range(rapids):
        lines += [f"G0 X{k % 97 + 1} Y{k % 89}", "G1 Z-1 F300", f"X{k % 97 + 3}", "G0 Z5"]
    return "\n".join([*lines, "M2", ""]).encode()


def test_a_file_appears_when_its_block_ends(tmp_path):
    with new_file(str(tmp_path / "out.nc")) as file:
        file.write(b"G0 X1\n")
        assert not (tmp_path / "out.nc").exists()
    assert (tmp_path / "out.nc").read_bytes() == b"G0 X1\n"
    assert [p.name for p in tmp_path.iterdir()] == ["out.nc"]


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / "out.nc").write_bytes(b"old")

    def write_half():
        with new_file(str(tmp_path / "out.nc")) as file:
            file.write(b"half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_half()
    assert (tmp_path / "out.nc").read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["out.nc"]


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real.nc").write_bytes(b"old")
    (tmp_path / "link.nc").symlink_to("real.nc")
    with new_file(str(tmp_path / "link.nc")) as file:
        file.write(b"new")
    assert (tmp_path / "link.nc").is_symlink()
    assert (tmp_path / "real.nc").read_bytes() == b"new"


def test_a_device_is_written_to_and_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    reader = subprocess.Popen(["cat", tmp_path / "pipe"], stdout=subprocess.PIPE)
    with new_file(str(tmp_path / "pipe")) as file:
        file.write(b"G0 X1\n")
    assert reader.communicate()[0] == b"G0 X1\n"
    assert (tmp_path / "pipe").is_fifo()


def test_a_full_device_is_an_error():
    with (
        pytest.raises(EmitError, match="/dev/full cannot be written"),
        new_file("/dev/full") as out,
    ):
        out.write(b"G0 X1\n")


def test_a_missing_folder_is_an_error_with_the_name(tmp_path):
    with pytest.raises(EmitError, match=r"no/out\.nc cannot be written"), new_file("no/out.nc"):
        pass


def test_names_of_one_file_are_the_same_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.nc").write_bytes(b"")
    (tmp_path / "b.nc").hardlink_to("a.nc")
    assert same_file("a.nc", "./a.nc")
    assert same_file("a.nc", "b.nc")
    assert not same_file("a.nc", "c.nc")
    assert same_file("c.nc", "./c.nc")


def test_a_missing_input_is_an_error():
    with pytest.raises(ProgramError, match="there is no file"), open_input("none.nc"):
        pass


def test_a_full_disk_leaves_nothing_behind(tmp_path):
    (tmp_path / "part.nc").write_bytes(program(400))

    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    done = subprocess.run(
        COMMAND, cwd=tmp_path, preexec_fn=small_files, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "part.jerk.nc cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["part.nc"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_is_read_only_is_an_error(tmp_path):
    (tmp_path / "part.nc").write_bytes(program(3))
    tmp_path.chmod(0o555)
    done = subprocess.run(COMMAND, cwd=tmp_path, capture_output=True, text=True, check=False)
    tmp_path.chmod(0o755)
    assert done.returncode == 1
    assert "cannot be written" in done.stderr


def test_a_kill_at_any_moment_leaves_no_half_file(tmp_path, request):
    data = program(600)
    (tmp_path / "part.nc").write_bytes(data)
    begun = time.monotonic()
    subprocess.run(COMMAND, cwd=tmp_path, check=True, capture_output=True)
    whole_time = time.monotonic() - begun
    whole = (tmp_path / "part.jerk.nc").read_bytes()
    every = 1 if request.config.getoption("--long") else 2
    for share in (0.3, 0.5, 0.6, 0.7, 0.8, 0.9)[::every]:
        (tmp_path / "part.jerk.nc").unlink(missing_ok=True)
        running = subprocess.Popen(COMMAND, cwd=tmp_path, stdout=subprocess.DEVNULL)
        time.sleep(share * whole_time)
        running.send_signal(signal.SIGKILL)
        running.wait()
        assert (tmp_path / "part.nc").read_bytes() == data
        if (tmp_path / "part.jerk.nc").exists():
            assert (tmp_path / "part.jerk.nc").read_bytes() == whole
        left = {p.name for p in tmp_path.iterdir()} - {"part.nc", "part.jerk.nc"}
        assert all(name.startswith(PREFIX) for name in left)


def test_two_runs_on_one_output_leave_one_whole_file(tmp_path):
    (tmp_path / "part.nc").write_bytes(program(300))
    (tmp_path / "other.nc").write_bytes(program(200))
    other = [*COMMAND[:4], "other.nc", *COMMAND[5:]]
    alone = []
    for command in (COMMAND, other):
        subprocess.run([*command, "-o", "out.nc"], cwd=tmp_path, check=True, capture_output=True)
        alone.append((tmp_path / "out.nc").read_bytes())
    both = [
        subprocess.Popen([*command, "-o", "out.nc"], cwd=tmp_path, stdout=subprocess.DEVNULL)
        for command in (COMMAND, other)
    ]
    assert [run.wait() for run in both] == [0, 0]
    assert (tmp_path / "out.nc").read_bytes() in alone
