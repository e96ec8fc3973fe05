"""Real FreeCAD posts a CAM job through our post-processor; one run for all, some seconds."""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from gcodejerk.hosts.command import own_command
from gcodejerk.hosts.freecad.install import install_post
from gcodejerk.machine import Machine
from gcodejerk.verification import verify

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
MACHINE = (ROOT / "machines" / "vmc.yaml").read_text()
MACHINE += "\nspindle: mill\nprogram:\n  startup: G94 F100\n"
pytestmark = [
    pytest.mark.freecad,
    pytest.mark.skipif(shutil.which("freecadcmd") is None, reason="FreeCAD is not installed"),
]
BASES = {
    # A program for another control is read as that one's; LinuxCNC's machine stays the machine.
    "linuxcnc": "",
    "grbl": "--translate_drill --jerk-options '--dialect grbl'",
    "fanuc": "--jerk-options '--dialect fanuc'",
    "mach3_mach4": "--jerk-options '--dialect mach'",
}
FAILURES = {
    "no such post": "--base nothing_like_it",
    "no such command": "--exe /nothing/gcodejerk",
    "a command that fails": "--exe /bin/false",
    "no such machine": "--machine /nothing/mill.yaml",
}


@pytest.fixture(scope="module")
def posted(tmp_path_factory):
    """Folder of the programs, the machine, and what became of each."""
    home, out = tmp_path_factory.mktemp("home"), tmp_path_factory.mktemp("Teile für X's")
    machine = home / "Fräse.yaml"
    machine.write_text(MACHINE)
    install_post(str(home), own_command(), str(machine))
    posts = {}
    for base, more in BASES.items():
        stock = re.sub(r"--jerk-options '[^']*'", "", more)
        posts[base] = {
            "arguments": f"--base {base} --no-show-editor {more}", "file": str(out / f"{base}.ngc")
        }  # fmt: skip
        posts[f"stock {base}"] = {
            "processor": base, "arguments": f"--no-show-editor {stock}",
            "file": str(out / f"stock {base}.ngc"),
        }  # fmt: skip
    for name, arguments in FAILURES.items():
        posts[name] = {"arguments": f"--no-show-editor {arguments}", "file": str(out / name)}
    task = {"posts": posts, "answer": str(out / "answer.json")}
    environment = {
        **os.environ,
        "FREECAD_USER_HOME": str(home),
        "GCODEJERK_TASK": json.dumps(task),
        # What a bundle sets for itself, and what would break another Python.
        "PYTHONHOME": "/usr",
        "PYTHONPATH": "/usr/lib/freecad/Mod",
    }
    for name in ("DISPLAY", "GCODEJERK", "GCODEJERK_MACHINE"):
        environment.pop(name, None)
    run = subprocess.run(
        ["freecadcmd", str(HERE / "freecad" / "job.py")], env=environment,
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    return out, Machine.load(machine), json.loads((out / "answer.json").read_text())


@pytest.mark.parametrize("base", BASES)
def test_a_job_is_posted_with_a_stock_post_and_its_rapids_rewritten(posted, base):
    out, machine, answer = posted
    assert answer[base] is None
    program = (out / f"{base}.ngc").read_bytes()
    stock = (out / f"stock {base}.ngc").read_bytes()
    assert b"gcodejerk-" not in program  # no name of a temporary folder
    changes = re.compile(rb"[^\n]*(?:Output Time|stock )[^\n]*\n", re.IGNORECASE)
    times = iter(re.findall(rb"[^\n]*(?:Output Time|ngc)[^\n]*\n", program, re.IGNORECASE))
    stock = changes.sub(lambda _: next(times), stock)
    found = verify(stock, program, machine)
    assert found.ok, found.violations
    assert found.rewritten >= 5


@pytest.mark.parametrize("name", FAILURES)
def test_what_fails_is_raised_in_freecad_and_leaves_no_file(posted, name):
    out, _, answer = posted
    assert answer[name].startswith("GcodejerkPostError: ")
    assert not list(out.glob(f"{name}*"))


def test_messages_in_freecad_say_what_to_do(posted):
    _, _, answer = posted
    assert "--base names one of FreeCAD's" in answer["no such post"]
    assert "--exe /path/of/gcodejerk" in answer["no such command"]
    assert "exit status 1" in answer["a command that fails"]
    assert "mill.yaml" in answer["no such machine"]
