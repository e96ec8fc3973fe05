"""Whatever goes wrong, an output is absent, the old one, or whole and verified; never a mixture.

Faults are put where they hurt: before every call to the system that touches the folder, before
every read of the program, into every write of the output.
"""

import errno
import os
import random
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcodejerk.batch import files
from gcodejerk.batch.files import PREFIX
from gcodejerk.batch.inputs import find_inputs
from gcodejerk.batch.jobs import Job, run_job
from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import Settings, process
from gcodejerk.verification import verify

COMMAND = [sys.executable, "-m", "gcodejerk.cli", "process", "part.nc", "-m", "vmc"]
OLD = b"(gcodejerk stamp 0.1.0 0123abcd, the old output)\n"
VMC = Machine.load(find_machine("vmc"))


def program(rapids, seed=0):
    lines = ["G21 G90 G94 G64", "G0 X0 Y0 Z5"]
    for k in range(rapids):
        lines += [f"G0 X{k % 97 + 1 + seed} Y{k % 89}", "G1 Z-1 F300", f"X{k % 97 + 3}", "G0 Z5"]
    return "\n".join([*lines, "M2", ""]).encode()


SMALL = program(10)
WHOLE = process(SMALL, VMC).output


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def job(output="part.jerk.nc", report=None, in_place=False):
    return Job("part.nc", output, report, "write", in_place, False)


def do(*arguments, **given):
    return run_job(job(*arguments, **given), VMC, Settings(), None)


def names(place="."):
    return sorted(os.listdir(place))


# For each number read, a child that kills itself before that call that touches the folder. Once the
# modules are there, only the program's own calls are counted.
KILLED = """
import os, signal, sys
import gcodejerk.batch.inputs, gcodejerk.batch.jobs, gcodejerk.batch.workers
import gcodejerk.cli, gcodejerk.machine
import gcodejerk.emit.linuxcnc, gcodejerk.cli.programs

number, here = int(sys.argv[1]), os.getcwd()
sys.argv[1:] = sys.argv[2:]

def hook(event, arguments):
    global left
    if event in ("open", "os.rename", "os.chmod", "os.remove", "os.mkdir", "shutil.rmtree"):
        if any(str(a).startswith((here, "part", ".~", "out")) for a in arguments):
            left -= 1
            if left == 0:
                os.kill(os.getpid(), number)

for line in iter(sys.stdin.readline, ""):
    left = int(line)
    child = os.fork()
    if child == 0:
        sys.addaudithook(hook)
        gcodejerk.cli.main()
        raise SystemExit
    _, status = os.waitpid(child, 0)
    print("ended", os.waitstatus_to_exitcode(status), file=sys.stderr, flush=True)
"""


class Killed:
    """Runs of one command, each killed before a call: only the first one imports the modules."""

    def __init__(self, number, arguments):
        self.master = subprocess.Popen(
            [sys.executable, "-c", KILLED, str(int(number)), *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.master.communicate()

    def run(self, moment):
        """Exit status and standard error of the run that ends before this call."""
        self.master.stdin.write(f"{moment}\n")
        self.master.stdin.flush()
        said = []
        for line in self.master.stderr:
            if line.startswith("ended "):
                return int(line.split()[1]), "".join(said)
            said.append(line)
        raise AssertionError("".join(said))


STRIDE = 6
"""Calls from one kill to the next; the long run kills before each."""


@pytest.mark.parametrize(
    ("number", "old", "first"),
    [
        (signal.SIGKILL, OLD, 1),
        (signal.SIGTERM, OLD, 2),
        (signal.SIGKILL, None, 3),
        (signal.SIGTERM, None, 4),
    ],
)
def test_killed_before_any_call_to_the_system_it_leaves_no_half_file(
    folder, number, old, first, request
):
    Path("part.nc").write_bytes(SMALL)
    arguments = ["process", "part.nc", "-m", "vmc", "--report", "part.json"]
    moments = range(1, 40) if request.config.getoption("--long") else range(first, 40, STRIDE)
    with Killed(number, arguments) as command:
        for moment in moments:
            for left in set(names()) - {"part.nc"}:
                os.unlink(left)
            if old is not None:
                Path("part.jerk.nc").write_bytes(old)
            status, said = command.run(moment)
            assert Path("part.nc").read_bytes() == SMALL
            assert "Traceback" not in said
            found = Path("part.jerk.nc")
            assert (found.read_bytes() if found.exists() else None) in (old, WHOLE)
            hidden = set(names()) - {"part.nc", "part.jerk.nc", "part.json"}
            assert all(name.startswith(PREFIX) for name in hidden)
            assert [f.path for f in find_inputs(["."])[0]] == ["part.nc"]
            if status == 0:
                break
            assert status == (-number if number == signal.SIGKILL else 128 + number)
            if number == signal.SIGTERM:
                assert not hidden
        else:
            pytest.fail("it never came to its end")
    assert moment > 6, "the moments before opening and before renaming were not among them"
    assert names() == ["part.jerk.nc", "part.json", "part.nc"]


def test_killed_at_drawn_moments_a_batch_leaves_whole_files_only(folder, request):
    draw = random.Random(4)
    (folder / "in").mkdir()
    data = [program(150, seed) for seed in range(4)]
    for k, content in enumerate(data):
        Path(f"in/{k}.nc").write_bytes(content)
    run = [*COMMAND[:4], "in", "-m", "vmc", "--output-dir", "out", "--jobs", "2"]
    begun = time.monotonic()
    subprocess.run(run, check=True, capture_output=True)
    took = time.monotonic() - begun
    whole = {name: Path("out", name).read_bytes() for name in names("out")}
    assert len(whole) == 4
    for _ in range(32 if request.config.getoption("--long") else 2):
        for name in names("out"):
            os.unlink(f"out/{name}")
        number = draw.choice([signal.SIGKILL, signal.SIGTERM])
        running = subprocess.Popen(run, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        time.sleep(draw.uniform(0.2, 1.0) * took)
        running.send_signal(number)
        # Workers hold these pipes, too: this returns when the last one has ended.
        _, err = running.communicate()
        assert "Traceback" not in err
        for name in names("out"):
            if name.startswith(PREFIX):
                assert number == signal.SIGKILL
            else:
                assert Path("out", name).read_bytes() == whole[name]
        assert [Path(f"in/{k}.nc").read_bytes() for k in range(4)] == data


CHANGES = {
    "grown": lambda size, at: _rewritten(lambda data: data + b"G0 X1\n"),
    "truncated": lambda size, at: os.truncate("part.nc", int(at * size)),
    "emptied": lambda size, at: os.truncate("part.nc", 0),
    "overwritten": lambda size, at: _overwritten(int(at * size)),
    "replaced": lambda size, at: _replaced(program(11, 3)),
    "replaced by no program": lambda size, at: _replaced(b"\0" * size),
    "removed": lambda size, at: os.unlink("part.nc"),
    "replaced by a folder": lambda size, at: (os.unlink("part.nc"), os.mkdir("part.nc")),
}


def _rewritten(change):
    with open("part.nc", "rb+") as file:
        data = file.read()
        file.seek(0)
        file.write(change(data))


def _overwritten(at):
    with open("part.nc", "rb+") as file:
        file.seek(at)
        file.write(b"7777 X1\nG91 G0 (")


def _replaced(data):
    with open("new", "wb") as file:
        file.write(data)
    os.replace("new", "part.nc")


@settings(
    max_examples=40, deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip
@given(
    kind=st.sampled_from(sorted(CHANGES)),
    read=st.integers(0, 20),
    at=st.floats(0, 1),
    in_place=st.booleans(),
)
def test_a_program_that_changes_while_it_is_read_is_refused_or_was_read_before(
    tmp_path, kind, read, at, in_place
):
    before = program(30)
    with pytest.MonkeyPatch.context() as patch:
        place = Path(tempfile.mkdtemp(dir=tmp_path))
        patch.chdir(place)
        Path("part.nc").write_bytes(before)
        reads = [read]

        class Changing(files._Input):
            """Changes under the reader's hands, before one of its reads."""

            def readinto(self, buffer):
                if reads[0] == 0:
                    CHANGES[kind](len(before), at)
                reads[0] -= 1
                return super().readinto(memoryview(buffer)[:400])

        patch.setattr(files, "_Input", Changing)
        done = do("part.nc" if in_place else "out.nc", in_place=in_place)
        patch.undo()
        os.chdir(place)
        changed = reads[0] < 0
        output = place / ("part.nc" if in_place else "out.nc")
        left = set(os.listdir(place)) - {"part.nc", "out.nc"}
        assert not left
        if done.error is None:
            result = output.read_bytes()
            # What was written is whole, and belongs to one version of the program.
            versions = [before]
            if not in_place and Path("part.nc").is_file():
                versions.append(Path("part.nc").read_bytes())
            assert any(_proves(version, result) for version in versions)
        else:
            assert changed
            assert "Traceback" not in done.error
            assert "bug" not in done.error
            if not in_place:
                assert not output.exists()


def _proves(original, processed):
    try:
        return verify(original, processed, VMC).ok
    except Exception:
        return False


def test_an_edit_made_during_an_in_place_run_is_not_lost(folder, monkeypatch):
    Path("part.nc").write_bytes(SMALL)
    edited = SMALL + b"(edited)\n"

    def edit(step, done, total):
        if (step, done) == ("verifying", 1):
            _replaced(edited)

    done = run_job(job("part.nc", in_place=True), VMC, Settings(), edit)
    assert "was changed while it was being processed" in done.error
    assert Path("part.nc").read_bytes() == edited


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG])
@pytest.mark.parametrize("room", [0, 1, 100, 8000, -1])
@pytest.mark.parametrize("target", ["part.jerk.nc", "r.json"])
def test_a_disk_that_fills_up_leaves_the_old_output(folder, monkeypatch, error, room, target):
    Path("part.nc").write_bytes(SMALL)
    if room < 0:  # all but the last byte
        assert do(report="r.json").error is None
        room += os.path.getsize(target)
        os.unlink("r.json")
    Path("part.jerk.nc").write_bytes(OLD)
    written = 0

    class Full(files._Output):
        """Takes so many bytes and no more."""

        def write(self, data):
            nonlocal written
            with files._naming(self.path):
                if self.path == target and written + len(data) > room:
                    raise OSError(error, os.strerror(error))
                written += len(data) * (self.path == target)
            return super().write(data)

    monkeypatch.setattr(files, "_Output", Full)
    done = do(report="r.json")
    assert done.error.startswith(f"{target} cannot be written: {os.strerror(error)}")
    assert Path("part.jerk.nc").read_bytes() == OLD
    assert names() == ["part.jerk.nc", "part.nc"]


@pytest.mark.parametrize("call", ["fsync", "chmod", "replace"])
def test_a_refusal_of_the_last_steps_leaves_the_old_output(folder, monkeypatch, call):
    Path("part.nc").write_bytes(SMALL)
    Path("part.jerk.nc").write_bytes(OLD)

    def refuse(*arguments):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as patch:
        patch.setattr(os, call, refuse)
        done = do()
    assert done.error.startswith("part.jerk.nc cannot be written: Input/output error")
    assert Path("part.jerk.nc").read_bytes() == OLD
    assert names() == ["part.jerk.nc", "part.nc"]


def test_a_program_that_cannot_be_read_to_its_end_is_named(folder, monkeypatch):
    Path("part.nc").write_bytes(program(500))
    reads = []

    def fail(self, buffer):
        reads.append(1)
        if len(reads) > 3:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return super(files._Input, self).readinto(buffer)

    monkeypatch.setattr(files._Input, "readinto", lambda self, b: _named(self, fail, b))
    done = do()
    assert done.error.startswith("part.nc cannot be read: Input/output error")
    assert names() == ["part.nc"]


def _named(file, read, buffer):
    try:
        return read(file, buffer)
    except OSError as error:
        raise files._unreadable(file.path, error) from error


@pytest.mark.parametrize("limit", [0, 4096, 30_000])
def test_a_disk_that_is_full_for_a_process_leaves_nothing(folder, limit):
    import resource

    Path("part.nc").write_bytes(SMALL * 1)
    done = subprocess.run(
        COMMAND, capture_output=True, text=True, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
    )  # fmt: skip
    if len(WHOLE) > limit:
        assert done.returncode == 1
        assert "part.jerk.nc cannot be written: File too large" in done.stderr
        assert names() == ["part.nc"]
    assert "Traceback" not in done.stderr


def test_standard_output_on_a_full_disk_is_an_error_without_a_traceback(folder):
    Path("part.nc").write_bytes(SMALL)
    for arguments in (["-o", "-"], ["--diff"], [], ["--check"]):
        with open("/dev/full", "wb") as full:
            done = subprocess.run(
                [*COMMAND, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, check=False
            )
        assert done.returncode == 1, arguments
        assert "No space left on device" in done.stderr
        assert "Traceback" not in done.stderr
        assert "Exception ignored" not in done.stderr


def test_standard_output_that_is_closed_is_an_error_where_the_result_goes_there(folder):
    Path("part.nc").write_bytes(SMALL)
    for arguments, code in ((["-o", "-"], 1), ([], 0)):
        shell = f"exec {shlex.join([*map(str, COMMAND), *arguments])} >&-"
        done = subprocess.run(["sh", "-c", shell], stderr=subprocess.PIPE, text=True, check=False)
        assert done.returncode == code, done.stderr
        assert ("standard output cannot be written" in done.stderr) == bool(code)
    assert Path("part.jerk.nc").exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_that_is_read_only_keeps_its_old_output(folder):
    Path("part.nc").write_bytes(SMALL)
    Path("part.jerk.nc").write_bytes(OLD)
    folder.chmod(0o555)
    done = do()
    folder.chmod(0o755)
    assert done.error.startswith("part.jerk.nc cannot be written: Permission denied")
    assert Path("part.jerk.nc").read_bytes() == OLD
    assert names() == ["part.jerk.nc", "part.nc"]


def test_an_output_that_is_a_folder_is_refused(folder):
    Path("part.nc").write_bytes(SMALL)
    Path("out").mkdir()
    assert do("out").error.startswith("out is a folder")
    assert names("out") == []


def test_an_output_that_is_a_link_to_nothing_is_made_where_it_points(folder):
    Path("part.nc").write_bytes(SMALL)
    Path("link").symlink_to("there.nc")
    assert do("link").error is None
    assert Path("link").is_symlink()
    assert Path("there.nc").read_bytes() == WHOLE


def test_an_output_that_is_a_link_to_itself_is_refused(folder):
    Path("part.nc").write_bytes(SMALL)
    Path("loop").symlink_to("loop")
    assert do("loop").error.startswith("loop cannot be written: ")
    assert Path("loop").is_symlink()
    assert names() == ["loop", "part.nc"]


def test_an_output_whose_name_is_too_long_is_refused(folder):
    Path("part.nc").write_bytes(SMALL)
    assert "cannot be written: File name too long" in do("x" * 300).error
    assert "cannot be written" in do("a\0b").error
    assert names() == ["part.nc"]


def test_an_output_that_is_a_pipe_gets_the_whole_output_or_nothing(folder):
    os.mkfifo("pipe")
    Path("part.nc").write_bytes(SMALL)
    reader = subprocess.Popen(["cat", "pipe"], stdout=subprocess.PIPE)
    assert do("pipe").error is None
    assert reader.communicate()[0] == WHOLE
    Path("part.nc").write_bytes(SMALL + b"\0")
    reader = subprocess.Popen(["cat", "pipe"], stdout=subprocess.PIPE)
    assert "0x00" in do("pipe").error
    reader.kill()
    assert reader.communicate()[0] == b""


def test_two_in_place_runs_at_once_leave_one_whole_program(folder):
    data = program(200)
    whole = process(data, VMC).output
    for _ in range(2):
        Path("part.nc").write_bytes(data)
        both = [
            subprocess.Popen([*COMMAND, "--in-place"], stderr=subprocess.PIPE, text=True,
                             stdout=subprocess.DEVNULL)
            for _ in range(2)
        ]  # fmt: skip
        told = [run.communicate()[1] for run in both]
        assert Path("part.nc").read_bytes() == whole
        assert names() == ["part.nc"]
        assert 0 in [run.returncode for run in both]
        assert not any("Traceback" in err for err in told)
