"""The documentation is true: its commands are run, and what it lists is what there is."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

import gcodejerk
from gcodejerk.batch.inputs import SUFFIXES
from gcodejerk.cli import app, machine_app
from gcodejerk.machine import machine_schema
from gcodejerk.reasons import Reason
from tests.unit.test_alike import alike, hold

ROOT = Path(__file__).parents[2]
SPEC = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
GENERATE = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(GENERATE)

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {path.name: path.read_text(encoding="utf-8") for path in GENERATE.COMMANDS_RUN}
WITH_BLOCKS = [name for name, text in PAGES.items() if GENERATE.BLOCK.search(text)]
WITH_CODE = [name for name, text in PAGES.items() if "```python\nimport gcodejerk\n" in text]
COMMANDS = [
    *(command.name for command in app.registered_commands),
    *(f"machine {command.name}" for command in machine_app.registered_commands),
]


@pytest.mark.parametrize("name", WITH_BLOCKS)
def test_commands_print_what_the_page_shows(name, tmp_path):
    for command, shown, printed in GENERATE.outputs(PAGES[name], tmp_path):
        hold(printed.encode(), shown.encode(), command)


@pytest.mark.parametrize("name", GENERATE.PAGES)
def test_pages_that_follow_from_the_code_are_up_to_date(name):
    assert PAGES[name].rstrip("\n") == GENERATE.PAGES[name]().rstrip("\n"), (
        "run docs/generate.py, and look at the difference"
    )


def test_the_readme_is_short_and_shows_a_picture_first():
    lines = README.splitlines()
    assert len(lines) < 200
    assert any(line.startswith("![") for line in lines[:8])
    order = [line for line in lines if line.startswith("## ")]
    assert order == [
        "## Safety", "## Install", "## Your machine", "## Your first program",
        "## Reading the result", "## Your control, and where you post", "## Documentation",
        "## Develop",
    ]  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_shown(name):
    assert any(f"gcodejerk {name}" in text for page, text in PAGES.items() if page != "commands.md")
    assert f"## gcodejerk {name}\n" in PAGES["commands.md"]


def test_every_reason_is_explained_and_no_other():
    rows = re.findall(r"^\| `([^`]+)` \|", PAGES["reasons.md"], flags=re.MULTILINE)
    assert rows == [str(reason) for reason in Reason]


def test_every_key_of_a_machine_file_is_explained():
    def keys(node):
        for name, inner in node.get("properties", {}).items():
            yield name
            yield from keys(inner)
        for key in ("patternProperties", "$defs"):
            for inner in node.get(key, {}).values():
                yield from keys(inner)
        for key in ("anyOf", "oneOf"):
            for inner in node.get(key, ()):
                yield from keys(inner)
        if isinstance(node.get("items"), dict):
            yield from keys(node["items"])

    said = re.findall(r"^\| `[^`]*?([a-z0-9_]+)` \|", PAGES["machine-keys.md"], flags=re.MULTILINE)
    assert {key for key in keys(machine_schema()) if len(key) > 1} <= set(said)


def test_every_link_leads_somewhere():
    pages = PAGES | {
        name: (ROOT / name).read_text(encoding="utf-8")
        for name in ("CONTRIBUTING.md", "CHANGELOG.md", "ARCHITECTURE.md")
    }
    for name, text in pages.items():
        folder = ROOT / "docs" if (ROOT / "docs" / name).exists() else ROOT
        for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"(?s)```.*?```", "", text)):
            if not target.startswith(("http", "#", "mailto")):
                assert (folder / target.split("#")[0]).exists(), f"{name}: {target}"


def test_every_page_is_in_the_site():
    listed = set(re.findall(r"[\w-]+\.md", (ROOT / "mkdocs.yml").read_text()))
    assert listed == {name for name in PAGES if name != "README.md"}


@pytest.mark.parametrize("name", WITH_CODE)
def test_examples_of_the_library_run(name, tmp_path):
    import shutil

    shutil.copytree(ROOT / "samples", tmp_path, dirs_exist_ok=True)
    for code in re.findall(r"```python\n(import gcodejerk\n.*?)```", PAGES[name], flags=re.DOTALL):
        run = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
        assert run.stdout


def test_the_suffixes_by_which_programs_are_known_are_listed():
    listed = re.search(r"that end in `([^`]*)`", PAGES["programs.md"]).group(1).split()
    assert listed == list(SUFFIXES)


def test_the_stream_that_is_shown_is_the_samples():
    from gcodejerk.machine import Machine, find_machine
    from gcodejerk.rewrite.pipeline import process

    data = (ROOT / "samples" / "plate.ngc").read_bytes()
    output = process(data, Machine.load(find_machine("vmc"))).output.splitlines()
    shown = re.search(
        r"follow\):\n\n```text\n(.*?)```", PAGES["programs.md"], flags=re.DOTALL
    ).group(1)
    at = 0
    for line in shown.splitlines():
        if line != "...":
            place = [k for k in range(at, len(output)) if alike(output[k], line.encode())]
            assert place, line
            at = place[0] + 1


def test_the_api_page_has_every_public_name_and_no_other():
    listed = re.findall(r"^        - (\w+)$", (ROOT / "docs" / "api.md").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(gcodejerk.__all__)
