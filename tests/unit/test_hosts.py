"""Slicers and hosts that take a text: the words are right, quoted, and the files go in and out."""

import io
import json
import os
import shlex
import subprocess
import sys
import types
from pathlib import Path

import pytest

from gcodejerk.errors import EmitError
from gcodejerk.hosts.catalogue import HOSTS
from gcodejerk.hosts.command import for_windows, machine_word, own_command
from gcodejerk.hosts.slicers import SLICERS, paste_line
from gcodejerk.hosts.snippets import fill
from gcodejerk.hosts.texts import TEXTS, WATCHED

PROGRAM = b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1. (up)\nG1 X5 F100\nG0 X40\nM2\n"
COMMAND = ("/opt/it's mine/gcodejerk",)
WINDOWS = (r"C:\Program Files\100%\gcodejerk.exe",)


def test_without_a_host_all_are_listed(command):
    status, said = command("install")
    assert status == 0
    assert [line.split()[0] for line in said.splitlines()[:-1]] == list(HOSTS)
    assert all("tested" in line or "steps" in line for line in said.splitlines()[:-1])


@pytest.mark.parametrize("host", [name for name in HOSTS if name not in ("linuxcnc", "freecad")])
def test_each_host_names_this_command_and_the_machine(command, tmp_path, host):
    machine = tmp_path / "Fräse.yaml"
    machine.write_bytes(machine_file())
    status, said = command("install", host, "--machine", machine)
    assert status == 0
    assert own_command()[0] in said
    assert str(machine) in said or json.dumps(str(machine)) in said
    assert "@" not in said.replace("@echo", "")
    assert ("UNTESTED" in said or "Not tested" in said) == (host in TEXTS)
    assert command("install", host)[0] == 2
    assert command("install", host, "-m", machine, "--form", "filter")[0] == 2
    assert command("install", host, "-m", machine, "--base", "grbl")[0] == 2
    assert command("install", host, "-m", tmp_path / "none.yaml")[0] == 1


def test_a_host_goes_by_its_short_name_too(command):
    status, said = command("install", "fusion", "--machine", "vmc")
    assert status == 0
    assert (status, said) == command("install", "fusion360", "--machine", "vmc")


def machine_file():
    from gcodejerk.machine import find_machine

    return find_machine("vmc").read_bytes()


@pytest.mark.parametrize("host", TEXTS)
def test_files_go_in_once_and_out_again(command, tmp_path, host):
    folder = tmp_path / "Makros für X"
    folder.mkdir()
    assert command("install", host, folder, "-m", "vmc")[0] == 0
    (file,) = folder.iterdir()
    assert "nothing was changed" in command("install", host, folder, "-m", "vmc")[1]
    assert command("install", host, folder, "-m", "router")[0] == 0
    assert b"router" in file.read_bytes()
    if file.suffix == ".py":
        compile(file.read_bytes(), file.name, "exec")
    edited = file.read_bytes() + b"\n"
    file.write_bytes(edited)
    status, said = command("install", host, folder, "--remove")
    assert (status, "was edited after" in said) == (1, True)
    assert file.read_bytes() == edited
    file.write_bytes(edited[:-1])
    assert command("install", host, folder, "--remove")[0] == 0
    assert list(folder.iterdir()) == []
    assert command("install", host, folder, "--remove")[0] == 0
    assert command("install", host, "--remove")[0] == 2
    assert command("install", host, tmp_path / "none", "-m", "vmc")[0] == 1


def test_in_one_folder_no_host_takes_the_place_of_another(command, tmp_path):
    for host in TEXTS:
        assert command("install", host, tmp_path, "-m", "vmc")[0] == 0
    installed = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert len(installed) == len({str(path).lower() for path in installed}) + 1, "Cura's own name"
    assert len(installed) == len(TEXTS)
    for host in TEXTS:
        assert "nothing was changed" in command("install", host, tmp_path, "-m", "vmc")[1]
        assert command("install", host, tmp_path, "--remove")[0] == 0
        installed = {path: data for path, data in installed.items() if path.exists()}
        assert all(path.read_bytes() == data for path, data in installed.items())
    assert not installed


@pytest.mark.parametrize("host", [name for name, text in TEXTS.items() if text.former])
def test_a_file_under_its_former_name_goes_and_that_of_another_host_stays(command, tmp_path, host):
    text = TEXTS[host]
    assert command("install", host, tmp_path, "-m", "vmc")[0] == 0
    (tmp_path / text.file).rename(tmp_path / text.former)
    status, said = command("install", host, tmp_path, "-m", "router")
    assert (status, f"{text.former}: removed" in said) == (0, True)
    assert [path.name for path in tmp_path.iterdir()] == [text.file]
    (tmp_path / text.file).rename(tmp_path / text.former)
    assert command("install", host, tmp_path, "--remove")[0] == 0
    assert list(tmp_path.iterdir()) == []
    (other,) = (name for name, one in TEXTS.items() if one.file == text.former)
    assert command("install", other, tmp_path, "-m", "vmc")[0] == 0
    before = (tmp_path / text.former).read_bytes()
    assert command("install", host, tmp_path, "-m", "vmc")[0] == 0
    assert command("install", host, tmp_path, "--remove")[0] == 0
    assert (tmp_path / text.former).read_bytes() == before


def test_a_name_that_is_another_hosts_file_is_refused(command, tmp_path):
    # Cura's Gcodejerk.py and OctoPrint's gcodejerk.py, where systems take them for one name.
    assert command("install", "octoprint", tmp_path, "-m", "vmc")[0] == 0
    (tmp_path / "gcodejerk.py").rename(tmp_path / "Gcodejerk.py")
    before = (tmp_path / "Gcodejerk.py").read_bytes()
    status, said = command("install", "cura", tmp_path, "-m", "vmc")
    assert (status, "for octoprint" in said, "another folder" in said) == (1, True, True)
    assert "nothing of gcodejerk" in command("install", "cura", tmp_path, "--remove")[1]
    assert (tmp_path / "Gcodejerk.py").read_bytes() == before


@pytest.mark.parametrize("host", [*SLICERS, *WATCHED])
def test_hosts_without_a_file_take_no_folder(command, tmp_path, host):
    assert command("install", host, tmp_path, "-m", "vmc")[0] == 2
    assert command("install", host, "--remove")[0] == 2


def test_paths_are_quoted_for_each_language():
    machine = r"C:\shop\Müller's mill.yaml"
    line = paste_line(COMMAND, "/home/it's ü/m.yaml", windows=False)
    assert shlex.split(line) == [
        COMMAND[0], "process", "--in-place", "--machine", "/home/it's ü/m.yaml"
    ]  # fmt: skip
    line = paste_line(WINDOWS, machine, windows=True)
    assert line == f'"{WINDOWS[0]}" process --in-place --machine "{machine}"'
    bat = fill("drop.bat", WINDOWS, machine)
    assert r'"C:\Program Files\100%%\gcodejerk.exe" process --machine "C:\shop' in bat
    cps = fill("fusion360.cps", (*WINDOWS, "-m", "gcodejerk.cli"), machine)
    assert r'value:"C:\\Program Files\\100%\\gcodejerk.exe"' in cps
    assert 'execute(exe, "-m gcodejerk.cli process' in cps
    assert for_windows(["a b"]) == '"a b"'
    assert machine_word("vmc") == "vmc"
    with pytest.raises(EmitError, match="slicers take ;"):
        paste_line(("/a;b",), "vmc")
    for text in TEXTS.values():
        with pytest.raises(EmitError, match="no line can hold"):
            fill(text.template, COMMAND, "a\nb.yaml")


def test_in_place_a_program_without_change_is_not_touched(command, tmp_path):
    part = tmp_path / "part.gcode"
    part.write_bytes(b"G21\nG90\nG1 X5 F300\nM2\n")
    before = part.stat()
    status, said = command("process", "--in-place", "-m", "vmc", part)
    assert status == 0
    assert "0 rapids found, nothing to do; the file is as it was" in said
    after = part.stat()
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    assert [p.name for p in tmp_path.iterdir()] == ["part.gcode"]


def test_a_slicers_own_name_is_in_messages_and_reports(command, tmp_path, monkeypatch):
    monkeypatch.setenv("SLIC3R_PP_OUTPUT_NAME", "/home/me/Würfel.gcode")
    part = tmp_path / "tmp-123.gcode.pp"
    part.write_bytes(PROGRAM)
    status, said = command("process", "--in-place", "-m", "vmc", "--report", "reports/", part)
    assert status == 0
    assert "/home/me/Würfel.gcode: 3 rapids, 2 rewritten" in said
    assert "-> /home/me/Würfel.gcode" in said
    assert "tmp-123" not in said
    assert os.listdir(tmp_path / "reports") == ["Würfel.gcode.json"]
    assert b"gcodejerk stamp" in part.read_bytes()
    status, said = command("process", "--in-place", "-m", "vmc", part)
    assert status == 1
    assert "/home/me/Würfel.gcode:1: this program has been processed" in said


def run_template(name, machine, modules, monkeypatch):
    """A script of ours in front of stand-ins for its host's modules."""
    for module, values in modules.items():
        made = types.ModuleType(module)
        made.__path__ = []
        made.__dict__.update(values)
        monkeypatch.setitem(sys.modules, module, made)
        home, _, name_in_it = module.rpartition(".")
        if home:
            setattr(sys.modules[home], name_in_it, made)
    space = {"__name__": "host.scripts.ours", "__package__": "host.scripts"}
    exec(compile(fill(name, own_command(), machine), name, "exec"), space)
    return space


class Script:
    """A stand-in for Cura's class of scripts."""

    def getSettingValueByKey(self, key):  # noqa: N802
        return json.loads(self.getSettingDataString())["settings"][key]["default_value"]


def test_cura_gets_its_layers_back_and_an_error_where_it_is_refused(monkeypatch):
    host = {"host": {}, "host.scripts": {}, "host.Script": {"Script": Script}}
    script = run_template("cura.py", "vmc", host, monkeypatch)["Gcodejerk"]()
    layers = [
        ";Generated\nG21 G90 G94 G64\n",
        ";LAYER:0\nG0 X0 Y0 Z0\nG0 Z1\n",
        ";LAYER:1\nG1 X5 F100\n",
    ]
    out = script.execute(list(layers))
    assert len(out) == 3
    assert [layer.startswith(";LAYER:") for layer in out] == [False, True, True]
    assert "gcodejerk stamp" in out[0]
    assert out[2] == layers[2]
    with pytest.raises(RuntimeError, match="processed by gcodejerk before"):
        script.execute(out)


class File:
    """A stand-in for OctoPrint's files."""

    def __init__(self, filename, stream):
        self.filename, self.data = filename, stream.read()

    def stream(self):
        return io.BytesIO(self.data)


def test_octoprint_gets_a_rewritten_file_or_the_uploaded_one(monkeypatch):
    host = {
        "octoprint": {},
        "octoprint.filemanager": {"valid_file_type": lambda path, type: path.endswith("gcode")},
        "octoprint.filemanager.util": {"StreamWrapper": File},
    }
    plugin = run_template("octoprint.py", "vmc", host, monkeypatch)
    hook = plugin["__plugin_hooks__"]["octoprint.filemanager.preprocessor"]
    given = File("Teil.gcode", io.BytesIO(PROGRAM))
    out = hook("folder/Teil.gcode", given)
    assert b"gcodejerk stamp" in out.data
    assert out.filename == "Teil.gcode"
    assert hook("folder/Teil.gcode", out) is out  # refused: it was processed before
    assert hook("cube.stl", given) is given


def test_the_batch_line_runs_as_it_stands(tmp_path):
    """The words of a POSIX line, in a shell, with the file last."""
    part = tmp_path / "it's ü.nc"
    part.write_bytes(PROGRAM)
    line = paste_line(own_command(), "vmc", windows=False)
    run = subprocess.run(
        ["sh", "-c", f"{line} {shlex.quote(str(part))}"], capture_output=True, check=False
    )
    assert run.returncode == 0
    assert b"gcodejerk stamp" in part.read_bytes()


def test_the_page_on_hosts_has_the_list_as_it_is(command):
    page = (Path(__file__).parents[2] / "docs" / "hosts.md").read_text()
    assert f"$ gcodejerk install\n{command('install')[1]}```" in page
