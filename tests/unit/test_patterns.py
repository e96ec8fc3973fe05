"""Regular expressions of the package: none that an interpreter in use gets wrong, all linear.

Python 3.11.2, the python3 of Debian 12, matches possessive quantifiers wrongly: there
``re.match(rb"(?:G0?1 X\\n)*+", b"G1 X\\nG0\\n").end()`` is 6, not 5. So there are none, and what
they were for (no way back into what has matched) follows from patterns that match in one way only.
"""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import gcodejerk
from gcodejerk.nc import DIALECTS
from gcodejerk.verification.bytes import allowed, form, modes
from gcodejerk.verification.cycles import holes as cycles
from gcodejerk.verification.second_reading import reading
from gcodejerk.verification.second_reading.reading import Text

ROOT = Path(gcodejerk.__file__).parent
FORBIDDEN = ("*+", "++", "?+", "}+", "(?>")
NO_PATTERN = {b"--- %s\n+++ %s (gcodejerk)\n"}
"""Text that only looks like one."""
LARGE = 1 << 20
"""A pattern that needs the square of this many steps does not come back within a day."""


def constants(source):
    """Every string of a module that is no docstring, with its line."""
    tree = ast.parse(source)
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        text = isinstance(node, ast.Constant) and isinstance(node.value, str | bytes)
        if text and id(node) not in prose and node.value not in NO_PATTERN:
            yield node.lineno, node.value


def test_no_constant_holds_a_possessive_quantifier_or_an_atomic_group():
    found = []
    for path in sorted(ROOT.rglob("*.py")):
        for line, value in constants(path.read_text()):
            text = value.decode("latin-1") if isinstance(value, bytes) else value
            found += [(path.name, line, text) for mark in FORBIDDEN if mark in text]
    assert not found


RECORD = """
import re, sys
made, compile_ = [], re.compile
def record(pattern, flags=0):
    made.append(getattr(pattern, "pattern", pattern))
    return compile_(pattern, flags)
re.compile = record
from importlib import import_module
from pathlib import Path
import gcodejerk
root = Path(gcodejerk.__file__).parent
for path in sorted(root.rglob("*.py")):
    if path.stem != "__main__":
        import_module(".".join(path.relative_to(root.parent).with_suffix("").parts))
from gcodejerk.nc import DIALECTS
from gcodejerk.verification.bytes import form
from gcodejerk.verification.second_reading import reading
for dialect in DIALECTS.values():
    for decimals in (True, False):
        reading.Text(dialect, decimals)
form.run_of(b"G1 X-?[0-9]+", b"\\n")
for pattern in made:
    tree = str(re._parser.parse(pattern))
    assert "POSSESSIVE" not in tree and "ATOMIC" not in tree, pattern
print(len(made))
"""


def test_no_pattern_that_is_put_together_has_one_either():
    done = subprocess.run([sys.executable, "-c", RECORD], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 60


def test_the_checks_see_what_they_look_for():
    found = list(constants('"""a*+"""\nx = re.compile(rb"a" rb"b?+")\n'))
    assert found == [(2, b"ab?+")]
    assert "POSSESSIVE" in str(re._parser.parse("(?:a)*+"))


ADVERSARIES = [
    b"G1 X" + b"1" * LARGE,
    b"G1 X" + b"1" * LARGE + b".",
    b"G1 X" + b"1" * LARGE + b".5.",
    b"G1 X1." + b"5" * LARGE + b"!",
    b"G1 X-" + b"0" * LARGE + b"." + b"0" * LARGE + b".",
    b"G1 X1" + b" " * LARGE + b"!",
    b"G1 " + b"X1 " * (LARGE // 3) + b"!",
    b"G1 " + b"X1Y" * (LARGE // 3) + b"!",
    b"N" + b"1" * LARGE + b"!",
    b"(" * LARGE,
    b"G1 X1 Y1 F1 (" + b"a" * LARGE,
]
POINT = allowed.point_pattern("XY", {"X": 4, "Y": 4}, DIALECTS["linuxcnc"], False)
points = form.run_of(POINT, b"\n")
PATTERNS = {
    "words of a stream": lambda line: modes.read_words(line),
    "numbers without a point": lambda line: form._WHOLE.fullmatch(line),
    "points": lambda line: points.match(line),
    "words of the second reading": lambda line: reading._WORD.fullmatch(line),
    "run": lambda line: Text(DIALECTS["linuxcnc"], False).take_run(line, 0, False),
    "run with decimals": lambda line: Text(DIALECTS["fanuc"], True).take_run(line, 0, True),
    "moves of a cycle": lambda line: cycles._MOVE.fullmatch(line),
}


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=PATTERNS)
@pytest.mark.parametrize("line", ADVERSARIES, ids=lambda line: repr(line[:8]))
def test_what_does_not_match_costs_its_length(pattern, line):
    assert not pattern(line + b"\n")


def test_many_lines_that_match_but_the_last_are_taken_up_to_it():
    lines = b"G1 X1.5 Y-2.0 F100.5\n" * 5000
    text = Text(DIALECTS["linuxcnc"], False)
    run, end = text.take_run(lines + b"G0 X1\n", 0, True)
    assert (run.lines, end) == (5000, len(lines))
    assert form._run_end(points, lines + b"G1 X1.5 Y", 0, len(lines) + 9) == len(lines)
    assert form._run_end(points, b"G0\n", 0, 3) == 0
