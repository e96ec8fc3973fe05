"""Streams that are the same text are made once: what is written must not show it."""

import io

import numpy as np
import pytest

from gcodejerk import Machine, find_machine, process, verify
from gcodejerk.emit import load_controller
from gcodejerk.motion.profiles.repeated import RepeatedProfiles
from gcodejerk.nc import read_program
from gcodejerk.planning.plans import MIXING, same_rows
from gcodejerk.planning.rapids import plan_rapids
from gcodejerk.planning.stream import make_streams
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.rewrite import same_streams as module
from gcodejerk.rewrite import writing
from gcodejerk.rewrite.pipeline import Settings, process_file

VMC = Machine.load(find_machine("vmc"))
HEAD = b"G21 G90 G94 G17 G40 G64\nG0 X0 Y0 Z5\nF100\n"
PROGRAMS = {
    "the same places again": HEAD + b"G0 X-40 Y-30\nG1 Z-3\nG0 Z5\nG0 X0 Y0\nG1 Z-3\nG0 Z5\n" * 6,
    "F": HEAD + b"".join(b"G1 Z-3 F%d\nG0 Z5\n" % (100 + k % 3) for k in range(12)),
    "path modes": HEAD + b"G61\nG1 Z-3\nG0 Z5\nG64\nG1 Z-3\nG0 Z5\n" * 4,
    "streams in front": HEAD + b"G0 Z-3\nG0 Z5\nG1 Z-3\nG0 Z5\nG0 X-9\nG0 Z-3\nG0 Z5\nG0 X0\n" * 4,
    "words": HEAD + b"".join(b"G1 Z-3\nN%d G0 Z5 (%d)\n" % (k % 2, k % 3) for k in range(12)),
    "spelling": HEAD + b"G1 Z-3\nG0 Z5\nG1 Z-3\nG0 Z5.0\nG1 Z-3\ng0z5\nG1 Z-3\nG0  Z5\n" * 3,
    "increments": HEAD + b"G91\n" + b"G1 Z-8\nG0 Z8\nG0 X-30\nG1 Z-8\nG0 Z8\nG0 X30\n" * 4,
    "inches": HEAD + b"G20\nF5\n" + b"G1 Z-.1\nG0 Z.2\nG0 X-1.5\nG1 Z-.1\nG0 Z.2\nG0 X-3\n" * 4,
    "line ends": HEAD + b"G1 Z-3\nG0 Z5\r\nG1 Z-3\nG0 Z5\n" * 4,
    "the last line": HEAD + b"G1 Z-3\nG0 Z5\n" * 4 + b"G1 Z-3\nG0 Z5",
    "left alone": HEAD + b"G1 Z-3\nG0 Z5\nG0 Z4.99\nG0 Z5\n" * 4,
}  # fmt: skip


def written(program, controller, monkeypatch, shared):
    with monkeypatch.context() as patch:
        if not shared:
            patch.setattr(writing, "same_streams", lambda *a: None)
        target = io.BytesIO()
        settings = Settings(controller=controller)
        result = process_file(io.BytesIO(program), target, VMC, settings, "x.nc")
    return target.getvalue(), result


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("controller", ["linuxcnc", "grbl"])
def test_what_is_written_once_or_each_time_is_the_same(name, controller, monkeypatch):
    program = PROGRAMS[name]
    again, each = (written(program, controller, monkeypatch, one) for one in (True, False))
    assert again[0] == each[0]
    assert again[1].planned >= 4
    assert again[1].edits.tolist() == each[1].edits.tolist()
    assert again[1].plans.reason.tolist() == each[1].plans.reason.tolist()
    assert np.allclose(again[1].residual, each[1].residual, rtol=1e-9, atol=1e-12, equal_nan=True)


def likes(program, controller="linuxcnc"):
    """The first move that has the stream of each, of those that are planned."""
    found = read_program(io.BytesIO(program), name="x.nc", dialect=controller)
    emitter = load_controller(controller)
    plans = plan_rapids(found.rapids, VMC)
    spelled = emitter.number_format(found.rapids, VMC, found.language)
    like = module.same_streams(plans, found.rapids, spelled, io.BytesIO(program), 2)
    moves = np.flatnonzero(plans.planned)
    return moves if like is None else like[moves]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (b"G1 Z-3\nG0 Z5\n", b"G1 Z-2\nG0 Z5\n"),
        (b"G1 Z-3\nG0 Z5\n", b"G1 Z-3\nG0 Z5.\n"),
        (b"G1 Z-3 F100\nG0 Z5\n", b"G1 Z-3 F200\nG0 Z5\n"),
        (b"G61\nG1 Z-3\nG0 Z5\n", b"G64\nG1 Z-3\nG0 Z5\n"),
        (b"G64 P.01\nG1 Z-3\nG0 Z5\n", b"G64 P.02\nG1 Z-3\nG0 Z5\n"),
        (b"G21\nG1 Z-3 F9\nG0 Z5\n", b"G20\nG1 Z-.3 F9\nG0 Z5\nG21\n"),
        (b"G1 Z-3\nG0 Z5\n", b"G1 Z-3\nG0 Z5\r\n"),
        (b"G1 Z-3\nG0 Z5\n", b"G1 Z-3\nG0 Z5 (a)\n"),
        (b"G1 Z-3\nG0 Z5\nG0 X-50\nG1 Y1\nG0X0\n", b"G1 Z-3\nG0 Z5\nG1 Y1\nG0 X-50\nG1 Y2\nG0X0\n"),
    ],
)  # fmt: skip
def test_whatever_changes_the_text_parts_two_streams(one, other):
    """Each by itself is made once; the two are made apart."""
    count = len(np.unique(likes(HEAD + one * 4)))
    both = likes(HEAD + (one + other) * 4)
    alone = len(np.unique(likes(HEAD + other * 4)))
    assert len(both) >= 8
    assert len(np.unique(both)) > max(count, alone)


def test_only_so_much_text_is_kept(monkeypatch):
    places = b"".join(b"G0 X-%d Y-%d\nG1 Z-3\nG0 Z5\n" % (3 * k, k) for k in range(2, 12))
    program = HEAD + places * 4
    whole = written(program, "linuxcnc", monkeypatch, True)[0]
    kept = []
    text_again = writing.Rewriter._text_again

    def watched(self, first):
        kept.append(sum(map(len, self.kept.values())))
        return text_again(self, first)

    monkeypatch.setattr(writing.Rewriter, "_text_again", watched)
    assert written(program, "linuxcnc", monkeypatch, True)[0] == whole
    most, asked = max(kept), len(kept)
    kept.clear()
    monkeypatch.setattr(module, "KEPT_BYTES", 4000)
    assert written(program, "linuxcnc", monkeypatch, True)[0] == whole
    assert 0 < max(kept) < most / 2
    assert len(kept) < asked


def test_a_stream_that_is_no_gain_is_left_alone_wherever_it_stands():
    program = HEAD + b"G1 Z-3\nG0 Z5\n" * 6
    found = read_program(io.BytesIO(program), name="x.nc", dialect="linuxcnc")
    plans = plan_rapids(found.rapids, VMC)
    moves = np.flatnonzero(plans.planned)
    plans.most_in_band[moves] = 0.0
    emitter = load_controller("linuxcnc")
    spelled = emitter.number_format(found.rapids, VMC, found.language)
    like = np.arange(len(plans))
    like[moves] = moves[0]
    assert list(make_streams(plans, spelled, 2, emitter.play, like)) == []
    assert set(plans.reason[moves].tolist()) == {REASONS.index(Reason.NOT_BETTER)}


def test_an_emitter_that_writes_more_than_the_key_holds_makes_each():
    class Numbered(type(load_controller("grbl"))):
        def render(self, batch, rapids, blocks, newline, options):
            return super().render(batch, rapids, blocks, newline, options)

    assert load_controller("grbl").repeats
    assert load_controller("linuxcnc").repeats
    assert not Numbered().repeats
    assert not load_controller("csv").repeats
    assert not load_controller("linuxcnc-hal").repeats


@pytest.mark.parametrize("mixing", [MIXING, np.uint64(0)])
def test_sorts_of_rows_are_those_of_their_bits(mixing, monkeypatch):
    """Also where all rows look alike at first sight, as they do when multiplied by 0."""
    monkeypatch.setattr("gcodejerk.planning.plans.MIXING", mixing)
    rng = np.random.default_rng(3)
    columns = (
        rng.integers(0, 3, (200, 2)).astype(float) * rng.choice([1.0, -1.0, np.nan], (200, 2)),
        rng.integers(0, 2, 200).astype(bool),
        np.full(200, 7, dtype=np.uint8),
    )
    keys = [b"".join(np.ascontiguousarray(c[k]).tobytes() for c in columns) for k in range(200)]
    order = list(dict.fromkeys(keys))
    first, like = same_rows(*columns)
    assert like.tolist() == [order.index(key) for key in keys]
    assert first.tolist() == [keys.index(key) for key in order]
    assert [part.tolist() for part in same_rows(np.zeros((0, 3)))] == [[], []]


def test_repeated_profiles_are_the_profiles():
    found = read_program(io.BytesIO(PROGRAMS["F"]), name="x.nc", dialect="linuxcnc")
    profiles = plan_rapids(found.rapids, VMC).profiles
    assert isinstance(profiles, RepeatedProfiles)
    assert len(profiles.distinct) < len(profiles)
    whole = profiles.take(slice(None))
    names = "first begin duration position velocity acceleration jerk total peak_velocity"
    names += " least_velocity peak_acceleration greatest_jerk peak_jerk owner"
    for name in names.split():
        assert np.array_equal(getattr(profiles, name), getattr(whole, name)), name
    assert profiles.segments(3) == whole.segments(3)
    twice = RepeatedProfiles(profiles, np.array([3, 1]))
    assert twice.distinct is profiles.distinct
    assert twice.total.tolist() == profiles.total[[3, 1]].tolist()


# Of two rapids with one and the same block the stream of the first, in the place of the second.
TAKEN = {
    "from another depth": (b"G1 Z-3\nG0 Z5\n", b"G1 Z-2.5\nG0 Z5\n"),
    "with another F behind it": (b"G1 Z-3 F100\nG0 Z5\n", b"G1 Z-3 F200\nG0 Z5\n"),
    "from another path mode": (b"G61\nG1 Z-3\nG0 Z5\n", b"G64\nG1 Z-3\nG0 Z5\n"),
}


@pytest.mark.parametrize("controller", ["linuxcnc", "haas"])
@pytest.mark.parametrize("name", TAKEN)
def test_a_proven_stream_in_the_place_of_another_is_found(name, controller):
    one, other = TAKEN[name]
    program = HEAD + one * 5 + other * 5
    result = process(program, VMC, controller=controller)
    output, spans = result.output, result.edits[result.edits[:, 2] >= 0, :2].tolist()
    assert len(spans) >= 10
    first, last = spans[2], spans[-2]
    texts = [output[slice(*span)] for span in (first, last)]
    assert texts[0] != texts[1]
    bad = output[: last[0]] + texts[0] + output[last[1] :]
    found = verify(program, bad, VMC, controller=controller)
    line = bad.count(b"\n", 0, last[0]) + 1
    assert not found.ok
    assert 0 <= found.violations[0].line - line < 60
