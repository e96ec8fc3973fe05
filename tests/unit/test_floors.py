"""The lowest versions of the dependencies: what pyproject.toml allows is what .ci/run tries."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_the_constraints_that_are_tried_are_the_floors():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    wanted = [*project["dependencies"], *extras["science"], *extras["figures"], *extras["testing"]]
    floors = dict(re.fullmatch(r"([a-z]+)>=([0-9.]+)", each).groups() for each in wanted)
    lines = (ROOT / ".ci/lowest.txt").read_text().splitlines()
    tried = dict(line.split("==") for line in lines if not line.startswith("#"))

    def number(version):
        parts = [int(part) for part in version.split(".")]
        return parts + [0] * (3 - len(parts))

    assert {name: number(v) for name, v in tried.items()} == {
        name: number(v) for name, v in floors.items()
    }
