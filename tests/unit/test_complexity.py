"""Functions that branch much say why, in a comment that begins with `Complex:` in front of them."""

from pathlib import Path

import pytest
from radon.complexity import cc_visit

ROOT = Path(__file__).parents[2]
MOST = 20
"""Cyclomatic complexity of a function that needs no word of its own."""
MARK = "# Complex: "
MODULES = sorted((ROOT / "gcodejerk").rglob("*.py"))


def functions(source):
    """Every function and method of a module: its name, first line (from 1), and complexity."""
    for block in cc_visit(source):
        if block.letter != "C":
            yield block.name, block.lineno, block.complexity


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_what_branches_much_says_why_and_nothing_else_does(path):
    source = path.read_text(encoding="utf-8")
    lines = source.splitlines()
    told = {k + 1 for k, line in enumerate(lines) if line.strip().startswith(MARK)}
    for name, line, complexity in functions(source):
        above = line - 1
        while lines[above - 1].lstrip().startswith("@"):
            above -= 1
        says = above in told
        told.discard(above)
        assert says == (complexity > MOST), f"{name} (line {line}) has {complexity}"
    assert not told, "a comment in front of no function"


def test_a_function_that_branches_is_found():
    branches = "".join(f"    if x == {k}:\n        return {k}\n" for k in range(MOST + 1))
    assert [*functions(f"def long(x):\n{branches}")] == [("long", 1, MOST + 2)]
