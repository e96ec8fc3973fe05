"""[FILTER] as AXIS reads and calls it: its own function, taken from the installed program."""

import os
import re
import select
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gcodejerk.hosts.command import own_command
from gcodejerk.hosts.linuxcnc.filter_lines import install_filter

KIT = Path(__file__).parent / "linuxcnc"
AXIS = Path("/usr/bin/axis")
INI = """
import linuxcnc
class Ini:
    def find(self, section, key): return linuxcnc.ini({path!r}).find(section, key)
print(Ini().find("FILTER", {key!r}) or "")
"""
pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(not AXIS.is_file(), reason="AXIS is not installed (linuxcnc-uspace)"),
]


class Progress:
    """In the place of AXIS's bar."""

    shown = []  # noqa: RUF012

    def __init__(self, phases, total):
        Progress.shown = []

    def update(self, count, force=0):
        Progress.shown.append(count)

    def set_text(self, text):
        pass

    def done(self):
        pass


class Nothing:
    """In the place of what draws."""

    def update(self):
        pass


@pytest.fixture
def filter_program():
    """AXIS's function, from the expression that finds progress to the end of the function."""
    source = AXIS.read_text(errors="replace")
    begin = source.index("progress_re = re.compile")
    code = source[begin : source.index("\ndef get_filter", begin)]
    names = {
        "re": re, "os": os, "sys": sys, "select": select, "subprocess": subprocess,
        "Progress": Progress, "t": Nothing(), "_": str,
    }  # fmt: skip
    exec(compile(code, "axis", "exec"), names)
    return names["filter_program"]


def find(ini, key):
    """What AXIS finds in an INI, by LinuxCNC's reader."""
    run = subprocess.run(
        ["/usr/bin/python3", "-c", INI.format(path=str(ini), key=key)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return run.stdout.rstrip("\n")


@pytest.mark.parametrize("ending", ["ngc", "NC"])
def test_axis_loads_the_rewritten_program(filter_program, tmp_path, ending):
    folder = tmp_path / "Jo's Teile ü"
    folder.mkdir()
    ini = folder / "mill.ini"
    shutil.copy(KIT / "sim.ini", ini)
    install_filter(str(ini), own_command(), "vmc")
    part = folder / f"part one.{ending}"
    part.write_bytes(b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1.\nG1 X5 F100\nG0 X40\nM2\n")
    loaded = tmp_path / "loaded.ngc"
    status, said = filter_program(find(ini, ending), str(part), str(loaded))
    assert status == 0
    assert b"(gcodejerk stamp" in loaded.read_bytes()
    assert "FILTER_PROGRESS" not in said  # what moves the bar is not shown
    assert "3 rapids, 2 rewritten" in said
    assert Progress.shown == sorted(set(Progress.shown))


def test_axis_shows_why_nothing_is_loaded(filter_program, tmp_path):
    ini = tmp_path / "mill.ini"
    shutil.copy(KIT / "sim.ini", ini)
    install_filter(str(ini), own_command(), "vmc")
    loaded = tmp_path / "loaded.ngc"
    status, said = filter_program(find(ini, "ngc"), str(tmp_path / "none.ngc"), str(loaded))
    assert status == 1
    assert "there is no file" in said
    assert loaded.read_bytes() == b""
