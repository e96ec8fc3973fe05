"""The picture of the package: who may import whom, and what `import gcodejerk` costs.

Imports point left; neighbours separated by a bar do not know each other. So `motion` knows no
files, and `verification` cannot inherit a mistake from what it judges. The same holds within each
room, and no circle of modules exists anywhere.
"""

import ast
import subprocess
import sys
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest

import gcodejerk

ROOT = Path(gcodejerk.__file__).parent


def order(picture):
    """Layer and side of the bar, by the name of a part."""
    layers = [
        [side.split() for side in layer.split("|")]
        for layer in "".join(picture.split("\n")).split("<-")
    ]
    return {
        name: (depth, side)
        for depth, layer in enumerate(layers)
        for side, names in enumerate(layer)
        for name in names
    }


ROOMS = {
    "": order("""
    _version axes errors units reasons start advice storage spread
 <- nc | machine | motion
 <- cycles | unrolling | planning
 <- studies | parameters | verification | testing | identification | simulation
 <- emit
 <- rewrite
 <- report
 <- batch
 <- hosts
 <- cli
"""),
    "motion": order("""
    profiles
 <- families residual
 <- amplitudes sampling shapers
 <- maps rounding | search | servo | threads
"""),
    "machine": order("""
    drives subprograms
 <- parts problems reading
 <- spectrum find
 <- file
 <- model | sources
"""),
    "nc": order("""
    dialects
 <- text
 <- interpreter
 <- flow
 <- reader
 <- following_reader
 <- program
 <- feed_moves line_map
"""),
    "verification": order("""
    findings
 <- bytes
 <- physics | second_reading
 <- cycles unrolling | table samples settings | rows | reported | streams
 <- sections
 <- proof
"""),
}
"""Room -> its parts in the order in which they may import; the package itself is ``""``."""
NEVER = {
    "verification": {"motion", "planning", "emit", "cycles", "unrolling"},
    "emit": {"verification", "report"},
}
"""What the picture alone would allow, or what matters enough to be said twice."""
SECOND_READER = (
    *("reading", "sorting", "known", "coding", "drilling", "circling", "tracking"),
    *("operating", "worth", "computing", "routes", "walking", "klartext", "straight", "limiting"),
    *("lengths", "parameters", "labelled", "stepping", "joining", "ahead", "unread"),
)
"""Modules of `verification` that read programs without the help of `nc`, but for its tables."""
FOREIGN = {
    "yaml": {"machine"},
    "typer": {"cli"},
    "click": {"cli"},
    "rich": {"cli", "report"},
    "matplotlib": {"report"},
    "hypothesis": {"testing"},
    "scipy": {"motion"},
    "pyuff": {"identification"},
    "zstandard": {"identification"},
    "clarabel": {"motion"},
    "daqp": {"motion"},
    "platformdirs": {"planning"},
    "threadpoolctl": {"planning", "motion"},
}
"""Packages that only these parts may import; numpy is everyone's."""


def modules():
    """Every module with its source."""
    return sorted(ROOT.rglob("*.py"))


def part_of(path, room=""):
    """Module or room directly within a room that a file belongs to; None where it is not in it."""
    parts = ("gcodejerk", *path.relative_to(ROOT).with_suffix("").parts)
    home = ("gcodejerk", room) if room else ("gcodejerk",)
    if parts[: len(home)] != home or len(parts) == len(home):
        return None
    return parts[len(home)]


@cache
def imports(path):
    """Full names that a module imports, wherever in it: a late import is one too."""
    return tuple(_imports(path))


def _imports(path):
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


def own_parts(path, room=""):
    """Parts of a room that a module imports."""
    home = ["gcodejerk", room] if room else ["gcodejerk"]
    names = (name.split(".") for name in imports(path))
    parts = {n[len(home)] for n in names if n[: len(home)] == home and len(n) > len(home)}
    return parts & set(ROOMS[room])


def allowed(importer, imported, room=""):
    """Whether the picture of a room has an arrow from one part to the other."""
    if importer == imported:
        return True
    if not room and imported in NEVER.get(importer, ()):
        return False
    (depth, side), (other_depth, other_side) = ROOMS[room][importer], ROOMS[room][imported]
    return other_depth < depth or (other_depth == depth and other_side == side)


@pytest.mark.parametrize("room", ROOMS)
def test_every_module_is_in_the_picture(room):
    found = {part_of(path, room) for path in modules()}
    assert found - {"__init__", None} == set(ROOMS[room])


# The front doors, each __init__.py, lead everywhere within their room.
BEHIND_THE_DOOR = [
    (room, path)
    for room in ROOMS
    for path in modules()
    if part_of(path, room) not in ("__init__", None)
]


def test_imports_point_left():
    assert len(BEHIND_THE_DOOR) > 600
    wrong = [
        (str(path.relative_to(ROOT)), "must not import", name)
        for room, path in BEHIND_THE_DOOR
        for name in own_parts(path, room)
        if not allowed(part_of(path, room), name, room)
    ]
    assert not wrong


@pytest.mark.parametrize("room", sorted(set(ROOMS) - {""}))
def test_no_module_uses_the_front_door_of_its_own_room(room):
    """The door imports the room: whoever inside came back through it would go in a circle."""
    parts = {f"gcodejerk.{room}.{part}" for part in ROOMS[room]}
    for path in (ROOT / room).rglob("*.py"):
        names = {name for name in imports(path) if name.rpartition(".")[0] == f"gcodejerk.{room}"}
        assert path == ROOT / room / "__init__.py" or names <= parts, path


def test_no_modules_import_each_other_in_a_circle():
    named = {
        ".".join(("gcodejerk", *p.relative_to(ROOT).with_suffix("").parts)): p for p in modules()
    }
    graph = {name: set(imports(path)) & set(named) for name, path in named.items()}
    TopologicalSorter(graph).prepare()


@pytest.mark.parametrize(
    ("room", "importer", "imported"),
    [
        ("", "nc", "machine"),
        ("", "machine", "nc"),
        ("", "motion", "nc"),
        ("", "motion", "machine"),
        ("", "motion", "planning"),
        ("", "start", "nc"),
        ("", "verification", "motion"),
        ("", "verification", "planning"),
        ("", "verification", "emit"),
        ("", "emit", "verification"),
        ("", "emit", "report"),
        ("", "planning", "emit"),
        ("", "rewrite", "cli"),
        ("", "errors", "nc"),
        ("nc", "text", "interpreter"),
        ("nc", "interpreter", "flow"),
        ("machine", "file", "model"),
        ("motion", "profiles", "search"),
        ("verification", "second_reading", "physics"),
    ],
)
def test_the_picture_forbids_what_it_is_there_to_forbid(room, importer, imported):
    assert not allowed(importer, imported, room)


@pytest.mark.parametrize("name", SECOND_READER)
def test_the_second_reader_shares_nothing_with_the_first_but_the_tables(name):
    own = {f"gcodejerk.verification.second_reading.{other}" for other in SECOND_READER}
    tables = {
        f"gcodejerk.nc.dialects.{part}" for part in ("arithmetic", "dialect", "gcodes", "limits")
    }
    may = own | tables | {"gcodejerk.axes", "gcodejerk.units"}
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
        "from gcodejerk import planning\n"
        "import gcodejerk.studies.comparison as s\n"
        "def later():\n    from ..motion.profiles.laws import Laws\n"
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
    assert {"gcodejerk.planning.plan", "gcodejerk.rewrite.pipeline", "numpy"} <= loaded
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


def test_no_module_is_too_long_to_read_in_one_sitting():
    assert not [path for path in modules() if path.read_bytes().count(b"\n") > 450]


def test_every_module_says_what_it_owns():
    assert not [p for p in modules() if not ast.get_docstring(ast.parse(p.read_bytes()))]
