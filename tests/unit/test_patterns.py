"""Regular expressions of the package: none that an interpreter in use gets wrong, all linear.

Python 3.11.2, the python3 of Debian 12, matches possessive quantifiers wrongly: there
``re.match(rb"(?:G0?1 X\\n)*+", b"G1 X\\nG0\\n").end()`` is 6, not 5. So there are none, and what
they were for (no way back into what has matched) follows from patterns that match in one way only.
"""

import ast
import io
import re
import subprocess
import sys
from pathlib import Path
from re import _constants as code

import pytest

import gcodejerk
from gcodejerk.nc import DIALECTS
from gcodejerk.nc.text import careful
from gcodejerk.rewrite import feed_moves
from gcodejerk.verification.bytes import allowed, form, modes
from gcodejerk.verification.cycles import holes as cycles
from gcodejerk.verification.second_reading import reading
from gcodejerk.verification.second_reading.reading import Text

ROOT = Path(gcodejerk.__file__).parent
FORBIDDEN = ("*+", "++", "?+", "}+", "(?>")
NO_PATTERN = {b"--- %s\n+++ %s (gcodejerk)\n"}
"""Text that only looks like one."""
REPEATING = code.MAX_REPEAT, code.MIN_REPEAT
GROUPS = code.SUBPATTERN, code.BRANCH
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
print({pattern for pattern in made if isinstance(pattern, (str, bytes))})
"""


@pytest.fixture(scope="module")
def compiled():
    """Every pattern that modules compile when they are imported, or put together."""
    done = subprocess.run([sys.executable, "-c", RECORD], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    patterns = ast.literal_eval(done.stdout)
    assert len(patterns) > 300
    return patterns


def test_no_pattern_that_is_put_together_has_one_either(compiled):
    for pattern in compiled:
        tree = str(re._parser.parse(pattern))
        assert not {"POSSESSIVE", "ATOMIC"} & set(re.findall("[A-Z]+", tree)), pattern


MANY = 64
"""A repeat of more is one without an end."""


def characters(kind, value):
    """What one character of a pattern may be, of the first 256; None where it is no character."""
    if kind in (code.LITERAL, code.NOT_LITERAL, code.ANY, code.IN):
        one = re._compiler.compile(re._parser.SubPattern(re._parser.State(), [(kind, value)]))
        return frozenset(c for c in range(256) if one.fullmatch(chr(c)))
    return None


def endless(item):
    """The characters of an endless repeat of one character; none where it is something else."""
    kind, value = item
    if kind in REPEATING and value[1] > MANY and len(value[2]) == 1:
        return characters(*value[2][0]) or frozenset()
    return frozenset()


def begins(items):
    """With which characters a sequence may begin, and whether it may be empty."""
    found = frozenset()
    for kind, value in items:
        own = characters(kind, value)
        if own is not None:
            return found | own, False
        if kind in REPEATING:
            own, empty = begins(value[2])
            empty |= value[0] == 0
        elif kind in GROUPS:
            parts = [begins(part) for part in inner(kind, value)]
            own, empty = frozenset().union(*(p for p, _ in parts)), any(e for _, e in parts)
        else:  # looks ahead or behind
            own, empty = frozenset(), True
        found |= own
        if not empty:
            return found, False
    return found, True


def ends_in(items):
    """Characters that an endless repeat at the end of a sequence may take more of."""
    found = frozenset()
    for kind, value in reversed(list(items)):
        found |= endless((kind, value))
        for part in inner(kind, value):
            found |= ends_in(part)
        if not begins([(kind, value)])[1]:
            break
    return found


def inner(kind, value):
    """Sequences within an item."""
    if kind in REPEATING:
        return [value[2]]
    if kind is code.BRANCH:
        return value[1]
    return [value[-1]] if kind is code.SUBPATTERN else []


def ambiguous(items, repeated=False):
    """Whether a repeat within a repeat may end in several places: these multiply."""
    items = list(items)
    for k, (kind, value) in enumerate(items):
        own = endless((kind, value))
        if repeated and own:
            for item in items[k + 1 :]:
                if own & endless(item):
                    return True
                if not begins([item])[1]:
                    break
        again = kind in REPEATING and value[1] > MANY
        if again and not own:
            first, empty = begins(value[2])
            if empty or first & ends_in(value[2]):
                return True
        if any(ambiguous(part, repeated or again) for part in inner(kind, value)):
            return True
    return False


def written_out(source):
    """Patterns that stand in calls of `re` themselves: these are compiled when they are needed."""
    for node in ast.walk(ast.parse(source)):
        called = node.func if isinstance(node, ast.Call) else None
        if isinstance(called, ast.Attribute) and getattr(called.value, "id", "") == "re":
            first = node.args[0] if node.args else None
            if isinstance(first, ast.Constant):
                yield first.value


def test_no_pattern_of_the_package_has_more_and_more_ways_to_fail(compiled):
    used = {p for path in ROOT.rglob("*.py") for p in written_out(path.read_text())}
    assert len(used - compiled) > 10
    assert not [p for p in used | compiled if ambiguous(re._parser.parse(p))]


@pytest.mark.parametrize(
    ("pattern", "found"),
    [
        (r"(?:\([^()]*\)?[ \t]*)*;?", True),
        (r"(?:\s*[A-Z]\s*(?:\d+\.?\d*|\.\d+))*", True),
        (r"(a+)+", True),
        (r"(?: *x? *)*", True),
        (r"(?:a|b*)*", True),
        (r"(?:\([^()]*(?:\)[ \t]*)?)*;?", False),
        (r"(?:\s*[A-Z]\s*(?:\d+(?:\.\d*)?|\.\d+))*", False),
        (r"\s*\s*a", False),
    ],
)
def test_what_has_is_found(pattern, found):
    assert ambiguous(re._parser.parse(pattern)) == found
    assert ambiguous(re._parser.parse(pattern.encode())) == found


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
    b"%" + b"(  " * (LARGE // 3) + b"))",
    b"G21 G17 X100 Y200 " * (LARGE // 18) + b"*5 0 <",
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
    "first line": lambda line: careful._LEADER.fullmatch(line),
    "feed moves": lambda line: feed_moves.look(io.BytesIO(line)),
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
