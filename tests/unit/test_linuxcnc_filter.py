"""[FILTER] of LinuxCNC: called as its screens call it, put into an INI and taken out again."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from gcodejerk.batch.files import is_ours
from gcodejerk.errors import EmitError
from gcodejerk.hosts.command import own_command
from gcodejerk.hosts.linuxcnc.filter_lines import ENDINGS, install_filter, remove_filter
from gcodejerk.hosts.linuxcnc.install import install, remove

ROOT = Path(__file__).parents[2]
KIT = ROOT / "tests" / "clients" / "linuxcnc"
PROGRAM = b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1. (up)\nG1 X5 F100\nG0 X40\nM2\n"
PROGRESS = re.compile(rb"^FILTER_PROGRESS=(\d*)$")
COMMAND = ("/opt/my tools/gcodejerk",)


@pytest.fixture
def config(tmp_path):
    shutil.copy(KIT / "sim.ini", tmp_path / "mill.ini")
    shutil.copy(KIT / "sim.hal", tmp_path / "sim.hal")
    return tmp_path / "mill.ini"


def everything(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def open_in_a_screen(line, program, axis=True):
    """What AXIS does with a filter (QtVCP: without the variable); status, program, stderr."""
    env = {k: v for k, v in os.environ.items() if k != "AXIS_PROGRESS_BAR"}
    if axis:
        env["AXIS_PROGRESS_BAR"] = "1"
    quoted = str(program).replace("'", "'\\''")
    with open(program.parent / "loaded", "w+b") as loaded:
        run = subprocess.Popen(
            ["sh", "-c", f"{line} '{quoted}'"],
            stdin=subprocess.PIPE, stdout=loaded, stderr=subprocess.PIPE, env=env, cwd="/",
        )  # fmt: skip
        run.stdin.close()
        said = run.stderr.read().splitlines()
        status = run.wait()
        loaded.seek(0)
        return status, loaded.read(), said


def value(ini, key="ngc"):
    """What LinuxCNC reads in an INI: by its own reader, where it is there."""
    code = f"import linuxcnc; print(linuxcnc.ini({str(ini)!r}).find('FILTER', {key!r}) or '')"
    run = subprocess.run(["/usr/bin/python3", "-c", code], capture_output=True, text=True,
                         check=False)  # fmt: skip
    if run.returncode == 0:
        return run.stdout.rstrip("\n")
    section, found = "", ""
    for line in ini.read_text().splitlines():
        if line.startswith("["):
            section = line
        elif section == "[FILTER]" and line.startswith(f"{key} = ") and not found:
            found = line.partition(" = ")[2]
    return found


def test_a_program_is_opened_as_screens_do_it(config, tmp_path):
    folder = tmp_path / "Franz' Teile"
    folder.mkdir()
    machine = folder / "Fräse.yaml"
    shutil.copy(ROOT / "machines" / "vmc.yaml", machine)
    install_filter(str(config), own_command(), str(machine))
    line = value(config)
    part = folder / "part's top.ngc"
    part.write_bytes(PROGRAM)
    status, loaded, said = open_in_a_screen(line, part)
    assert status == 0
    assert part.read_bytes() == PROGRAM
    assert b"(gcodejerk stamp" in loaded
    assert loaded.endswith(b"G0 X40\nM2\n") or b"\nM2\n" in loaded
    numbers = [int(found[1]) for said_line in said if (found := PROGRESS.match(said_line))]
    assert numbers == sorted(set(numbers))
    assert numbers[-1] == 100
    assert any(b"3 rapids, 2 rewritten" in said_line for said_line in said)

    # What was processed is opened once more; QtVCP asks for no progress.
    done = folder / "done.ngc"
    done.write_bytes(loaded)
    status, again, said = open_in_a_screen(line, done, axis=False)
    assert (status, again) == (0, loaded)
    assert [s for s in said if b"note: processed before; passed on unchanged" in s] == said


def test_what_cannot_be_processed_is_not_loaded_and_says_why(config, tmp_path):
    install_filter(str(config), own_command(), "vmc")
    part = tmp_path / "part.ngc"
    part.write_bytes(b"\x89PNG\r\n\x1a\n")
    status, loaded, said = open_in_a_screen(value(config), part)
    assert status == 1
    assert loaded == b""
    assert b"no NC program but a picture" in b"\n".join(said)


@pytest.mark.parametrize("closed", [False, True])
def test_filter_needs_no_standard_input(tmp_path, closed):
    (tmp_path / "part.ngc").write_bytes(PROGRAM)
    here = "<&-" if closed else "</dev/null"
    line = f"{sys.executable} -m gcodejerk.cli filter -m vmc --progress part.ngc {here}"
    run = subprocess.run(["sh", "-c", line], cwd=tmp_path, capture_output=True, check=False)
    assert run.returncode == 0
    assert b"(gcodejerk stamp" in run.stdout
    assert b"FILTER_PROGRESS=100\n" in run.stderr


def test_filter_says_that_a_processed_program_was_edited_or_is_for_another_machine(
    command, tmp_path
):
    (tmp_path / "part.ngc").write_bytes(PROGRAM)
    command("process", "part.ngc", "-m", "vmc")
    done = tmp_path / "part.jerk.ngc"
    done.write_bytes(done.read_bytes().replace(b"G1 X5 F100", b"G1 X5 F101"))
    status, said = command("filter", "part.jerk.ngc", "-m", "router")
    assert status == 0
    assert "it was edited after it was processed" in said
    assert "another machine file than router.yaml" in said
    assert "G1 X5 F101" in said


def test_filter_refuses_what_is_no_single_program(command, tmp_path):
    (tmp_path / "part.ngc").write_bytes(PROGRAM)
    status, said = command("filter", "-m", "vmc", "--controller", "linuxcnc-hal", "part.ngc")
    assert status == 1
    assert "a screen takes one program" in said
    assert command("filter", "-m", "vmc", "-")[0] == 2


def test_lines_go_in_once_and_out_again_byte_for_byte(config, command):
    before = everything(config.parent)
    status, said = command("install", "linuxcnc", config, "--form", "filter", "--machine", "vmc")
    assert status == 0, said
    after = everything(config.parent)
    assert set(after) - set(before) == {"mill.ini.before-gcodejerk-filter"}
    assert {value(config, ending) for ending in ENDINGS} == {value(config)}
    assert value(config).endswith(" filter --machine vmc")
    again = command("install", "linuxcnc", config, "--form", "filter", "-m", "vmc")
    assert "nothing was changed" in again[1]
    assert everything(config.parent) == after
    other = command("install", "linuxcnc", config, "--form", "filter", "-m", "router")
    assert other[0] == 1
    assert "another filter of gcodejerk" in other[1]
    assert everything(config.parent) == after
    assert command("install", "linuxcnc", config, "--form", "filter", "--remove")[0] == 0
    assert everything(config.parent) == before
    said = command("install", "linuxcnc", config, "--form", "filter", "--remove")[1]
    assert "no filter of gcodejerk is installed" in said


@pytest.mark.parametrize("end", ["\n", "\r\n", "unended"])
@pytest.mark.parametrize("there", [True, False])
def test_line_ends_and_a_missing_section_are_no_trouble(config, end, there):
    text = config.read_text()
    section = "[FILTER]\nPROGRAM_EXTENSION = .py Python\npy = python\n\n# the next one\n"
    text = re.sub(r"\[FILTER\]\n[^\[]*", "", text)
    text = text.replace("[TRAJ]", f"{section}[TRAJ]") if there else text
    if end == "unended":
        text = text.rstrip("\n")
    config.write_bytes(text.encode().replace(b"\n", b"\r\n" if end == "\r\n" else b"\n"))
    before = config.read_bytes()
    install_filter(str(config), COMMAND, "vmc")
    assert value(config).rstrip("\r") == "'/opt/my tools/gcodejerk' filter --machine vmc"
    assert not there or b"# the next one" in config.read_bytes().partition(b"filter end")[2]
    remove_filter(str(config))
    assert config.read_bytes() == before


def included(config, text):
    """The configuration with its [FILTER] in a file of its own."""
    main = re.sub(r"\[FILTER\]\n[^\[]*", "", config.read_text())
    config.write_text(main.replace("[TRAJ]", "#INCLUDE screen.inc\n[TRAJ]"))
    (config.parent / "screen.inc").write_text(text)


def test_lines_go_behind_an_included_section(config, tmp_path):
    included(config, "[DISPLAYED]\nA = 1\n[FILTER]\npng = image-to-gcode\n")
    before = config.read_bytes()
    install_filter(str(config), COMMAND, "vmc")
    main = config.read_text()
    assert "#INCLUDE screen.inc\n# gcodejerk filter begin\nPROGRAM_EXTENSION" in main
    whole = tmp_path / "whole"
    whole.write_text(main.replace("#INCLUDE screen.inc", (tmp_path / "screen.inc").read_text()))
    assert "gcodejerk' filter" in value(whole)
    remove_filter(str(config))
    assert config.read_bytes() == before


@pytest.mark.parametrize(
    ("screen", "says"),
    [
        ("[FILTER]\npng = x\n[OTHER]\nA = 1\n", r"screen.inc:1: \[FILTER\] stands in the included"),
        ("[FILTER]\nngc = mine --fast\n", r"screen.inc:2: programs that end in .ngc are filtered"),
        (None, r"mill.ini:\d+: the file screen.inc that is included here cannot be read"),
    ],
)
def test_an_inclusion_that_does_not_fit_is_refused(config, screen, says):
    included(config, screen or "")
    if screen is None:
        (config.parent / "screen.inc").unlink()
    before = everything(config.parent)
    with pytest.raises(EmitError, match=says):
        install_filter(str(config), COMMAND, "vmc")
    assert everything(config.parent) == before


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("tap = ", "tap = nice ", "another filter of gcodejerk|the configuration was changed"),
        ("# gcodejerk filter end\n", "", "not in pairs"),
        ("tap = '", "tap = mine '", "changed since"),
        ("PROGRAM_EXTENSION = .ngc,", "X = 1\nPROGRAM_EXTENSION = .ngc,", "was edited: X = 1"),
    ],
)
def test_edited_lines_are_not_touched(config, old, new, says):
    install_filter(str(config), COMMAND, "vmc")
    config.write_text(config.read_text().replace(old, new, 1))
    before = everything(config.parent)
    with pytest.raises(EmitError, match=says):
        install_filter(str(config), COMMAND, "vmc")
    assert everything(config.parent) == before


def test_the_filter_and_the_hal_go_in_and_out_in_any_order(config):
    before = everything(config.parent)
    install_filter(str(config), COMMAND, "vmc")
    install(str(config), "adaptive-feed", "2.9")
    remove_filter(str(config))
    install_filter(str(config), COMMAND, "vmc")
    remove(str(config))
    remove_filter(str(config))
    now = everything(config.parent)
    assert now["mill.ini"] == before["mill.ini"]
    assert set(now) == set(before)


@pytest.mark.parametrize("suffix", ["", "-filter"])
def test_a_file_in_the_place_of_the_backup_is_somebodys(config, suffix):
    own = config.with_name(f"{config.name}.before-gcodejerk{suffix}")
    own.write_bytes(b"my notes")
    before = everything(config.parent)
    with pytest.raises(EmitError, match="not what would be kept there"):
        install_filter(str(config), COMMAND, "vmc") if suffix else install(
            str(config), "adaptive-feed", "2.9"
        )
    assert everything(config.parent) == before


def test_a_backup_stays_where_the_ini_was_edited_since(config):
    install_filter(str(config), COMMAND, "vmc")
    config.write_bytes(config.read_bytes() + b"# edited\n")
    assert "was edited since" in remove_filter(str(config))[-1]
    assert config.with_name(f"{config.name}.before-gcodejerk-filter").exists()


@pytest.mark.parametrize(
    ("command_words", "machine", "says"),
    [
        (("/opt/" + "x" * 240,), "vmc", "LinuxCNC reads 250 safely"),
        (COMMAND, "C:\\shop\\mill.yaml", "takes backslashes out"),
        (COMMAND, "/a\nb.yaml", "no line can hold"),
    ],
)
def test_what_an_ini_cannot_hold_is_refused(config, command_words, machine, says):
    before = everything(config.parent)
    with pytest.raises(EmitError, match=says):
        install_filter(str(config), command_words, machine)
    assert everything(config.parent) == before


def test_a_read_only_folder_a_wrong_machine_and_no_ini_are_refused(config, command):
    config.parent.chmod(0o555)
    try:
        status, said = command("install", "linuxcnc", config, "--form", "filter", "-m", "vmc")
    finally:
        config.parent.chmod(0o755)
    assert (status, "cannot be written to" in said) == (1, True)
    assert command("install", "linuxcnc", config, "--form", "filter", "-m", "nix.yaml")[0] == 1
    assert command("install", "linuxcnc", "nix.ini", "--form", "filter", "-m", "vmc")[0] == 1
    assert not is_ours(str(config))
    for words in ((), (config, "--form", "filter"), (config, "--machine", "vmc")):
        assert command("install", "linuxcnc", *words)[0] == 2
