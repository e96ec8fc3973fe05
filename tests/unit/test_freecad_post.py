"""The post-processor for FreeCAD without FreeCAD: stand-ins for its modules; installing it."""

import ast
import importlib.util
import os
import stat
import sys
import types
from pathlib import Path

import pytest

from gcodejerk.errors import EmitError
from gcodejerk.hosts.command import own_command
from gcodejerk.hosts.freecad.install import install_post, macro_folders, remove_post

SOURCE = Path(__file__).parents[2] / "gcodejerk" / "hosts" / "freecad" / "gcodejerk_post.py"
PROGRAM = "G21 G90 G94 G64\r\nG0 X0 Y0 Z0\r\nG0 Z1. (up)\r\nG1 X5 F100\r\nG0 X40\r\nM2\r\n"


def load(path=SOURCE):
    """As FreeCAD loads a post-processor: from its file, under its own name."""
    spec = importlib.util.spec_from_file_location("gcodejerk_post", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def stock(monkeypatch):
    """A stock post-processor `plain` that writes a program, and what it was called with."""
    calls = []

    def export(objects, filename, arguments):
        calls.append((objects, arguments))
        with open(filename, "w", newline="") as file:
            file.write(PROGRAM)

    module = types.ModuleType("PathScripts.post.plain_post")
    module.export = export
    for name in ("PathScripts", "PathScripts.post"):
        package = types.ModuleType(name)
        package.__path__ = []
        monkeypatch.setitem(sys.modules, name, package)
    monkeypatch.setitem(sys.modules, "PathScripts.post.plain_post", module)
    for name in ("GCODEJERK", "GCODEJERK_MACHINE"):
        monkeypatch.delenv(name, raising=False)
    return calls


@pytest.fixture
def installed(tmp_path):
    folder = tmp_path / "Macro"
    folder.mkdir()
    install_post(str(folder), own_command(), "vmc", "plain")
    return folder / "gcodejerk_post.py"


def script(path, text):
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_a_function_posts_rewrites_and_keeps_line_ends(stock, installed, tmp_path):
    target = tmp_path / "Teil ä's.ngc"
    text = load(installed).export(["fixture"], str(target), "--comments 'a b' --inches")
    assert stock == [(["fixture"], "--comments 'a b' --inches")]
    data = target.read_bytes()
    assert b"gcodejerk stamp" in data
    assert data.count(b"\n") == data.count(b"\r\n")
    assert text == data.decode()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["Macro", target.name]


def test_a_function_given_no_name_returns_the_program(stock, installed, tmp_path):
    assert "gcodejerk stamp" in load(installed).export([], "-", "")
    assert [p.name for p in tmp_path.iterdir()] == ["Macro"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("--exe /nothing/gcodejerk", "not found at /nothing/gcodejerk"),
        ("--exe /bin/false", "exit status 1"),
        ("--base nowhere", "no post-processor nowhere"),
        ("--base gcodejerk", "in front of gcodejerk"),
        ("--machine", "has no value"),
        ("--machine nothing.yaml", "nothing.yaml"),
        ("--jerk-options '--profile nonsense'", "nonsense"),
    ],
)
def test_what_fails_is_raised_and_an_earlier_program_stays(
    stock, installed, tmp_path, arguments, says
):
    target = tmp_path / "part.ngc"
    target.write_text("earlier")
    module = load(installed)
    with pytest.raises(module.GcodejerkPostError, match=says):
        module.export([], str(target), arguments)
    assert target.read_text() == "earlier"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["Macro", "part.ngc"]


def test_an_output_folder_that_is_missing_is_raised(stock, installed, tmp_path):
    module = load(installed)
    with pytest.raises(module.GcodejerkPostError, match="cannot be written"):
        module.export([], str(tmp_path / "none" / "part.ngc"), "")


def test_an_empty_program_and_no_machine_are_refused(stock, tmp_path):
    module = load()
    with pytest.raises(module.GcodejerkPostError, match="no machine file"):
        module.export([], str(tmp_path / "part.ngc"), "--base plain --exe /bin/true")
    with pytest.raises(module.GcodejerkPostError, match="an empty program"):
        module.rewritten(b" \n", module.Options("--machine vmc"), "part.ngc")


def test_the_command_gets_a_clean_environment_and_other_words(stock, tmp_path, monkeypatch):
    # The words are kept; the program is copied to where it is wanted.
    fake = script(
        tmp_path / "fake gcodejerk",
        f'echo "$@" > "{tmp_path}/words"; env > "{tmp_path}/env"\n'
        'while [ "$1" != -o ]; do shift; done; cp "$4" "$2"',
    )
    monkeypatch.setenv("PYTHONHOME", "/nowhere")
    monkeypatch.setenv("LD_LIBRARY_PATH", "/nowhere")
    monkeypatch.setenv("GCODEJERK", str(fake))
    monkeypatch.setenv("GCODEJERK_MACHINE", "router")
    load().export([], str(tmp_path / "part.ngc"), "--base=plain --jerk-options='--strict'")
    words = (tmp_path / "words").read_text().split()
    assert words[:4] == ["process", "--machine", "router", "--strict"]
    names = {line.partition("=")[0] for line in (tmp_path / "env").read_text().splitlines()}
    assert not names & {"PYTHONHOME", "LD_LIBRARY_PATH"}
    assert (tmp_path / "part.ngc").read_bytes() == PROGRAM.encode()


class Processor:
    """A stand-in for Path.Post.Processor.PostProcessor of FreeCAD 1.0: what of it is used."""

    def __init__(self, job, tooltip, tooltipargs, units, *args, **kwargs):
        self._job, self._units = job, units

    @property
    def tooltip(self):
        raise NotImplementedError  # as FreeCAD's own does: each post has to say it


class Factory:
    """A stand-in for its PostProcessorFactory: a stock post-processor `plain`, by sections."""

    @staticmethod
    def get_post_processor(job, name):
        class Plain:
            def export(self):
                given = job["job"] if isinstance(job, dict) else job
                given.seen = given.PostProcessorArgs
                text = PROGRAM.replace("\r\n", "\n")
                return [("G54", text), ("allitems", "\n\n" + text), ("none", None)]

        return Plain() if name == "plain" else None


@pytest.fixture
def one(monkeypatch, stock, installed):
    """Our file as FreeCAD 1.0 loads it, in front of the stand-ins."""
    for name in ("Path", "Path.Post", "Path.Post.Processor"):
        package = types.ModuleType(name)
        package.__path__ = []
        monkeypatch.setitem(sys.modules, name, package)
    processor = sys.modules["Path.Post.Processor"]
    processor.PostProcessor, processor.PostProcessorFactory = Processor, Factory
    return load(installed)


@pytest.mark.parametrize("selected", [False, True])
def test_the_class_rewrites_each_section_and_gives_the_arguments_back(one, selected):
    job = types.SimpleNamespace(PostProcessorArgs="--machine router --no-header", seen=None)
    post = one.Gcodejerk({"job": job, "operations": []} if selected else job)
    sections = post.export()
    assert [part for part, _ in sections] == ["G54", "allitems", "none"]
    assert sections[2][1] is None
    for _, text in sections[:2]:
        # Two empty lines in front: 1.0 takes them away, and leaves the line ends alone.
        assert text.startswith("\n\n")
        assert text[2] != "\n"
        assert "gcodejerk stamp" in text
    assert job.seen == "--no-header"
    assert job.PostProcessorArgs == "--machine router --no-header"
    assert "--base NAME" in post.tooltipArgs
    assert "gcodejerk" in post.tooltip
    assert issubclass(one.Gcodejerk, Processor)


def test_a_class_that_fails_gives_the_arguments_back(one):
    job = types.SimpleNamespace(PostProcessorArgs="--base nowhere --x")
    with pytest.raises(one.GcodejerkPostError, match="no post-processor nowhere"):
        one.Gcodejerk(job).export()
    assert job.PostProcessorArgs == "--base nowhere --x"


def test_the_file_imports_nothing_of_ours_and_keeps_to_python_38():
    tree = ast.parse(SOURCE.read_bytes(), feature_version=(3, 8))
    names = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import)
             for alias in node.names}  # fmt: skip
    names |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert {name.partition(".")[0] for name in names} <= sys.stdlib_module_names | {"__future__"}


def test_it_goes_in_once_and_out_again(command, tmp_path):
    folder = tmp_path / "Macro"
    folder.mkdir()
    assert command("install", "freecad", folder, "-m", "vmc")[0] == 0
    first = (folder / "gcodejerk_post.py").read_bytes()
    assert b"MACHINE = 'vmc'" in first
    assert b"nothing was changed" in command("install", "freecad", folder, "-m", "vmc")[1].encode()
    command("install", "freecad", folder, "-m", "router", "--base", "grbl")
    second = (folder / "gcodejerk_post.py").read_bytes()
    assert b"MACHINE = 'router'\nBASE = 'grbl'" in second
    assert command("install", "freecad", folder, "--remove")[0] == 0
    assert list(folder.iterdir()) == []
    assert "nothing of gcodejerk" in command("install", "freecad", folder, "--remove")[1]


@pytest.mark.parametrize("edited", [True, False])
def test_what_is_not_ours_is_left_alone(command, tmp_path, edited):
    if edited:
        command("install", "freecad", tmp_path, "-m", "vmc")
    post = tmp_path / "gcodejerk_post.py"
    mine = (post.read_bytes() if edited else b"") + b"# my own\n"
    post.write_bytes(mine)
    for words in (("-m", "vmc"), ("--remove",)):
        status, said = command("install", "freecad", tmp_path, *words)
        assert status == 1
        assert ("was edited after" if edited else "was not written by gcodejerk") in said
    assert post.read_bytes() == mine


def test_wrong_words_and_folders_are_refused(command, tmp_path):
    assert command("install", "freecad", tmp_path)[0] == 2
    assert command("install", "freecad", tmp_path, "-m", "vmc", "--form", "filter")[0] == 2
    assert command("install", "freecad", tmp_path / "none", "-m", "vmc")[0] == 1
    assert command("install", "freecad", tmp_path, "-m", "vmc", "--base", "a b")[0] == 1
    (tmp_path / "ro").mkdir(mode=0o555)
    status, said = command("install", "freecad", tmp_path / "ro", "-m", "vmc")
    assert (status, "cannot be written to" in said) == (1, True)


@pytest.fixture
def home(tmp_path, monkeypatch):
    for name in ("FREECAD_USER_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME", "APPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "platform", "linux")
    return tmp_path


def test_macro_folders_are_found_on_each_system(home, monkeypatch):
    with pytest.raises(EmitError, match="no FreeCAD was found"):
        macro_folders(None)
    script(home / "freecad", "")
    data = home / ".local" / "share" / "FreeCAD"
    assert macro_folders(None) == [data / "Macro"]
    (data / "v1-1").mkdir(parents=True)
    assert macro_folders(None) == [data / "Macro", data / "v1-1" / "Macro"]
    (home / ".config" / "FreeCAD").mkdir(parents=True)
    mine = home / "Makros & mehr"
    mine.mkdir()
    (home / ".config" / "FreeCAD" / "user.cfg").write_text(
        f'<FCText Name="MacroPath">{mine}</FCText>'.replace("&", "&amp;")
    )
    assert macro_folders(None)[0] == mine
    monkeypatch.setattr(sys, "platform", "darwin")
    mac = home / "Library" / "Application Support" / "FreeCAD"
    mac.mkdir(parents=True)
    assert macro_folders(None) == [mac / "Macro"]
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("APPDATA", str(home / "Roaming"))
    (home / "Roaming" / "FreeCAD").mkdir(parents=True)
    assert macro_folders(None) == [home / "Roaming" / "FreeCAD" / "Macro"]
    monkeypatch.setenv("FREECAD_USER_HOME", str(home / "own"))
    assert macro_folders(None) == [home / "own"]
    install_post(None, ("gcodejerk",), "vmc")
    assert os.listdir(home / "own") == ["gcodejerk_post.py"]
    assert "removed" in remove_post(None)[0]
