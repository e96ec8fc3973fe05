"""The map and the guide for contributors: every file, name and passage on them is there."""

import ast
import re
from importlib import import_module
from pathlib import Path

import pytest

import gcodejerk

ROOT = Path(gcodejerk.__file__).parent.parent
MAP = (ROOT / "ARCHITECTURE.md").read_text()
GUIDE = (ROOT / "CONTRIBUTING.md").read_text()
QUOTED = sorted(set(re.findall(r"`([^`\n]+)`", MAP + re.sub(r"(?s)```.*?```", "", GUIDE))))
PATHS = [text for text in QUOTED if re.fullmatch(r"[\w.]+(/[\w.]+)*/?", text) and "/" in text]
NAMES = [text for text in QUOTED if re.fullmatch(r"gcodejerk(\.\w+)+", text)]
GROUPS = {"gcodejerk.controllers", "gcodejerk.dialects"}
"""Entry points, which are no modules."""


def resolved(name):
    """What a dotted name stands for; AttributeError or ModuleNotFoundError where it is nothing."""
    parts = name.split(".")
    for n in range(len(parts), 0, -1):
        try:
            found = import_module(".".join(parts[:n]))
        except ModuleNotFoundError:
            continue
        for part in parts[n:]:
            found = getattr(found, part)
        return found
    raise ModuleNotFoundError(name)


def test_there_is_something_to_look_at():
    assert len(PATHS) > 40
    assert len(NAMES) > 15


@pytest.mark.parametrize("path", PATHS)
def test_every_path_on_the_map_is_there(path):
    assert (ROOT / path).exists()


@pytest.mark.parametrize("name", sorted(set(NAMES) - GROUPS))
def test_every_name_on_the_map_is_there(name):
    resolved(name)


def test_every_room_is_on_the_map():
    rooms = {path.parent for path in (ROOT / "gcodejerk").rglob("__init__.py")}
    named = {str(room.relative_to(ROOT)) for room in rooms} - {"gcodejerk"}
    # A room whose rooms are all named needs no line of its own.
    for room in sorted(named, key=len, reverse=True):
        inner = {other for other in named if other.startswith(f"{room}/")}
        assert f"| `{room}` |" in MAP or (inner and all(f"| `{o}` |" in MAP for o in inner)), room


def test_every_module_of_the_ground_is_on_the_map():
    for path in (ROOT / "gcodejerk").glob("*.py"):
        assert path.name.startswith("_") or f"`gcodejerk/{path.name}`" in MAP, path.name


def test_the_picture_is_the_one_that_the_layers_are_tested_by():
    drawn = re.search(r"(?m)^    ground  <-.*$", MAP)[0]
    source = (ROOT / "tests" / "unit" / "test_layers.py").read_text()
    tested = re.search(r'"": order\("""\n(.*?)"""\)', source, flags=re.DOTALL)[1]
    tested = [" ".join(layer.split()) for layer in "".join(tested.split("\n")).split("<-")]
    assert [" ".join(layer.split()) for layer in drawn.split("<-")] == ["ground", *tested[1:]]


@pytest.mark.parametrize(
    ("path", "passage"),
    re.findall(r"`(gcodejerk/[\w/]+\.py)`\n\n```python\n(.*?)```", GUIDE, re.DOTALL),
)
def test_every_passage_of_the_guide_is_from_our_own_code(path, passage):
    assert passage in (ROOT / path).read_text()


def test_the_quick_tests_are_there():
    source = (ROOT / "tests" / "conftest.py").read_text()
    quick = re.search(r"(?s)\nQUICK = (\(.*?\n\))\n", source)[1]
    for name in eval(quick, {}):
        assert (ROOT / "tests" / name).exists(), name


def test_the_guide_and_the_readme_give_the_same_command_for_the_tests():
    readme = (ROOT / "README.md").read_text()
    command = re.search(r"<!-- command: tests -->\n```console\n\$ (.*)\n", readme)[1]
    assert f"`{command}`" in GUIDE


def test_tests_that_are_taken_in_strides_are_there():
    conftest = ast.parse((ROOT / "tests/conftest.py").read_text())
    (table,) = (
        ast.literal_eval(node.value)
        for node in conftest.body
        if isinstance(node, ast.Assign) and node.targets[0].id == "REPEATS"
    )
    assert table
    for module, tests in table.items():
        body = ast.parse((ROOT / "tests" / module).read_text()).body
        assert set(tests) <= {node.name for node in body if isinstance(node, ast.FunctionDef)}
        assert all(every == 0 or every > 1 for every in tests.values())
