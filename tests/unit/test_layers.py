"""The picture of the package: who may import whom, and what `import gcodejerk` costs.

Imports point left; neighbours separated by a bar do not know each other. So `motion` knows no
files, and `verification` cannot inherit a mistake from what it judges.
"""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import gcodejerk

ROOT = Path(gcodejerk.__file__).parent

PICTURE = """
    _version axes errors units reasons start foreign advice
 <- nc | machine | motion
 <- cycles | planning
 <- studies | emit | verification | testing
 <- expanded splice
 <- pipeline
 <- report
 <- files gather workers batch
 <- cli
"""
LAYERS = [
    [side.split() for side in layer.split("|")]
    for layer in "".join(PICTURE.split("\n")).split("<-")
]
PLACE = {
    name: (depth, side)
    for depth, layer in enumerate(LAYERS)
    for side, names in enumerate(layer)
    for name in names
}
"""Layer and side of the bar, by module or subpackage."""
NEVER = {
    "verification": {"motion", "planning", "emit"},
    "emit": {"verification", "report"},
}
"""What the picture alone would allow, or what matters enough to be said twice."""
SECOND_READER = ("reading", "sorting", "known", "coding", "tracking")
"""Modules of `verification` that read programs without the help of `nc`, but for its tables."""
FOREIGN = {
    "yaml": {"machine"},
    "typer": {"cli"},
    "click": {"cli"},
    "rich": {"cli", "report"},
    "matplotlib": {"report"},
    "hypothesis": {"testing"},
    "scipy": {"motion"},
    "clarabel": {"motion"},
    "platformdirs": {"planning"},
    "threadpoolctl": {"planning", "motion"},
}
"""Packages that only these parts may import; numpy is everyone's."""


def modules():
    """Every module with its source."""
    return sorted(ROOT.rglob("*.py"))


def part_of(path):
    """Module or subpackage directly below `gcodejerk` that a file belongs to."""
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def imports(path):
    """Full names that a module imports, wherever in it: a late import is one too."""
    package = path.relative_to(ROOT.parent).parent.parts
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            home = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*home, *([node.module] if node.module else [])])
            yield module
            # `from gcodejerk import planning` imports a module too.
            yield from (f"{module}.{alias.name}" for alias in node.names)


def own_parts(path):
    """Parts of the package that a module imports."""
    names = (name.split(".") for name in imports(path))
    return {n[1] for n in names if n[0] == "gcodejerk" and len(n) > 1} & set(PLACE)


def allowed(importer, imported):
    """Whether the picture has an arrow from one part to the other."""
    if importer == imported:
        return True
    if imported in NEVER.get(importer, ()):
        return False
    (depth, side), (other_depth, other_side) = PLACE[importer], PLACE[imported]
    return other_depth < depth or (other_depth == depth and other_side == side)


def test_every_module_is_in_the_picture():
    assert {part_of(path) for path in modules()} - {"__init__"} == set(PLACE)


# The front door, gcodejerk/__init__.py, leads everywhere.
BEHIND_THE_DOOR = [path for path in modules() if part_of(path) != "__init__"]


@pytest.mark.parametrize("path", BEHIND_THE_DOOR, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_point_left(path):
    importer = part_of(path)
    wrong = {name for name in own_parts(path) if not allowed(importer, name)}
    assert not wrong, f"{importer} must not import {', '.join(sorted(wrong))}"


@pytest.mark.parametrize(
    ("importer", "imported"),
    [
        ("nc", "machine"),
        ("machine", "nc"),
        ("motion", "nc"),
        ("motion", "machine"),
        ("motion", "planning"),
        ("start", "nc"),
        ("verification", "motion"),
        ("verification", "planning"),
        ("verification", "emit"),
        ("emit", "verification"),
        ("emit", "report"),
        ("planning", "emit"),
        ("pipeline", "cli"),
        ("errors", "nc"),
    ],
)
def test_the_picture_forbids_what_it_is_there_to_forbid(importer, imported):
    assert not allowed(importer, imported)


@pytest.mark.parametrize("name", SECOND_READER)
def test_the_second_reader_shares_nothing_with_the_first_but_the_tables(name):
    own = {f"gcodejerk.verification.second_reading.{other}" for other in SECOND_READER}
    may = own | {"gcodejerk.axes", "gcodejerk.nc.dialects.dialect", "gcodejerk.units"}
    modules = {
        found
        for found in imports(ROOT / "verification" / "second_reading" / f"{name}.py")
        if found.startswith("gcodejerk")
    }
    assert all(any(f"{found}.".startswith(f"{one}.") for one in may) for found in modules), modules


def test_imports_are_found_however_they_are_written(tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "ROOT", tmp_path / "gcodejerk")
    module = tmp_path / "gcodejerk" / "verification" / "sly.py"
    module.parent.mkdir(parents=True)
    module.write_text(
        "from gcodejerk import plan\n"
        "import gcodejerk.planning.stream as s\n"
        "def later():\n    from ..motion.laws import Laws\n"
        "if False:\n    from .. import emit\n"
    )
    assert own_parts(module) == {"planning", "studies", "motion", "emit"}


def test_other_packages_stay_where_they_belong():
    for path in modules():
        for name in imports(path):
            homes = FOREIGN.get(name.split(".")[0])
            assert homes is None or part_of(path) in homes, f"{path.name} imports {name}"


def loaded_by(statement):
    """Modules in a fresh interpreter after a statement."""
    code = f"import sys\n{statement}\nprint(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                              check=True, cwd=ROOT.parent).stdout.split())  # fmt: skip


def test_importing_the_package_loads_none_of_it():
    loaded = loaded_by("import gcodejerk")
    assert "gcodejerk" in loaded
    own = {name for name in loaded if name.startswith("gcodejerk.")}
    assert own == {"gcodejerk._version"}
    assert not loaded & {"numpy", "yaml", "matplotlib", "scipy", "typer", "hypothesis"}


def test_planning_and_processing_load_no_command_line_figures_or_test_tools():
    loaded = loaded_by("import gcodejerk\ngcodejerk.plan_move, gcodejerk.process")
    assert {"gcodejerk.planning.plan", "gcodejerk.pipeline", "numpy"} <= loaded
    assert not loaded & {"matplotlib", "scipy", "typer", "rich", "hypothesis", "pytest"}


def test_every_public_name_has_a_home_that_knows_it():
    homes = {name: home for home, names in gcodejerk._HOMES.items() for name in names}
    assert set(homes) == set(gcodejerk.__all__)
    for name, home in homes.items():
        assert getattr(import_module(home), name).__module__.startswith(home)


@pytest.mark.parametrize(
    "first", ["process", "gcodejerk.report.records", "gcodejerk.motion.residual", "residual"]
)
def test_public_names_stay_what_they_are_whatever_was_imported_before(first):
    before = f"import {first}" if "." in first else f"gcodejerk.{first}"
    loaded_by(f"import gcodejerk\n{before}\n"
              "for name in ('verify', 'process', 'plan_move', 'residual', 'amplitude_map'):\n"
              "    assert callable(getattr(gcodejerk, name)), name")  # fmt: skip


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'optimise'"):
        gcodejerk.optimise  # noqa: B018


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_no_module_is_too_long_to_read_in_one_sitting(path):
    assert path.read_bytes().count(b"\n") <= 450


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(ROOT)))
def test_every_module_says_what_it_owns(path):
    assert ast.get_docstring(ast.parse(path.read_bytes()))
