"""LinuxCNC's interpreter as the tests ask it: `oracle.py`, which forks for each program.

Every program has a process of its own, so that none leaves anything to the next; what all of them
share is Debian's Python with its modules, which takes longer to start than most programs to run.
"""

import atexit
import json
import subprocess
import tempfile
import threading
from functools import cache
from pathlib import Path

HERE = Path(__file__).resolve().parent
PYTHON = "/usr/bin/python3"


class _Server:
    """One process that waits for programs."""

    def __init__(self):
        self.process = subprocess.Popen(
            [PYTHON, HERE / "oracle.py", "--serve"], start_new_session=True, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        self.lock = threading.Lock()
        self.folder = tempfile.TemporaryDirectory(prefix="oracle-")
        atexit.register(self.close)

    def close(self):
        self.process.communicate()
        self.folder.cleanup()

    def ask(self, arguments, timeout):
        """Exit status, or None where time was out, standard output and standard error."""
        out, err = (Path(self.folder.name, name) for name in ("out", "err"))
        asked = {"arguments": arguments, "timeout": timeout, "out": str(out), "err": str(err)}
        with self.lock:
            self.process.stdin.write(json.dumps(asked) + "\n")
            self.process.stdin.flush()
            status = json.loads(self.process.stdout.readline())
            return status, *(path.read_text(errors="replace") for path in (out, err))


_server = cache(_Server)


def run_oracle(path, *arguments, timeout=20):
    """What `oracle.py` makes of a program.

    Parameters
    ----------
    path : Path
        The program.
    *arguments : str or Path
        Further arguments of `oracle.py`.
    timeout : int
        [s]

    Returns
    -------
    subprocess.CompletedProcess
        As if it had been started for this program alone.

    Raises
    ------
    subprocess.TimeoutExpired
        The program is endless, or nearly so.
    """
    command = [str(path), *map(str, arguments)]
    status, out, err = _server().ask(command, timeout)
    if status is None:
        raise subprocess.TimeoutExpired(command, timeout)
    return subprocess.CompletedProcess(command, status, out, err)
