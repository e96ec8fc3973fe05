"""Flow of Siemens, macro B and Heidenhain: drawn structures, run in plain Python, both readers.

No interpreter of these controls is at hand. A program is drawn as a structure (loops, branches,
calls, assignments, moves); `Control` runs the structure, with values for the variables that nobody
knows, and `Siemens`, `MacroB`, `Klartext` and `DinIso` write it down. Both readers read the text.
"""

import io
import math
import operator
import random
import re
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
import pytest

from gcodejerk.nc import CERTAIN, Start, read_program, trace
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

HOME = dict.fromkeys("XYZ", 0.0)
STARTS = {
    "siemens": Start(positions=HOME, offsets={"G54": HOME}, startup="G710 G64"),
    "fanuc": Start(positions=HOME, offsets={"G54": HOME}, decimal_point="calculator"),
    "haas": Start(positions=HOME, offsets={"G54": HOME}, decimal_point="calculator"),
    "klartext": Start(positions=HOME),
    "heidenhain-iso": Start(positions=HOME),
}
MINE = ("a", "b", "c")
HIDDEN = ("h", "k")
COUNTERS = ("i", "j", "l")
OPERATIONS = {"+": operator.add, "-": operator.sub, "*": operator.mul}
RELATIONS = {"==": operator.eq, "<>": operator.ne, ">": operator.gt, "<": operator.lt}
MOST = 3000


class Drawing:
    """Draws structures; the same for the same seed."""

    def __init__(self, seed, hidden):
        self.random, self.hidden = random.Random(seed), hidden

    def number(self):
        return float(self.random.randint(-6, 9))

    def operand(self, hidden=False):
        kinds = [self.number, self.number, lambda: self.random.choice(MINE)]
        kinds += [lambda: self.random.choice(HIDDEN)] * (hidden and self.hidden)
        return self.random.choice(kinds)()

    def sum(self, hidden=False):
        if self.random.random() < 0.6:
            return self.operand(hidden)
        return self.operand(), self.random.choice("+-*"), self.operand()

    def condition(self):
        return self.operand(True), self.random.choice(["==", "<>", ">", "<"]), self.operand()

    def body(self, depth, subs):
        return [self.statement(depth, subs) for _ in range(self.random.randint(1, 4))]

    def statement(self, depth, subs):
        choose, inner = self.random.choice, lambda: self.body(depth - 1, subs)
        kinds = ["move", "move", "place", "place", "set", "mode"]
        kinds += ["if", "skip", "while", "again", "for", "part"] * (depth > 0)
        kind = choose([*kinds, *(["call"] * bool(subs))])
        if kind == "move":
            axes = self.random.sample("XYZ", self.random.randint(1, 3))
            return kind, choose(["G0", "G0", "G1", ""]), {axis: self.sum() for axis in axes}
        if kind == "place":
            return kind, tuple(self.number() for _ in range(3))
        if kind == "set":
            return kind, choose(MINE), self.sum(True)
        if kind == "mode":
            return kind, choose(["G90", "G91", "G90"])
        if kind == "if":
            return kind, self.condition(), inner(), choose([[], inner()])
        if kind == "skip":
            return kind, self.condition(), inner()
        if kind == "for":
            return kind, self.random.randint(-1, 1), self.random.randint(-1, 3), inner()
        if kind == "call":
            return kind, choose(subs), self.sum(), choose([1, 1, 2])
        return kind, self.random.randint(kind != "while", 3), inner()

    def file(self):
        """Main program and subprograms."""
        first = [("set", name, float(k)) for k, name in enumerate(MINE)]
        begin = [("mode", "G90"), ("place", (0.0, 0.0, 0.0))]
        return {
            "": [*begin, *first, *self.body(2, ["S1", "S2"])],
            "S1": self.body(1, ["S2"]),
            "S2": self.body(1, []),
        }


@dataclass
class Writer:
    """Writes structures down; `places` holds the line of every statement that moves."""

    lines: list = field(default_factory=list)
    places: dict = field(default_factory=dict)
    labels: int = 0
    depth: int = 0

    def write(self, text):
        self.lines.append(text)

    def label(self):
        self.labels += 1
        return self.labels

    def body(self, statements):
        for statement in statements:
            self.places[id(statement)] = len(self.lines) + 1
            getattr(self, "do_" + statement[0].replace("if", "if_"))(*statement[1:])

    def do_mode(self, code):
        self.write(code)

    def do_move(self, code, axes):
        words = [self.word(axis, value) for axis, value in axes.items()]
        self.write(" ".join([*([code] if code else []), *words]))

    def do_place(self, at):
        words = [self.word(axis, value) for axis, value in zip("XYZ", at, strict=True)]
        self.write("G90 G0 " + " ".join(words))

    def sum(self, value):
        if isinstance(value, tuple):
            return f"{self.operand(value[0])}{value[1]}{self.operand(value[2])}"
        return self.operand(value)

    def operand(self, value):
        if isinstance(value, str):
            return self.names[value]
        return self.number(value)


@dataclass
class Siemens(Writer):
    names: ClassVar = {
        "a": "R1",
        "b": "DEEP",
        "c": "R[3]",
        "h": "R90",
        "k": "GUDS",
        "i": "R31",
        "j": "R32",
        "l": "R33",
        "arg": "GIVEN",
    }

    def number(self, value):
        return f"({value:g})" if value < 0 else f"{value:g}"

    def word(self, axis, value):
        return f"{axis}={self.sum(value)}"

    def test(self, condition):
        a, how, b = condition
        return f"{self.operand(a)} {how} {self.operand(b)}"

    def do_set(self, name, value):
        self.write(f"{self.names[name]}={self.sum(value)}")

    def do_if_(self, condition, yes, no):
        self.write(f"IF {self.test(condition)}")
        self.body(yes)
        if no:
            self.write("ELSE")
            self.body(no)
        self.write("ENDIF")

    def do_skip(self, condition, body):
        label = self.label()
        self.write(f"IF {self.test(condition)} GOTOF BEHIND{label} ; over it")
        self.body(body)
        self.write(f"BEHIND{label}:")

    def do_while(self, count, body):
        name = self.names[COUNTERS[self.depth]]
        self.depth += 1
        self.write(f"{name}=0")
        self.write(f"WHILE ({name}<{count})")
        self.body(body)
        self.write(f"{name}={name}+1")
        self.write("ENDWHILE")
        self.depth -= 1

    def do_again(self, count, body):
        name, label = self.names[COUNTERS[self.depth]], self.label()
        self.depth += 1
        self.write(f"{name}=0")
        self.write(f"N{label}000 ; here")
        self.body(body)
        self.write(f"{name}={name}+1")
        self.write(f"IF {name}<{count} GOTOB N{label}000")
        self.depth -= 1

    def do_for(self, first, last, body):
        name = self.names[COUNTERS[self.depth]]
        self.depth += 1
        self.write(f"FOR {name} = {first} TO {last}")
        self.body(body)
        self.write("ENDFOR")
        self.depth -= 1

    def do_part(self, count, body):
        label = self.label()
        self.write(f"PART{label}:")
        self.body(body)
        self.write(f"REPEAT PART{label} P={count}")

    def do_call(self, name, value, count):
        self.write(f"SUB_{name}({self.sum(value)})" + (f" P{count}" if count > 1 else ""))

    def file(self, programs):
        self.write("%_N_MAIN_MPF")
        self.write("DEF REAL DEEP=0, UNUSED")
        self.write("G17 G710 G90 G94 G64 G40 G54 F500")
        self.body(programs[""])
        self.write("M30")
        for name in ("S1", "S2"):
            self.write(f"%_N_SUB_{name}_SPF")
            self.write(f"PROC SUB_{name}(REAL GIVEN)")
            self.write("DEF REAL DEEP=4")
            own = {key: f"R{name[1]}{k}" for k, key in enumerate(COUNTERS, 1)}
            self.names = {**Siemens.names, **own, "c": "GIVEN"}
            self.body(programs[name])
            self.write("RET" if name == "S1" else "N9 M17")
        return "\n".join(self.lines).encode() + b"\n"


@dataclass
class MacroB(Writer):
    names: ClassVar = {
        "a": "#101",
        "b": "#1",
        "c": "#103",
        "h": "#510",
        "k": "#511",
        "i": "#111",
        "j": "#112",
        "l": "#113",
    }
    relations: ClassVar = {"==": "EQ", "<>": "NE", ">": "GT", "<": "LT"}
    loops: int = 0

    def number(self, value):
        return f"[{value:g}.]" if value < 0 else f"{value:g}."

    def word(self, axis, value):
        return f"{axis}[{self.sum(value)}]"

    def test(self, condition):
        a, how, b = condition
        return f"[{self.operand(a)} {self.relations[how]} {self.operand(b)}]"

    def do_set(self, name, value):
        self.write(f"{self.names[name]}={self.sum(value)}")

    def do_if_(self, condition, yes, no):
        other, end = self.label() * 10, self.label() * 10
        self.write(f"IF{self.test(condition)}GOTO{other}")
        self.body(no)
        self.write(f"GOTO {end} (behind it)")
        self.write(f"N{other}")
        self.body(yes)
        self.write(f"N{end}")

    def do_skip(self, condition, body):
        label = self.label() * 10
        self.write(f"N{label + 1} IF {self.test(condition)} GOTO {label}")
        self.body(body)
        self.write(f"N{label}")

    def do_while(self, count, body):
        name = self.names[COUNTERS[self.depth]]
        self.depth += 1
        self.loops += 1
        self.write(f"{name}=0")
        self.write(f"WHILE[{name} LT {count}.]DO{self.loops}")
        self.body(body)
        self.write(f"{name}={name}+1.")
        self.write(f"END{self.loops}")
        self.loops -= 1
        self.depth -= 1

    def do_again(self, count, body):
        name, label = self.names[COUNTERS[self.depth]], self.label() * 10
        self.depth += 1
        self.write(f"{name}=0.")
        self.write(f"N{label}")
        self.body(body)
        self.write(f"{name}={name}+1.")
        self.write(f"IF[{name} LT {count}.]GOTO{label}")
        self.depth -= 1

    def do_for(self, first, last, body):
        name = self.names[COUNTERS[self.depth]]
        self.depth += 1
        self.loops += 1
        self.write(f"{name}={first}.")
        self.write(f"WHILE[{name} LE {last}.]DO{self.loops}")
        self.body(body)
        self.write(f"{name}={name}+1.")
        self.write(f"END{self.loops}")
        self.loops -= 1
        self.depth -= 1

    def do_part(self, count, body):
        self.do_while(count + 1, body)

    def do_call(self, name, value, count):
        self.write(
            f"G65 P{name[1]}000 C[{self.sum(value)}] B4." + (f" L{count}" if count > 1 else "")
        )

    def file(self, programs):
        self.write("O1 (MAIN)")
        self.write("G21 G90 G94 G17 G40 G49 G80 G54 F500.")
        self.body(programs[""])
        self.write("M30")
        for name in ("S1", "S2"):
            self.write(f"O{name[1]}000")
            self.write("#1=#2")
            own = {key: f"#2{name[1]}{k}" for k, key in enumerate(COUNTERS)}
            self.names = {**MacroB.names, **own, "c": "#3"}
            self.body(programs[name])
            self.write("M99")
        return "\n".join(self.lines).encode() + b"\n"


@dataclass
class Labels(Writer):
    """What both languages of Heidenhain share: labels, jumps on a condition, Q parameters."""

    names: ClassVar = {
        "a": "Q1",
        "b": "QL2",
        "c": "Q03",
        "h": "Q90",
        "k": "Q91",
        "i": "Q21",
        "j": "Q22",
        "l": "Q23",
    }

    def number(self, value):
        return f"{value:+g}"

    def body(self, statements):
        for statement in statements:
            kind, *rest = statement
            if kind == "move":
                rest[1] = {axis: self.single(axis, value) for axis, value in rest[1].items()}
            self.places[id(statement)] = len(self.lines) + 1
            getattr(self, "do_" + kind.replace("if", "if_"))(*rest)

    def single(self, axis, value):
        """A word has room for one parameter."""
        if isinstance(value, tuple):
            self.do_set(name := "XYZ".index(axis) + 80, value)
            return name
        return value

    def operand(self, value):
        return f"Q{value}" if isinstance(value, int) else super().operand(value)

    def do_set(self, name, value):
        if isinstance(value, tuple) and self.label() % 2:
            self.function(self.operand(name), value)
        else:
            self.block(f"{self.operand(name)} = {self.sum(value)}")

    def do_if_(self, condition, yes, no):
        other, end = self.label(), self.label()
        self.jump(condition, other)
        self.body(no)
        self.jump((0.0, "==", 0.0), end)
        self.mark(other)
        self.body(yes)
        self.mark(end)

    def do_skip(self, condition, body):
        label = self.label()
        self.jump(condition, label)
        self.body(body)
        self.mark(label)

    def do_while(self, count, body):
        self.do_for(1, count, body)

    def do_again(self, count, body):
        name, label = COUNTERS[self.depth], self.label()
        self.depth += 1
        self.do_set(name, 0.0)
        self.mark(label)
        self.body(body)
        self.do_set(name, (name, "+", 1.0))
        self.jump((name, "<", float(count)), label)
        self.depth -= 1

    def do_for(self, first, last, body):
        name, label, end = COUNTERS[self.depth], self.label(), self.label()
        self.depth += 1
        self.do_set(name, float(first))
        self.mark(label)
        self.jump((name, ">", float(last)), end)
        self.body(body)
        self.do_set(name, (name, "+", 1.0))
        self.jump((0.0, "==", 0.0), label)
        self.mark(end)
        self.depth -= 1

    def do_part(self, count, body):
        label = self.label()
        self.mark(label)
        self.body(body)
        self.call(label, count)

    def do_call(self, name, value, count):
        self.do_set("c", value)
        for _ in range(count):
            self.call(900 + int(name[1]), 0)

    def programs(self, programs):
        self.body(programs[""])
        self.block("M30")
        for name in ("S1", "S2"):
            self.mark(900 + int(name[1]))
            own = {key: f"Q{4 + int(name[1])}{k}" for k, key in enumerate(COUNTERS)}
            self.names = {**Labels.names, **own}
            self.body(programs[name])
            self.mark(0)


@dataclass
class Klartext(Labels):
    def block(self, text):
        self.write(f"{len(self.lines)} {text}")

    def word(self, axis, value):
        return f"{axis}{self.operand(value)}"

    def function(self, name, value):
        a, how, b = value
        number = " +-*".index(how)
        self.block(f"FN {number}: {name} = {self.operand(a)} {how} {self.operand(b)} ; computed")

    def jump(self, condition, label):
        a, how, b = condition
        k = ["==", "<>", ">", "<"].index(how)
        word = ["EQU", "NE", "GT", "LT"][k]
        test = f"IF {self.operand(a)} {word} {self.operand(b)}"
        self.block(f"FN {9 + k}: {test} GOTO LBL {label}")

    def mark(self, label):
        self.block(f"LBL {label}")

    def call(self, label, again):
        text = f" REP {again}" if again % 2 else f" REP {again}/{again}"
        self.block(f"CALL LBL {label}" + (text if again else ""))

    def do_mode(self, code):
        self.block("M8")

    def do_move(self, code, axes):
        step = "" if code else "I"  # an increment stands in front of each axis here
        words = [step + self.word(axis, value) for axis, value in axes.items()]
        self.block(" ".join(["L", *words, "F500" if code == "G1" else "FMAX"]))

    def do_place(self, at):
        words = [self.word(axis, value) for axis, value in zip("XYZ", at, strict=True)]
        self.block("L " + " ".join(words) + " R0 FMAX")

    def file(self, programs):
        self.write("BEGIN PGM MAIN MM")
        self.block("L X+0 Y+0 Z+0 R0 F500")
        self.programs(programs)
        self.block("END PGM MAIN MM")
        return "\n".join(self.lines).encode() + b"\n"


@dataclass
class DinIso(Labels):
    def block(self, text):
        self.write(f"N{len(self.lines)}0 {text} *")

    def word(self, axis, value):
        return f"{axis}{self.operand(value)}"

    def function(self, name, value):
        a, how, b = value
        k = " +-*".index(how)
        self.block(f"D0{k} {name} P01 {self.operand(a)} P02 {self.operand(b)}")

    def jump(self, condition, label):
        a, how, b = condition
        k = 9 + ["==", "<>", ">", "<"].index(how)
        self.block(f"D{k:02d} P01 {self.operand(a)} P02 {self.operand(b)} P03 {label}")

    def mark(self, label):
        self.block(f"G98 L{label}")

    def call(self, label, again):
        self.block(f"L{label},{again}")

    def do_mode(self, code):
        self.block(code)

    def do_move(self, code, axes):
        words = [self.word(axis, value) for axis, value in axes.items()]
        self.block(" ".join([*([code] if code else []), *words]))

    def do_place(self, at):
        words = [self.word(axis, value) for axis, value in zip("XYZ", at, strict=True)]
        self.block("G90 G00 " + " ".join(words))

    def file(self, programs):
        self.write("%MAIN G71 *")
        self.block("G17 G90 G40 G01 F500")
        self.programs(programs)
        self.write("N99999 %MAIN G71 *")
        return "\n".join(self.lines).encode() + b"\n"


class TooLongError(Exception):
    """A loop of thousands of lines."""


class Control:
    """Runs structures; every pass over a line that moves is noted."""

    def __init__(self, programs, places, hidden, dialect):
        self.programs, self.places, self.dialect = programs, places, dialect
        self.shared = dict(zip(HIDDEN, hidden, strict=True))
        self.local = {}
        self.at, self.motion, self.incremental = [0.0] * 3, "G0", False
        self.passes, self.steps = [], 0
        self.inside = False

    def value(self, operand):
        if isinstance(operand, tuple):
            a, how, b = operand
            return OPERATIONS[how](self.value(a), self.value(b))
        if isinstance(operand, str):
            return (self.local if self.is_local(operand) else self.shared).get(operand, 0.0)
        return operand

    @property
    def labels(self):
        """Subprograms are parts of the one program, and share its parameters."""
        return self.dialect in ("klartext", "heidenhain-iso")

    def is_local(self, name):
        return not self.labels and (name == "b" or (name == "c" and self.inside))

    def holds(self, condition):
        a, how, b = condition
        return RELATIONS[how](self.value(a), self.value(b))

    def body(self, statements, depth=0):
        for statement in statements:
            self.steps += 1
            if self.steps > MOST:
                raise TooLongError
            self.one(statement, depth)

    def one(self, statement, depth):
        kind, *rest = statement
        before = tuple(self.at)
        if kind == "mode":
            self.incremental = rest[0] == "G91" and self.dialect != "klartext"
        elif kind == "place":
            self.incremental, self.motion = False, "G0"
            self.at = list(rest[0])
            self.note(statement, before)
        elif kind == "move":
            spoken = self.dialect == "klartext"
            self.motion = rest[0] or ("G0" if spoken else self.motion)
            self.incremental = not rest[0] if spoken else self.incremental
            new = {a: self.value(v) for a, v in rest[1].items()}
            for axis, value in new.items():
                k = "XYZ".index(axis)
                self.at[k] = value + (self.at[k] if self.incremental else 0.0)
            self.note(statement, before)
        elif kind == "set":
            value = self.value(rest[1])
            (self.local if self.is_local(rest[0]) else self.shared)[rest[0]] = value
        elif kind == "if":
            self.body(rest[1] if self.holds(rest[0]) else rest[2], depth)
        elif kind == "skip":
            if not self.holds(rest[0]):
                self.body(rest[1], depth)
        elif kind == "call":
            self.call(*rest)
        else:
            first = rest[0] if kind == "for" else 0
            last = rest[1] if kind == "for" else rest[0] - 1 + (kind == "part")
            for _ in range(max(last - first + 1, kind == "again")):
                self.body(rest[-1], depth + 1)

    def call(self, name, value, count):
        given = self.value(value)
        if self.labels:
            self.shared["c"] = given
        for _ in range(count):
            kept, inside = self.local, self.inside
            self.local, self.inside = {"b": 4.0, "c": given}, True
            self.body(self.programs[name])
            self.local, self.inside = kept, inside

    def note(self, statement, before):
        rapid = self.motion == "G0"
        self.passes.append((self.places[id(statement)], before, tuple(self.at), rapid))


def cut(data):
    """A file with its subprograms in files of their own: with their heads, and by their names."""
    heads = list(re.finditer(rb"^(?:%_N_(SUB_S[12])_SPF|O([12]000))\n", data, re.MULTILINE))
    ends = [*(head.start() for head in heads[1:]), len(data)]
    files = {}
    for k, (head, end) in enumerate(zip(heads, ends, strict=True)):
        name, body = (head[1] or b"").decode() or f"O{head[2].decode()}", data[head.end() : end]
        ending = "spf" if head[1] else "nc"
        files[f"{name}.{ending}" if k else f"any/other{k}.{ending}"] = (
            b"" if k else head[0]
        ) + body
    return data[: heads[0].start()], files


def judge(programs, writer, dialect, hidden, apart=False):
    """Check both readers; rapids that ran, those that are certain, and those that are confirmed."""
    data = writer.file(programs)
    control = Control(programs, writer.places, hidden, dialect)
    start = STARTS[dialect]
    if apart:
        data, files = cut(data)
        start = replace(start, subprograms=files)
    try:
        control.body(programs[""])
    except TooLongError:
        return None
    shown, lines = data.decode(), data.count(b"\n")
    control.passes = [each for each in control.passes if each[0] <= lines]
    after = {n: p for n, p, _ in trace(io.BytesIO(data), dialect=dialect, start=start)}
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    certain = {int(rapids.line[i]): i for i in range(len(rapids)) if rapids.reason[i] == CERTAIN}
    for line, before, now, rapid in control.passes:
        for axis in range(3):
            claim = after[line][axis]
            assert math.isnan(claim) or abs(claim - now[axis]) < 1e-9, (
                shown,
                line,
                after[line],
                now,
            )
        i = certain.get(line)
        if i is None:
            continue
        assert rapid, (shown, line)
        for axis in range(3):
            if rapids.words[i] >> axis & 1:
                assert abs(rapids.start[i, axis] - before[axis]) < 1e-9, (shown, line)
                assert abs(rapids.target[i, axis] - now[axis]) < 1e-9, (shown, line)
    rows = np.flatnonzero(rapids.reason == CERTAIN)
    found = Findings(100)
    confirmed = confirm(io.BytesIO(data), dialect, start, rapids, rows, found)
    assert not found.violations, (shown, found.violations)
    ran = {}
    for line, before, now, rapid in control.passes:
        ran.setdefault(line, set()).add((before, now, rapid))
    once = [next(iter(passes)) for passes in ran.values() if len(passes) == 1]
    alike = sum(rapid and before != now for before, now, rapid in once)
    return data, rapids, alike, confirmed


WRITERS = [
    ("siemens", Siemens),
    ("fanuc", MacroB),
    ("haas", MacroB),
    ("klartext", Klartext),
    ("heidenhain-iso", DinIso),
]
SEEDS = range(30)


@pytest.mark.parametrize(("dialect", "writer"), WRITERS)
def test_what_is_known_holds_on_every_pass(dialect, writer):
    """Whatever the variables hold that nobody has set."""
    for seed in SEEDS:
        drawing = Drawing(seed, hidden=True)
        judge(drawing.file(), writer(), dialect, (drawing.number(), drawing.number()))


@pytest.mark.parametrize(("dialect", "writer"), WRITERS)
def test_without_unknown_variables_everything_is_known(dialect, writer):
    for seed in SEEDS:
        judged = judge(Drawing(seed, hidden=False).file(), writer(), dialect, (0.0, 0.0))
        if judged is not None:
            data, rapids, alike, confirmed = judged
            certain = int((rapids.reason == CERTAIN).sum())
            assert certain == confirmed, data.decode()
            assert certain >= alike, data.decode()


@pytest.mark.parametrize(("dialect", "writer"), WRITERS[:3])
def test_subprograms_in_files_of_their_own_are_followed_like_those_of_the_file(dialect, writer):
    followed = 0
    for seed in SEEDS[:12]:
        drawing, hidden = Drawing(seed, hidden=seed % 2 == 1).file(), (2.0, 3.0)
        judged = judge(drawing, writer(), dialect, hidden, apart=True)
        if judged is None:
            continue
        data, rapids, _, confirmed = judged
        lines = rapids.line[rapids.reason == CERTAIN].tolist()
        assert confirmed == len(lines) or seed % 2, seed
        _, rapids, *_ = judge(drawing, writer(), dialect, hidden)
        own = rapids.line[rapids.reason == CERTAIN].tolist()
        assert lines == [line for line in own if line <= data.count(b"\n")]
        followed += len(lines)
    assert followed > 8


@pytest.mark.parametrize(("dialect", "writer"), WRITERS[:2] + WRITERS[3:])
def test_a_wrong_start_or_end_is_noticed_on_every_pass(dialect, writer):
    """What `nc` might get wrong of a variable or of a jump shows as another start or end."""
    noticed = 0
    for seed in SEEDS:
        judged = judge(Drawing(seed, hidden=False).file(), writer(), dialect, (0.0, 0.0))
        if judged is None:
            continue
        data, rapids, *_ = judged
        rows = np.flatnonzero(rapids.reason == CERTAIN)
        for damaged in (rapids.start, rapids.target):
            damaged[rows] += 0.001
            found = Findings(1000)
            confirm(io.BytesIO(data), dialect, STARTS[dialect], rapids, rows, found)
            damaged[rows] -= 0.001
            assert len(found.violations) == len(rows)
            noticed += len(rows)
    assert noticed > 60


@pytest.mark.parametrize(("dialect", "writer"), WRITERS[:2] + WRITERS[3:])
def test_a_rapid_that_differs_from_pass_to_pass_is_noticed(dialect, writer):
    """Were all passes taken for the first one, the second reading would say so."""
    noticed = 0
    for seed in SEEDS:
        drawing = Drawing(seed, hidden=False).file()
        written = writer()
        judged = judge(drawing, written, dialect, (0.0, 0.0))
        if judged is None:
            continue
        data, rapids, *_ = judged
        control = Control(drawing, written.places, (0.0, 0.0), dialect)
        control.body(drawing[""])
        passes = {}
        for line, before, now, rapid in control.passes:
            if rapid:
                passes.setdefault(line, []).append((before, now))
        for i, line in enumerate(rapids.line.tolist()):
            named = [k for k in range(3) if rapids.words[i] >> k & 1]
            ends = {tuple(now[k] for k in named) for _, now in passes.get(line, [])}
            if len(ends) < 2:
                continue
            before, now = passes[line][0]
            rapids.start[i, :3], rapids.target[i, :3] = before, now
            found = Findings(10)
            confirm(io.BytesIO(data), dialect, STARTS[dialect], rapids, [i], found)
            assert found.violations, (data.decode(), line)
            noticed += 1
    assert noticed > 2
