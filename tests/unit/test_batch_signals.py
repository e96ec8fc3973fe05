"""A signal ends a process in order, wherever Python is when it comes."""

import signal
import subprocess
import sys

import pytest

IN_A_DESTRUCTOR = """
import atexit, os, signal, time
from gcodejerk.batch.signals import exit_on

class Dying:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.001)

exit_on(signal.SIGTERM)
atexit.register(print, "put away")
one = Dying()
del one
time.sleep(30)
print("still there")
"""
IN_THE_OPEN = IN_A_DESTRUCTOR.replace("del one", "os.kill(os.getpid(), signal.SIGTERM)").replace(
    "one = Dying()", ""
)


TWICE = """
import os, signal
from gcodejerk.batch.signals import exit_on

exit_on(signal.SIGTERM)
try:
    os.kill(os.getpid(), signal.SIGTERM)
finally:
    os.kill(os.getpid(), signal.SIGTERM)
    print("put away")
"""


@pytest.mark.parametrize(
    "code", [IN_THE_OPEN, IN_A_DESTRUCTOR, TWICE], ids=["open", "destructor", "twice"]
)
def test_a_signal_ends_the_process_and_what_is_registered_is_put_away(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (143, "put away\n", "")


def test_an_interrupt_that_python_drops_comes_again():
    code = IN_A_DESTRUCTOR.replace("os.getpid(), signal.SIGTERM", "os.getpid(), signal.SIGINT")
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=20
    )
    assert done.returncode == -signal.SIGINT
    assert done.stdout == "put away\n"
    assert "ignored" not in done.stderr


def test_other_errors_that_nobody_can_raise_are_told_as_before():
    code = IN_A_DESTRUCTOR.replace("os.kill(os.getpid(), signal.SIGTERM)", "1 / 0", 1)
    code = code.replace("time.sleep(30)", "")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "ZeroDivisionError" in done.stderr
