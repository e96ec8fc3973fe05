"""Programs with jumps, loops and calls as Fanuc writes them, run for real by a tiny executor.

No interpreter of Fanuc's is at hand. The programs are drawn as lists of instructions; the executor
runs those (with values for the variables that nobody knows), the reader reads their text.
"""

import io
import math
import operator

from hypothesis import given, settings
from hypothesis import strategies as st

from gcodejerk.nc import CERTAIN, Start, read_program, trace

START = Start(positions=dict.fromkeys("XYZ", 0.0), offsets={"G54": dict.fromkeys("XYZ", 0.0)})
HEAD = "G21 G90 G94 G17 G40 G49 G80 G54"
RESTATED = [(None, ("mode", HEAD)), (None, ("mode", "F100."))]
COMPARE = {"EQ": operator.eq, "NE": operator.ne, "GT": operator.gt, "LT": operator.lt}
COMPUTE = {"+": operator.add, "-": operator.sub, "*": operator.mul}
HIDDEN = ("#110", "#111")
VARIABLES = ("#1", "#2", "#101")
MOST_STEPS = 1500

numbers = st.integers(-4, 9)
mine = st.sampled_from(VARIABLES)
operands = st.one_of(numbers, numbers, mine, mine, st.sampled_from(HIDDEN))


def spell(value):
    return value if isinstance(value, str) else f"{value}."


def instructions(targets, subs, depth):
    """One instruction: a tuple whose first entry says what it is."""
    axes = st.dictionaries(
        st.sampled_from("XYZ"), st.one_of(numbers, numbers, operands), min_size=1
    )
    plain = st.dictionaries(st.sampled_from("XYZ"), numbers, min_size=1)
    place = st.tuples(st.just("place"), st.tuples(numbers, numbers, numbers))
    condition = st.tuples(operands, st.sampled_from(sorted(COMPARE)), operands)
    kinds = [
        st.tuples(st.just("move"), st.sampled_from(["G0", "G0", "G0", "", "G1"]), axes),
        st.tuples(st.just("move"), st.sampled_from(["G0", ""]), plain),
        st.tuples(st.just("move"), st.just("G0"), plain),
        place,
        st.tuples(
            st.just("mode"), st.sampled_from(["G90", "G91", "G90", "G21 G90 G94 G17 G40 G54 G49"])
        ),
        place,
        st.tuples(
            st.just("set"),
            st.sampled_from(VARIABLES),
            operands,
            st.sampled_from(sorted(COMPUTE)),
            operands,
        ),
        st.tuples(st.just("then"), condition, st.sampled_from(VARIABLES), operands),
    ]
    if targets:
        kinds.append(st.tuples(st.just("if"), condition, st.sampled_from(targets)))
        kinds.append(st.tuples(st.just("goto"), st.sampled_from(targets)))
    if subs and depth < 2:
        kinds.append(st.tuples(st.just("call"), st.sampled_from(subs), st.integers(1, 3)))
    return st.one_of(kinds)


@st.composite
def sections(draw, subs, depth):
    """Instructions of a program, some with numbers, with loops between them."""
    targets = draw(st.lists(st.sampled_from([10, 20, 30]), unique=True, max_size=2))
    body = draw(st.lists(instructions(targets, subs, depth), min_size=3, max_size=12))
    body = [(None, step) for step in body]
    if draw(st.booleans()):
        first = draw(st.integers(0, len(body)))
        last = draw(st.integers(first, len(body)))
        condition = draw(st.tuples(operands, st.sampled_from(sorted(COMPARE)), operands))
        again = RESTATED if draw(st.booleans()) else []
        loop = [(None, ("while", condition)), *again, *body[first:last], (None, ("end",))]
        again = RESTATED if draw(st.booleans()) else []
        body = [*body[:first], *loop, *again, *body[last:]]
    for number in targets:
        again = RESTATED if draw(st.booleans()) else []
        at = draw(st.integers(0, len(body)))
        body[at:at] = [(number, ("mode", "G90")), *again]
    return body


@st.composite
def fanuc_programs(draw):
    """Program number -> instructions; 1 is the main program."""
    inner = draw(sections([], 2))
    outer = draw(sections([200], 1))
    main = draw(sections([100, 200], 0))
    ends = [(None, ("return",))]
    first = [(None, ("set", name, k, "+", 1)) for k, name in enumerate(VARIABLES)]
    return {
        1: [*RESTATED, *first, *main, (None, ("stop",))],
        100: outer + ends,
        200: inner + ends,
    }


def text_of(step):
    kind = step[0]
    if kind == "move":
        return " ".join([step[1], *(axis + spell(v) for axis, v in step[2].items())]).strip()
    if kind == "mode":
        return step[1]
    if kind == "place":
        return "G90 G0 " + " ".join(a + spell(v) for a, v in zip("XYZ", step[1], strict=True))
    if kind == "set":
        return f"{step[1]}={spell(step[2])}{step[3]}{spell(step[4])}"
    if kind in ("then", "if"):
        a, how, b = step[1]
        what = f"GOTO {step[2]}" if kind == "if" else f"THEN {step[2]}={spell(step[3])}"
        return f"IF [{spell(a)} {how} {spell(b)}] {what}"
    if kind == "while":
        a, how, b = step[1]
        return f"WHILE [{spell(a)} {how} {spell(b)}] DO 1"
    if kind == "call":
        return f"M98 P{step[1]} L{step[2]}"
    return {"goto": f"GOTO {step[-1]}", "end": "END 1", "return": "M99", "stop": "M30"}[kind]


def write(programs):
    """Text, and the line of every instruction."""
    lines, places = [], {}
    for number, body in programs.items():
        lines.append(f"O{number}")
        for k, (label, step) in enumerate(body):
            lines.append((f"N{label} " if label else "") + text_of(step))
            places[number, k] = len(lines)
    return ("\n".join(lines) + "\n").encode(), places


class Control:
    """Runs instructions; every pass over a line that moves is noted."""

    def __init__(self, programs, places, hidden, at):
        self.programs, self.places = programs, places
        self.variables = dict(zip(HIDDEN, hidden, strict=True))
        self.at, self.motion, self.incremental = list(at), None, False
        self.steps = 0
        self.passes = []

    def value(self, operand):
        return self.variables.get(operand, 0) if isinstance(operand, str) else operand

    def holds(self, condition):
        a, how, b = condition
        return COMPARE[how](self.value(a), self.value(b))

    def go(self, words):
        for axis, operand in words:
            k = "XYZ".index(axis)
            self.at[k] = self.value(operand) + (self.at[k] if self.incremental else 0)

    def run(self, number):
        """Run a program; False where the whole stops."""
        body = self.programs[number]
        k = 0
        while k < len(body):
            self.steps += 1
            if self.steps > MOST_STEPS:
                return False
            step, here = body[k][1], k
            k += 1
            kind = step[0]
            before = tuple(self.at)
            if kind == "move":
                self.motion = step[1] or self.motion
                self.go(step[2].items())
            elif kind == "mode":
                self.incremental = (self.incremental or "G91" in step[1]) and "G90" not in step[1]
            elif kind == "place":
                self.incremental, self.motion = False, "G0"
                self.go(zip("XYZ", step[1], strict=True))
            elif kind == "set":
                self.variables[step[1]] = COMPUTE[step[3]](self.value(step[2]), self.value(step[4]))
            elif kind == "then" and self.holds(step[1]):
                self.variables[step[2]] = self.value(step[3])
            elif kind == "goto" or (kind == "if" and self.holds(step[1])):
                k = [label for label, _ in body].index(step[-1])
            elif kind == "while" and not self.holds(step[1]):
                k = 1 + next(j for j, (_, s) in enumerate(body) if s[0] == "end")
            elif kind == "end":
                k = next(j for j, (_, s) in enumerate(body) if s[0] == "while")
            elif kind == "call":
                for _ in range(step[2]):
                    if not self.run(step[1]):
                        return False
                continue
            elif kind == "return":
                return True
            elif kind == "stop":
                return False
            rapid = kind == "place" or (kind == "move" and self.motion == "G0")
            self.passes.append((self.places[number, here], before, tuple(self.at), rapid))
        return True


def check(programs, hidden, at, start):
    data, places = write(programs)
    control = Control(programs, places, hidden, at)
    control.run(1)
    after = {line: p for line, p, _ in trace(io.BytesIO(data), dialect="fanuc", start=start)}
    rapids = read_program(io.BytesIO(data), dialect="fanuc", start=start).rapids
    assert rapids.line.tolist() == sorted(set(rapids.line.tolist()))
    certain = {int(rapids.line[i]): i for i in range(len(rapids)) if rapids.reason[i] == CERTAIN}
    for line, before, now, rapid in control.passes:
        for axis in range(3):
            claim = after[line][axis]
            assert math.isnan(claim) or abs(claim - now[axis]) < 1e-9, (data.decode(), line)
            if line in certain:
                assert rapid, (data.decode(), line)
                i = certain[line]
                named = rapids.words[i] >> axis & 1
                assert not (named and math.isnan(rapids.start[i, axis] + rapids.target[i, axis]))
                for known, real in ((rapids.start, before), (rapids.target, now)):
                    claim = known[i, axis]
                    assert math.isnan(claim) or abs(claim - real[axis]) < 1e-9, (
                        data.decode(),
                        line,
                    )
    return len(certain)


@settings(max_examples=50)
@given(fanuc_programs(), st.tuples(numbers, numbers), st.tuples(numbers, numbers, numbers))
def test_what_is_known_holds_on_every_pass(programs, hidden, at):
    check(programs, hidden, at, Start())
    check(programs, hidden, (0, 0, 0), START)
