"""The README is true: its commands are run, and what it lists is what there is."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gcodejerk.batch.inputs import SUFFIXES
from gcodejerk.cli import app, machine_app
from gcodejerk.reasons import Reason

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```console\n\$ (gcodejerk [^\n]*)\n(.*?)\n```", README, flags=re.DOTALL)
COMMANDS = [
    *(command.name for command in app.registered_commands),
    *(f"machine {command.name}" for command in machine_app.registered_commands),
]


def plain(text):
    return "\n".join(line.rstrip() for line in text.splitlines()).strip("\n")


@pytest.fixture
def samples(tmp_path):
    shutil.copytree(ROOT / "samples", tmp_path, dirs_exist_ok=True)
    return tmp_path


def test_readme_shows_commands():
    assert len(BLOCKS) >= 5


@pytest.mark.parametrize(("command", "output"), BLOCKS, ids=[command for command, _ in BLOCKS])
def test_readme_block_prints_what_it_shows(command, output, samples):
    here = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    here.pop("COLUMNS", None)
    run = subprocess.run(
        ["bash", "-c", command], cwd=samples, env=here, capture_output=True, text=True, check=False
    )
    assert plain(run.stdout + run.stderr) == plain(output)


@pytest.mark.parametrize("name", COMMANDS)
def test_readme_shows_every_command(name):
    assert f"gcodejerk {name}" in README, f"README.md has no example of `gcodejerk {name}`"


def test_readme_explains_every_reason_and_no_other():
    table = README.split("| reason | means |")[1].split("\n\n")[0]
    assert re.findall(r"^\| `([^`]+)`", table, flags=re.MULTILINE) == [str(r) for r in Reason]


def test_stream_in_the_readme_is_the_samples(samples):
    from gcodejerk.machine import Machine, find_machine
    from gcodejerk.rewrite.pipeline import process

    data = (samples / "plate.ngc").read_bytes()
    output = process(data, Machine.load(find_machine("vmc"))).output.decode().splitlines()
    shown = re.search(r"follow\):\n\n```\n(.*?)```", README, flags=re.DOTALL).group(1).splitlines()
    at = 0
    for line in shown:
        if line != "...":
            assert line in output[at:], line
            at = output.index(line, at) + 1


def test_library_example_of_the_readme_runs(samples):
    code = re.search(r"```python\n(import gcodejerk\n.*?)```", README, flags=re.DOTALL).group(1)
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=samples, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    assert "19 rewritten, 7 left alone" in run.stdout


def test_readme_lists_the_suffixes_by_which_programs_are_known():
    listed = re.search(r"that end in `([^`]*)`", README).group(1).split()
    assert listed == list(SUFFIXES)
