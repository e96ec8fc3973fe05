"""Functions that branch much say why, in a comment that begins with `Complex:` in front of them."""

from pathlib import Path

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


def test_what_branches_much_says_why_and_nothing_else_does():
    wrong = []
    for path in MODULES:
        source = path.read_text(encoding="utf-8")
        lines = source.splitlines()
        told = {k + 1 for k, line in enumerate(lines) if line.strip().startswith(MARK)}
        for name, line, complexity in functions(source):
            above = line - 1
            while lines[above - 1].lstrip().startswith("@"):
                above -= 1
            if (above in told) != (complexity > MOST):
                wrong.append((path.name, line, name, complexity))
            told.discard(above)
        wrong += [(path.name, line, "a comment in front of no function") for line in told]
    assert not wrong


def test_a_function_that_branches_is_found():
    branches = "".join(f"    if x == {k}:\n        return {k}\n" for k in range(MOST + 1))
    assert [*functions(f"def long(x):\n{branches}")] == [("long", 1, MOST + 2)]
