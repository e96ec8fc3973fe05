"""One program, whoever works on it: output, report and summary are the same to the byte."""

import io
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gcodejerk import Machine, find_machine
from gcodejerk.batch import pool as module
from gcodejerk.batch.jobs import Job, run_job
from gcodejerk.batch.pool import LostError, Pool
from gcodejerk.batch.reports import record_of
from gcodejerk.planning import designs, stream
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.report.records import dump
from gcodejerk.rewrite import pieces
from gcodejerk.rewrite.pipeline import Settings, process_file
from gcodejerk.spread import here
from gcodejerk.verification import proof, sections
from gcodejerk.verification.bytes.source import Window

VMC = Machine.load(find_machine("vmc"))
ROUTER = Machine.load(find_machine("router"))


def program(holes):
    """Drawn places, some of them twice, and ways that come again."""
    places = np.random.default_rng(31).uniform((-250, -250, -100), 0, (holes, 3)).round(3)
    lines = ["G21 G90 G94 G17 G40 G64", "G0 X0 Y0 Z0", "F600"]
    for k, (x, y, z) in enumerate(places.tolist()):
        lines += [f"G0 X{x} Y{y}", f"G0 Z{z}", f"G1 X{x + 0.5:.3f}", "G0 Z0"]
        lines += [f"G0 X{k % 3} Y-5"] if k % 4 == 0 else []
    return "\n".join([*lines, "M2", ""]).encode()


@pytest.fixture(scope="module")
def pool():
    """Three that work together from the first piece on."""
    with pytest.MonkeyPatch.context() as patch, Pool(3) as pool:
        pool.call(abs)
        pool.wait_for_all()
        answer = module._Worker.answer
        patch.setattr(
            module._Worker,
            "answer",
            lambda worker: (pool.answered.append(worker), answer(worker))[1],
        )
        pool.answered = []
        yield pool
    assert not multiprocessing.active_children()


@pytest.fixture
def small(monkeypatch):
    """Pieces so small that a small program has many, and their numbers."""
    monkeypatch.setattr(designs, "AT_ONCE", 3)
    monkeypatch.setattr(stream, "WINDOW_SAMPLES", 3000)
    monkeypatch.setattr(stream, "BATCH_SAMPLES", 1 << 10)
    monkeypatch.setattr(sections, "SECTION", 1 << 13)


def outcome(data, machine, controller, spread):
    """All that a user gets."""
    # What a search remembers of the last run would be no work.
    for search in (designs._four_segments, designs._symmetric):
        designs._remembered(search).clear()
    target, beside, source = io.BytesIO(), io.BytesIO(), io.BytesIO(data)
    settings = Settings(controller=controller)
    result = process_file(source, target, machine, settings, "x.nc", None, beside, spread)
    record = dump(record_of(result, machine, "out.nc", source, bounds=False))
    return target.getvalue(), beside.getvalue(), record, result.verification


@pytest.mark.parametrize(
    ("machine", "controller"),
    [(VMC, "linuxcnc"), (VMC, "grbl"), (VMC, "csv"), (VMC, "linuxcnc-hal"), (ROUTER, "haas")],
    ids=str,
)
def test_the_same_bytes_with_one_process_and_with_three(machine, controller, pool, small):
    data, done = program(16), []

    def spread(function, parts):
        for answer in pool.map(function, parts):
            done.append(type(function).__name__)
            yield answer

    one = outcome(data, machine, controller, here)
    three = outcome(data, machine, controller, spread)
    assert one == three
    assert one[3].rewritten > 30
    assert set(pool.workers) == set(pool.answered)
    pool.answered.clear()
    assert done.count("partial") > 5
    if controller != "linuxcnc-hal":
        assert done.count("Maker") > 5
    if controller in ("linuxcnc", "grbl"):
        assert done.count("Judge") > 5


@pytest.mark.parametrize("controller", ["grbl", "linuxcnc"])
def test_a_stream_rests_first_where_the_one_in_front_is_not_written_after_all(
    controller, small, monkeypatch
):
    """Long rapids are made behind the short ones of their window, and in other pieces."""
    make = pieces.make_batch

    def ruling_out(plans, moves, *more):
        batch = make(plans, moves, *more)
        long = plans.length[batch.moves] > 150.0
        plans.reason[batch.moves[long]] = REASONS.index(Reason.NOT_BETTER)
        return batch.take(np.flatnonzero(~long))

    monkeypatch.setattr(pieces, "make_batch", ruling_out)
    output, _, _, verified = outcome(program(16), VMC, controller, here)
    assert verified.ok
    assert 15 < verified.rewritten < 45
    if controller == "grbl":
        rests = len(re.findall(rb"\nG0 X\S+ Y\S+\n\(gcodejerk: [^)]*\)\nG4 P0\n", output))
        assert rests > 2


def edited(data, controller="linuxcnc"):
    """An output, and where its streams are."""
    target = io.BytesIO()
    settings = Settings(controller=controller, verify=False)
    result = process_file(io.BytesIO(data), target, VMC, settings, "x.nc")
    return target.getvalue(), result.edits


def summed(output):
    """An output with the sum that is its own."""
    window = Window(io.BytesIO(output))
    window.take(len(output))
    return output.replace(window.claimed.encode(), window.sum.encode(), 1)


def judged(data, output, edits, controller="linuxcnc"):
    machine = replace(VMC, controller=controller)
    files = io.BytesIO(data), io.BytesIO(output)
    return proof.verify_files(*files, machine, spread=here, edits=edits)


@pytest.mark.parametrize("controller", ["linuxcnc", "grbl"])
def test_sections_find_what_the_whole_does(controller, small, monkeypatch):
    data = program(8)
    output, edits = edited(data, controller)
    said = []
    found = sections.judge_sections

    def told(*given):
        said.append(found(*given))
        return said[-1]

    monkeypatch.setattr(proof, "judge_sections", told)
    whole = judged(data, output, None, controller)
    assert whole.ok
    assert not said
    assert judged(data, output, edits, controller) == whole
    assert said.pop() is not None
    # A digit of any place, a line taken out, one put in twice, text behind the end.
    rng = np.random.default_rng(3)
    at = output.index(b"sum:") + 4
    damages = [output + b"G0 X1\n", output[:-3]]
    damages.append(output[:at] + (b"1" if output[at] == ord("0") else b"0") + output[at + 1 :])
    for at in rng.integers(0, len(output), 4).tolist():
        line = slice(output.rfind(b"\n", 0, at) + 1, output.find(b"\n", at) + 1)
        text = output[line]
        digit = re.sub(rb"\d", lambda m: b"%d" % ((int(m[0]) + 1) % 10), text, count=1)
        for new in (b"", text * 2, digit):
            damages.append(summed(output[: line.start] + new + output[line.stop :]))
    for damaged in damages:
        shifted = edits.copy()
        shifted[shifted[:, 0] > len(damaged) // 2, :2] += len(damaged) - len(output)
        expected = judged(data, damaged, None, controller)
        for hint in (edits, shifted):
            assert judged(data, damaged, hint, controller) == expected


def test_wrong_hints_prove_nothing_and_hide_nothing(small):
    data = program(8)
    output, edits = edited(data)
    whole = judged(data, output, None)
    rng = np.random.default_rng(5)
    # One stream is another's: wherever files are cut, somebody has to see it.
    (a, b, _), (c, d, _) = edits[8], edits[15]
    swapped = output[:a] + output[c:d] + output[b:c] + output[a:b] + output[d:]
    swapped = summed(swapped)
    expected = judged(data, swapped, None)
    assert not expected.ok
    beyond = edits.copy()
    beyond[-1, 2] = 10**6
    assert judged(data, output, beyond) == whole
    for _ in range(6):
        hint = edits.copy()
        hint[:, rng.integers(0, 3)] += rng.integers(-40, 40, len(hint))
        hint = hint[rng.random(len(hint)) < 0.8]
        assert judged(data, output, hint) == whole
        assert judged(data, swapped, hint) == expected


def test_what_a_section_takes_for_granted_has_to_be_found_in_front_of_it(small, monkeypatch):
    """Behind a rapid that is left alone a stream has to rest first; a hint may deny that."""
    hole = b"G0 X%d Y%d\nG1 Z-3\nG0 Z5\nG0 Z4.99\n"
    data = b"G21 G90 G94 G17 G40 G64\nG0 X0 Y0 Z5\nF100\n"
    data += b"".join(hole % (-9 * k - k * k, -7 * k) for k in range(40))
    output, edits = edited(data, "grbl")
    edits = edits[[output.startswith(b"(gcodejerk: G0 X", at) for at in edits[:, 0]]]
    cuts_of, cuts, denied = sections._cuts, [], []

    def denying(*given):
        found = cuts_of(*given)
        cuts.extend(found[1:, 1].tolist())
        found[np.isin(found[:, 1], denied), 2] = 1
        return found

    monkeypatch.setattr(sections, "_cuts", denying)
    assert judged(data, output, edits, "grbl").ok
    rests = [at for at in cuts if b"\nG4 P0\n" in output[at : at + 60]]
    assert rests
    for at in rests[:3]:
        denied[:] = [at]
        without = output[:at] + output[at:].replace(b"G4 P0\n", b"", 1)
        moved = edits - len(b"G4 P0\n") * (edits > at) * np.array([1, 1, 0])
        assert not judged(data, summed(without), moved, "grbl").ok


def test_the_death_of_one_writes_nothing(tmp_path):
    source, output = tmp_path / "part.nc", tmp_path / "out.nc"
    source.write_bytes(program(4))

    def dying(function, parts):
        raise LostError(-9)
        yield

    job = Job(str(source), str(output), None, "write", in_place=False, strict=False)
    done = run_job(job, VMC, Settings(), None, dying)
    assert "the process that worked on it died (signal 9)" in done.error
    assert [path.name for path in tmp_path.iterdir()] == ["part.nc"]


def children(pid):
    """Processes that work for another."""
    try:
        found = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        return [int(k) for k in found if b"spawn_main" in Path(f"/proc/{k}/cmdline").read_bytes()]
    except OSError:
        return []


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="no /proc to see processes in")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_run_that_is_cut_leaves_nothing_half_written_and_nobody_behind(tmp_path, number):
    (tmp_path / "part.nc").write_bytes(program(500))
    command = [sys.executable, "-m", "gcodejerk.cli", "process", "part.nc", "-m", "vmc"]
    run = subprocess.Popen(
        [*command, "--jobs", "2"], cwd=tmp_path, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not (workers := children(run.pid)):
        assert run.poll() is None, "it never took a second process"
        time.sleep(0.02)
    time.sleep(0.3)  # while it starts somebody, it does not listen
    if number == signal.SIGINT:  # as a terminal does, to all
        os.killpg(run.pid, number)
    else:
        os.kill(workers[0], number)
    _, err = run.communicate(timeout=60)
    assert run.returncode == (130 if number == signal.SIGINT else 1)
    assert "Traceback" not in err
    assert ("died (signal 9)" in err) == (number == signal.SIGKILL)
    assert [path.name for path in tmp_path.iterdir()] == ["part.nc"]
    assert not any(Path(f"/proc/{worker}").exists() for worker in workers)
