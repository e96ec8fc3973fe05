"""Workers answer in order, and one that dies costs only its own job."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time

import pytest

from gcodejerk.batch.workers import map_jobs


def act(job):
    """What a test wants a worker to do."""
    kind, value = job
    if kind == "wait":
        time.sleep(value)
    elif kind == "die":
        os.kill(os.getpid(), value)
    elif kind == "exit":
        os._exit(value)
    return kind, value


def lost(job, status):
    return "lost", job, status


def none_left():
    return not multiprocessing.active_children()


def test_answers_come_in_the_order_of_the_jobs():
    jobs = [("wait", 0.5), ("", 1), ("", 2), ("wait", 0.1), ("", 3)]
    assert list(map_jobs(act, jobs, 3, lost)) == jobs
    assert none_left()


@pytest.mark.parametrize("workers", [1, 2])
def test_the_death_of_a_worker_is_told_of_its_job_and_the_others_are_done(workers):
    jobs = [("", 1), ("die", signal.SIGKILL), ("", 2), ("exit", 7), ("", 3), ("", 4)]
    found = list(map_jobs(act, jobs, workers, lost))
    assert found == [
        ("", 1), ("lost", jobs[1], -9), ("", 2), ("lost", jobs[3], 7), ("", 3), ("", 4)
    ]  # fmt: skip
    assert none_left()


def test_no_jobs_are_no_work():
    assert list(map_jobs(act, [], 4, lost)) == []


def test_who_stops_listening_stops_the_workers():
    answers = map_jobs(act, [("", 1), ("wait", 60), ("wait", 60)], 2, lost)
    assert next(answers) == ("", 1)
    begun = time.monotonic()
    answers.close()
    assert time.monotonic() - begun < 30
    assert none_left()


MASTER = """
import os, time
from gcodejerk.batch.workers import map_jobs

def act(job):
    os.write(1, b"%d\\n" % os.getpid())  # in one piece: two workers write to one pipe
    time.sleep(job)

if __name__ == "__main__":
    list(map_jobs(act, [0.5] * 50, 2, print))
"""


def test_workers_end_when_their_master_is_killed(tmp_path):
    (tmp_path / "master.py").write_text(MASTER)
    master = subprocess.Popen(
        [sys.executable, "master.py"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    pids = {int(master.stdout.readline()) for _ in range(3)}
    master.kill()
    master.wait()
    # Read to the end: the pipe closes only when the last worker has gone.
    pids |= set(map(int, master.stdout.read().split()))
    assert len(pids) == 2
