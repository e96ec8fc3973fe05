"""Thousands of streams that are alike: what is judged once must not hide the one that is not."""

import io
import re
from dataclasses import fields, replace

import numpy as np
import pytest

from gcodejerk import Machine, find_machine, process, verify
from gcodejerk.nc import Rapids, read_program
from gcodejerk.verification import proof, streams
from gcodejerk.verification.bytes.alignment import Alignment
from gcodejerk.verification.bytes.proven import Proven
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.bytes.states import States
from gcodejerk.verification.physics.alike import Alike

VMC = Machine.load(find_machine("vmc"))
HOLES = 400
AT = 250


def drilling(incremental=False):
    """Holes in a row, the same way from one to the next."""
    lines = [b"%", b"G21 G90 G94 G17 G40 G49 G64", b"G0 Z5", b"G0 X-450 Y-100", b"F600"]
    lines += [b"G91"] if incremental else []
    for k in range(HOLES):
        x = b"1.000" if incremental else b"%.3f" % (-449 + k)
        z = b"8." if incremental else b"5."
        lines += [
            b"N%d G0 X%s" % (4 * k + 10, x) if k % 2 else b"G0 X" + x,
            b"G1 Z%s" % (b"-8." if incremental else b"-3."),
            b"G0 Z" + z,
        ]
    return b"\n".join([*lines, b"M2", b"%", b""])


def processed(controller, program):
    machine = replace(VMC, controller=controller)
    return machine, process(program, machine, controller=controller, verify=False).output


@pytest.fixture
def one_by_one(monkeypatch):
    """Verification without anything that is judged once for many."""

    def turn_on():
        monkeypatch.setattr(Alike, "judge", lambda self, paths, judge, found: judge(paths, found))
        monkeypatch.setattr(Alignment, "remembers", False)

    return turn_on


def digit(output, at):
    """Another digit in the place of one."""
    new = b"%d" % ((output[at] - 48 + 4) % 10)
    return output[:at] + new + output[at + 1 :]


def in_point(output, begin, word, place, point):
    """Change a digit of a word of a point."""
    lines = [m for m in re.finditer(rb"\nG1 [XZ](-?[0-9.]+) F([0-9.]+)", output[begin:])]
    at = lines[point].end(word) - place if place else lines[point].start(word)
    return digit(output, begin + at)


DAMAGES = {
    "a point by thousands of its last digits": lambda out, b: in_point(out, b, 1, 3, 5),
    "F of a point": lambda out, b: in_point(out, b, 2, None, 7),
    "the comment": lambda out, b: digit(out, out.index(b")", b) - 1),
    "two points change places": lambda out, b: _swapped(out, b),
    "a point is missing": lambda out, b: _without(out, b),
    "a line in front of the points": lambda out, b: _insert(out, b, b"G61\n"),
    "a line end": lambda out, b: out[: out.index(b"\n", b)] + b"\r" + out[out.index(b"\n", b) :],
}


def _points(out, b):
    return [m.span() for m in re.finditer(rb"G1 [XZ]-?[0-9.]+ F[0-9.]+\n", out[b : b + 4000])]


def _swapped(out, b):
    (p, q), (r, s) = _points(out, b)[4:6]
    return (
        out[: b + p] + out[b + r : b + s] + out[b + q : b + r] + out[b + p : b + q] + out[b + s :]
    )


def _without(out, b):
    p, q = _points(out, b)[6]
    return out[: b + p] + out[b + q :]


def _insert(out, b, line):
    p, _ = _points(out, b)[0]
    return out[: b + p] + line + out[b + p :]


@pytest.mark.parametrize("incremental", [False, True])
@pytest.mark.parametrize("controller", ["linuxcnc", "haas"])
def test_one_damaged_stream_among_hundreds_alike_is_found(
    controller, incremental, one_by_one, monkeypatch
):
    # Most batches come behind those from which something was learned.
    monkeypatch.setattr(streams, "BATCH_BYTES", 1 << 16)
    program = drilling(incremental)
    machine, output = processed(controller, program)
    begins = [m.start() for m in re.finditer(rb"\(gcodejerk: ", output)]
    assert len(begins) >= 2 * HOLES - 2
    assert verify(program, output, machine).ok
    damaged = {}
    for name, damage in DAMAGES.items():
        begin = begins[AT + len(damaged) % 2]
        bad = damage(output, begin)
        damaged[name] = bad, output.count(b"\n", 0, begin) + 1
    found = {name: verify(program, bad, machine) for name, (bad, _) in damaged.items()}
    for name, result in found.items():
        assert not result.ok, name
        assert 0 <= result.violations[0].line - damaged[name][1] < 60, name
    one_by_one()
    for name, (bad, _) in damaged.items():
        assert verify(program, bad, machine) == found[name], name


def test_what_is_alike_is_judged_once(monkeypatch):
    program = drilling()
    machine, output = processed("haas", program)
    seen = []
    judge = streams.check_line
    monkeypatch.setattr(
        streams,
        "check_line",
        lambda paths, *rest: (seen.append(len(paths.begin)), judge(paths, *rest)),
    )
    assert verify(program, output, machine).ok
    assert sum(seen) < 10


@pytest.mark.parametrize(
    "column", ["position", "feed", "displacement", "unit", "speed", "step", "lone", "lead"]
)
def test_whatever_enters_the_judgement_is_in_the_key(column):
    """A change of any column of a stream, in the last digit that is judged, is another stream."""
    machine, output = processed("haas", drilling())
    kept = []

    class Spy(Alike):
        def keys(self, paths):
            kept.append(paths)
            return super().keys(paths)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(proof, "Alike", Spy)
        verify(drilling(), output, machine)
    paths = kept[0]
    before = Alike({}).keys(paths)
    values = np.array(getattr(paths, column))
    of_rows = column in ("position", "feed")
    at = (int(paths.begin[7]) + 3 if of_rows else 7, *([0] if values.ndim == 2 else []))
    values[at] = ~values[at] if column == "lone" else values[at] + 2e-9 if of_rows else 7.0
    after = Alike({}).keys(replace(paths, **{column: values}))
    assert [k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a != b] == [7]


def keys_of(rapids, reported=None, follows=False, block=b"G0 Z5\n"):
    proven = Proven(Window(io.BytesIO()), rapids, States(rapids), reported or {})
    return [proven.key(i, block, follows) for i in range(len(rapids))]


@pytest.fixture(scope="module")
def rapids():
    found = read_program(io.BytesIO(drilling()), name="x.nc", dialect="linuxcnc").rapids
    return replace(found, **{f.name: getattr(found, f.name).copy() for f in fields(found)})


COLUMNS = sorted({f.name for f in fields(Rapids)} - {"line", "begin", "end"})


@pytest.mark.parametrize("column", COLUMNS)
def test_what_was_proven_of_another_rapid_proves_nothing_of_this_one(rapids, column):
    values = getattr(rapids, column).copy()
    named = int(rapids.words[20]).bit_length() - 1
    at = (20, named) if values.ndim == 2 else 20
    values[at] = ~values[at] if values.dtype == bool else 77
    before, after = keys_of(rapids), keys_of(replace(rapids, **{column: values}))
    assert [k for k, (a, b) in enumerate(zip(before, after, strict=True)) if a != b] == [20]


def test_where_an_axis_stands_that_a_block_does_not_move_proves_as_much(rapids):
    keys = keys_of(rapids)
    # Holes at many places; the way out of each is the same.
    assert rapids.start[21, 0] != rapids.start[23, 0]
    assert keys[21] == keys[23] or keys[20] == keys[22]
    assert keys_of(rapids, follows=True)[20] != keys[20]
    assert keys_of(rapids, block=b"G0 Z5.\n")[20] != keys[20]
    profile = np.array([[0.01, 5.0], [0.02, -5.0]])
    told = keys_of(rapids, {int(rapids.line[20]): profile})
    other = keys_of(rapids, {int(rapids.line[20]): profile + 1e-12})
    assert len({told[20], other[20], keys[20]}) == 3


def test_nothing_is_proven_before_it_was_judged_or_once_anything_was_wrong(rapids):
    window = Window(io.BytesIO(b"G1 Z1\nG1 Z1\n"))
    proven = Proven(window, rapids, States(rapids), {})
    proven.read(b"key", b"G1 Z1\n")
    assert not proven.passes(b"key")
    proven.judged(False)
    assert not proven.passes(b"key")
    proven.read(b"key", b"G1 Z1\n")
    proven.judged(True)
    assert not proven.passes(b"another")
    assert proven.passes(b"key")
    assert window.line == 2
    proven.known[b"key"] = b"G1 Z2\n"
    assert not proven.passes(b"key")
    assert window.peek(6) == b"G1 Z1\n"


def test_what_is_the_same_to_the_byte_is_read_once(monkeypatch):
    program = drilling()
    machine, output = processed("linuxcnc", program)
    judged = []
    monkeypatch.setattr(Proven, "read", lambda self, key, text: judged.append(key))
    assert verify(program, output, machine).ok
    every = len(judged)
    monkeypatch.undo()
    read = Proven.read
    judged.clear()
    monkeypatch.setattr(
        Proven, "read", lambda self, key, text: (judged.append(key), read(self, key, text))[1]
    )
    monkeypatch.setattr(streams, "BATCH_BYTES", 1 << 14)
    assert verify(program, output, machine).ok
    assert len(judged) < 0.6 * every
