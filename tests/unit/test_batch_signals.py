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


IMPORTED = """
import os, signal, sys

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            sys.meta_path.remove(self)
            {how}

def interrupt():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(10**6):
        pass

class Hiding:  # up to Python 3.11
    def __set_name__(self, owner, name):
        try:
            interrupt()
        except BaseException as error:
            raise RuntimeError("hidden") from error

sys.meta_path.insert(0, Interrupting())
sys.argv = ["gcodejerk", "machine", "show", "vmc"]
from gcodejerk.cli import main
main()
"""


@pytest.mark.parametrize("name", ["typer", "gcodejerk.cli.proving", "gcodejerk.machine"])
def test_an_interrupt_while_modules_are_imported_is_quiet(name):
    code = IMPORTED.format(name=name, how="interrupt()")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


@pytest.mark.parametrize("name", ["typer", "gcodejerk.machine"])
def test_an_interrupt_that_an_import_hides_is_quiet(name):
    code = IMPORTED.format(name=name, how="type('Made', (), {'one': Hiding()})")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_whoever_imports_the_command_line_keeps_their_answer_to_interrupts():
    code = (
        "import signal, sys; "
        "now = lambda: (signal.getsignal(signal.SIGINT), sys.unraisablehook, sys.excepthook); "
        "before = now(); import gcodejerk.cli; assert before == now()"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
