"""Damage of every kind, done to processed programs of every dialect: `verify` notices each.

Damage is done in two ways: as it is, where the sum in the stamp shows any change of any byte; and
with the sum put right by this file, so that what the other checks notice is known too. The drawn
programs get every other kind, and every fourth in the first way, others from program to program;
the programs that have room for all get all. `SUM_ALONE` lists what the other checks cannot notice,
with the reason.
"""

import hashlib
import random
import re
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import DIALECTS as DIALECTS_BY_NAME
from gcodejerk.rewrite.pipeline import process
from gcodejerk.testing.vocabulary import VOCABULARIES
from gcodejerk.verification import verify

SETTINGS = settings(
    deadline=None,
    max_examples=2,
    # Which damage was missed matters, not the smallest program for it.
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
    suppress_health_check=list(HealthCheck),
)
SPELLED_ALIKE = {
    *("uccnc", "edingcnc", "planetcnc", "masso", "mitsubishi", "mazatrol-eia", "syntec"),
}
"""Their streams are spelled as those of rs274 and iso-mill."""
DIALECTS = ["linuxcnc", *sorted(VOCABULARIES.keys() - SPELLED_ALIKE)]
POINT = re.compile(rb"G1 .*F[0-9.]+")
ZEROS = b"0" * 240
STANDSTILL = rb"((?:G4 [PF]|M400)[^\r\n]*\r?\n)"
COMMENTS = (b"(gcodejerk: ", b"; gcodejerk: ")
SUM = re.compile(rb"(gcodejerk stamp [ -~]{1,40}? sum:)([0-9a-f]{16})")
AXIS = rb"([XYZABC])(-?[0-9.]+)"
_VMC = Machine.load(find_machine("vmc"))
STEP = max(axis.resolution for axis in _VMC.axes)


def machine_for(dialect):
    """A machine without travel, from a known start: so that there is much to rewrite."""
    turned = "lathe" in dialect
    axes = tuple(replace(a, travel=None, diameter=turned and a.name == "X") for a in _VMC.axes)
    start = dict.fromkeys("XYZ", 0.0)
    # Of Siemens' F the basic unit decides, which no program says.
    startup = "G71" if dialect == "siemens" else ""
    program = replace(_VMC.program, start=start, startup=startup, decimal_point="calculator")
    return replace(_VMC, axes=axes, program=program)


@st.composite
def calm_programs(draw, dialect):
    """A program with long rapids of every kind that can be rewritten."""
    words = VOCABULARIES.get(dialect)
    inch = False
    if words is None:
        modes = ["G21 G90 G94 G64 P0.02", "G21 G90 G94 G61", "G21 G90 G93 G61.1", "G20 G90 G94"]
        head = [draw(st.sampled_from(modes))]
        inch = "G20" in head[0]
        if "G93" not in head[0]:
            head.append("F60")
        lines = [*head, "G0 X0 Y0 Z0"]
        axes, incremental, stated = "XYZ", True, False
        between = ["M9", "(cut)", "G1 Y2.5 F33"]
    else:
        lines = list(words.head)
        axes, incremental, stated = words.axes, words.incremental and not words.stated, words.stated
        # Rapids of printers run at F: at a low one, a point less is no more than rounding.
        feed = "F3000" if stated else "F90"
        between = [f"G1 X2.5 {feed}", "M5", words.comments[0]]
    # What the control runs in front of the motion, behind it, and at a time of its own.
    table = DIALECTS_BY_NAME[dialect]
    others = [f" M{m}" for m in (8, 1, 5) if m in table.before_m | table.after_m]
    if table.exact_stop is not None and table.exact_stop in table.harmless:
        others.append(" G9")
    for _ in range(draw(st.integers(2, 4))):
        named = draw(st.lists(st.sampled_from(axes), min_size=1, max_size=3, unique=True))
        mode = draw(st.sampled_from(["G90 ", "G91 ", ""])) if incremental else ""
        # Odd thousands: no drawn rapid is without way, and few are equal.
        values = [
            draw(st.sampled_from([-1, 1])) * (2 * draw(st.integers(500, 4_000)) + 1) / 1000
            for _ in named
        ]
        texts = [f"{a}{v / 25.4 if inch else v:.4f}" for a, v in zip(named, values, strict=True)]
        beside = "" if stated else draw(st.sampled_from(["", *others]))
        lines.append(f"{mode}G0 {' '.join(texts)}{beside}")
        lines.append(draw(st.sampled_from(between)))
    if words is not None and draw(st.booleans()):
        first = 1 if lines[0].startswith("O") else 0
        lines = lines[:first] + [f"N{10 * k} {x}" for k, x in enumerate(lines[first:], 1)]
    newline = draw(st.sampled_from(["\n", "\r\n"]))
    return (newline.join([*lines, "M2"]) + newline).encode()


class Text:
    """An output as lines: which of them are points, tails, comments of streams, kept."""

    def __init__(self, data, output):
        self.lines = output.splitlines(keepends=True)
        originals = data.splitlines(keepends=True)
        self.points, self.tails, self.comments, inside = [], [], [], False
        stamps = (n for n, line in enumerate(self.lines) if b"gcodejerk stamp" in line)
        self.stamp = next(stamps, None)
        for n, line in enumerate(self.lines):
            bare = line.rstrip()
            if bare.startswith(COMMENTS):
                self.comments.append(n)
                inside, started = True, False
            elif inside and POINT.fullmatch(bare):
                self.points.append(n)
                started = True
            elif inside and started:
                self.tails.append(n)
                inside = False
        kept = set(originals)
        ours = {*self.points, *self.tails, *self.comments, self.stamp}
        self.kept = [n for n, line in enumerate(self.lines) if line in kept and n not in ours]
        self.inner = [
            n for n in self.points if n - 1 in self.points and {n + 1, n + 2} <= set(self.points)
        ]

    def sub(self, n, pattern, change):
        """The whole output with something replaced in line n; None if it is not there."""
        after = re.sub(pattern, change, self.lines[n], count=1)
        return None if after == self.lines[n] else self.cut(n, after)

    def cut(self, n, *instead):
        return b"".join([*self.lines[:n], *instead, *self.lines[n + 1 :]])

    def runs(self):
        """Points of each stream."""
        runs = []
        for n in self.points:
            if runs and runs[-1][-1] == n - 1:
                runs[-1].append(n)
            else:
                runs.append([n])
        return runs

    def heads(self):
        """Lines between a stream's comment and its points."""
        ours = {*self.points, *self.tails, *self.comments, self.stamp}
        return [
            n
            for run in self.runs()
            for n in range(max(k for k in self.comments if k < run[0]) + 1, run[0])
            if n not in ours
        ]

    def stops(self):
        """Whether an exact stop is in force, so that a stream begins with G64 anyway."""
        return any(b"G64" in self.lines[n] for n in self.heads())

    def text(self, run):
        return b"".join(self.lines[n] for n in run)


def _scaled(factor):
    return lambda match: b"F%.4f" % (float(match[1]) * factor)


def _shift(steps):
    def change(match):
        places = len(match[2].partition(b".")[2])
        return match[1] + b"%.*f" % (places, float(match[2]) + steps * 10.0**-places)

    return change


def _swap(t, p):
    """Two points exchanged; increments of one speed differ by their rounding only, so not those."""
    one, other = t.lines[p], t.lines[p + 1]
    words = ([float(x) for x in re.findall(rb"[XYZABC](-?[0-9.]+)", line)] for line in (one, other))
    # F tells the rounding, too: two steps in each of the two points.
    alike = max(abs(a - b) for a, b in zip(*words, strict=True)) <= 4.0 * STEP
    if alike:
        return None
    return b"".join([*t.lines[:p], other, one, *t.lines[p + 2 :]])


def _flip(match):
    return match[1] + (b"" if match[0].endswith(b"-") else b"-")


def _other_end(match):
    return b"\n" if match[0] == b"\r\n" else b"\r\n"


def _pairs(t):
    runs = t.runs()
    return ((a, b) for k, a in enumerate(runs) for b in runs[k + 1 :] if t.text(a) != t.text(b))


def _exchange(t):
    """The points of two streams, exchanged."""
    for a, b in _pairs(t):
        between = b"".join(t.lines[a[-1] + 1 : b[0]])
        rest = b"".join(t.lines[b[-1] + 1 :])
        return b"".join(t.lines[: a[0]]) + t.text(b) + between + t.text(a) + rest
    return None


def _instead(t):
    """One stream in the place of another, as well as in its own."""
    for a, b in _pairs(t):
        return b"".join(t.lines[: b[0]]) + t.text(a) + b"".join(t.lines[b[-1] + 1 :])
    return None


def _lost_stream(t):
    """A stream lost with its comment and tail: the rapid is not made at all."""
    return b"".join(t.lines[: t.comments[0]] + t.lines[t.tails[0] + 1 :])


def _moved_up(t):
    """A kept line moved in front of the line before it."""
    for n in t.kept:
        if n and t.lines[n - 1] != t.lines[n] and n - 1 != t.stamp:
            return b"".join([*t.lines[: n - 1], t.lines[n], t.lines[n - 1], *t.lines[n + 1 :]])
    return None


def _of(t, lines, pattern, change):
    """Something changed in the first of these lines that holds it."""
    results = (t.sub(n, pattern, change) for n in lines)
    return next((result for result in results if result is not None), None)


def _kept(t, pattern, change):
    return _of(t, t.kept, pattern, change)


def _before(t, p, line):
    """A line put in front of the stream that a point belongs to."""
    first = next(run[0] for run in t.runs() if p in run)
    end = b"\r\n" if t.lines[p].endswith(b"\r\n") else b"\n"
    return t.cut(first, line + end, t.lines[first])


def _doubled(t, p):
    """A point twice; at the slow ends a block without way is less than the rounding of points."""
    feeds = [float(t.lines[n].rpartition(b"F")[2]) for run in t.runs() if p in run for n in run]
    slow = float(t.lines[p].rpartition(b"F")[2]) < 0.25 * max(feeds)
    return None if slow else t.cut(p, t.lines[p], t.lines[p])


def _rapid_before(t, p):
    """G0 in front of a stream; right behind another stream it says what is in force."""
    first = next(run[0] for run in t.runs() if p in run)
    comment = max(n for n in t.comments if n < first)
    return None if comment - 1 in t.tails else _before(t, p, b"G0")


def _moved_stop(t, p):
    """The exact stop of a last point, on the first one instead."""
    for run in t.runs():
        found = re.search(rb" G(9|6[01](\.1)?)(?= )", t.lines[run[-1]])
        if found and len(run) > 1:
            lines = list(t.lines)
            lines[run[-1]] = lines[run[-1]].replace(found[0], b"", 1)
            lines[run[0]] = lines[run[0]].replace(b"G1", b"G1" + found[0], 1)
            return b"".join(lines)
    return None


def _whole(t, p, e):
    """The decimal point lost, where the control may then count increments."""
    if t.dialect.split("-")[0] not in ("fanuc", "haas"):
        return None
    return _of(t, [e - 1, e], rb"([A-Z]-?[0-9]*[1-9][0-9]*)\.0*(?![0-9])", rb"\1")


# Each takes a Text, the line of a point (neither first nor last of its stream), and of a tail.
DAMAGE = {
    "feed 1 % up": lambda t, p, e: t.sub(p, rb"F([0-9.]+)", _scaled(1.01)),
    "feed 1 % down": lambda t, p, e: t.sub(p, rb"F([0-9.]+)", _scaled(0.99)),
    "feed of another unit": lambda t, p, e: t.sub(p, rb"F([0-9.]+)", _scaled(60.0)),
    "feed doubled": lambda t, p, e: t.sub(p, rb"F([0-9.]+)", _scaled(2.0)),
    "feed lost": lambda t, p, e: t.sub(p, rb" F[0-9.]+", b""),
    "feed zero": lambda t, p, e: t.sub(p, rb"F[0-9.]+", b"F0.0"),
    "feed negative": lambda t, p, e: t.sub(p, rb"F", b"F-"),
    "point moved by one step": lambda t, p, e: t.sub(p, AXIS, _shift(1)),
    "point moved far": lambda t, p, e: t.sub(p, AXIS, _shift(20000)),
    "wrong sign": lambda t, p, e: t.sub(p, rb"([XYZABC])-?(?=[0-9.]*[1-9])", _flip),
    "decimal point of a point lost": lambda t, p, e: t.sub(p, rb"([XYZ]-?[0-9]+)\.", rb"\1"),
    "decimal point of a word lost": _whole,
    "digit of a point lost": lambda t, p, e: t.sub(p, rb"([XYZ]-?[0-9]*[1-9])\.", rb"\g<1>0."),
    "point dropped": lambda t, p, e: t.cut(p),
    "point doubled": lambda t, p, e: _doubled(t, p),
    "points swapped": lambda t, p, e: _swap(t, p),
    "points from another stream": lambda t, p, e: _instead(t),
    "streams exchanged": lambda t, p, e: _exchange(t),
    "stream lost": lambda t, p, e: _lost_stream(t),
    "point as rapid": lambda t, p, e: t.sub(p, rb"G1", b"G0"),
    "point as arc": lambda t, p, e: t.sub(p, rb"G1", b"G2"),
    "point with another axis": lambda t, p, e: t.sub(p, rb" F", b" C1. F"),
    "point with an axis twice": lambda t, p, e: t.sub(p, rb"( [XYZ][^ ]+)", rb"\1\1"),
    "point with an axis less": lambda t, p, e: t.sub(p, rb" [XYZ][^ ]+", b""),
    "point of another axis": lambda t, p, e: t.sub(p, rb" [XYZ]", b" A"),
    "point with a switch": lambda t, p, e: t.sub(p, rb" F", b" M8 F"),
    "point with a number": lambda t, p, e: t.sub(p, rb"G1", b"N1 G1"),
    "point without code": lambda t, p, e: t.sub(p, rb"G1 ", b""),
    "point in a comment": lambda t, p, e: t.sub(p, rb"(G1[^\r\n]*)", rb"(\1)"),
    "point behind a semicolon": lambda t, p, e: t.sub(p, rb"G1", b";G1"),
    "point with block delete": lambda t, p, e: t.sub(p, rb"G1", b"/G1"),
    "point in lower case": lambda t, p, e: t.sub(p, rb"G1", b"g1"),
    "G91 within a stream": lambda t, p, e: t.sub(p, rb"G1", b"G1 G91"),
    "line end of a point": lambda t, p, e: t.sub(p, rb"\r?\n", _other_end),
    "blank line among the points": lambda t, p, e: t.cut(p, b"\n", t.lines[p]),
    "comment among the points": lambda t, p, e: t.cut(p, b"(x)\n", t.lines[p]),
    "unit word in front": lambda t, p, e: _before(t, p, b"G20"),
    "metric word in front": lambda t, p, e: _before(t, p, b"G71"),
    "dwell in front": lambda t, p, e: _before(t, p, b"G4 P500"),
    "offset in front": lambda t, p, e: _before(t, p, b"G92 X0"),
    "other distance mode in front": lambda t, p, e: _before(
        t, p, b"G90" if t.incremental(p) else b"G91"
    ),
    # grbl's G61 is no exact stop, and always in force.
    "exact stop in front": lambda t, p, e: None if t.dialect == "grbl" else _before(t, p, b"G61"),
    "inverse time in front": lambda t, p, e: _before(t, p, b"G93"),
    "end shifted": lambda t, p, e: t.sub(e - 1, AXIS, _shift(1)),
    "end shifted in a new decimal": lambda t, p, e: t.sub(e - 1, rb"( F)", rb"0000001\1"),
    "end point lost": lambda t, p, e: t.cut(e - 1),
    "end point doubled": lambda t, p, e: t.cut(e - 1, t.lines[e - 1], t.lines[e - 1]),
    "tail lost": lambda t, p, e: t.cut(e),
    "tail doubled": lambda t, p, e: t.cut(e, t.lines[e], t.lines[e]),
    "G0 lost": lambda t, p, e: t.sub(e, rb"G0", b""),
    "G0 turned G1": lambda t, p, e: t.sub(e, rb"G0", b"G1"),
    "F not restored": lambda t, p, e: _of(t, t.tails, rb" F[0-9.]+", b""),
    "F restored wrongly": lambda t, p, e: _of(t, t.tails, rb"F([0-9.]+)", _scaled(1.01)),
    "G61 not restored": lambda t, p, e: _of(t, t.points, rb" G6[01](\.1)?(?= )", b""),
    "exact stop lost": lambda t, p, e: _of(t, t.points, rb" G9(?= )", b""),
    "exact stop too early": lambda t, p, e: t.sub(p, rb"G1 ", b"G1 G9 "),
    "exact stop on the first point": lambda t, p, e: _moved_stop(t, p),
    "exact stop within a stream": lambda t, p, e: t.sub(p, rb"G1 ", b"G1 G61 "),
    "exact stop twice": lambda t, p, e: _of(t, t.points, rb"( G(?:9|61))(?= )", rb"\1\1"),
    "exact stop behind the points": lambda t, p, e: t.sub(e, rb"G0", b"G0 G61"),
    "other path mode at the end": lambda t, p, e: t.sub(e - 1, rb"G1 ", b"G1 G64 "),
    "G64 behind the points": lambda t, p, e: t.sub(e, rb"G0", b"G0 G64"),
    "G641 behind the points": lambda t, p, e: t.sub(e, rb"G0", b"G0 G641"),
    "G641 for G64": lambda t, p, e: _of(t, t.heads(), rb"G64(?![0-9])", b"G641"),
    "G64 in front": lambda t, p, e: None if t.stops() else _before(t, p, b"G64"),
    "G641 in front": lambda t, p, e: _before(t, p, b"G641"),
    "tolerance in front": lambda t, p, e: _before(t, p, b"G64 P5"),
    "F in front": lambda t, p, e: _before(t, p, b"F500.0"),
    "negative F in front": lambda t, p, e: _before(t, p, b"F-1"),
    "G0 in front": lambda t, p, e: _rapid_before(t, p),
    "standstill twice": lambda t, p, e: _of(t, t.heads(), STANDSTILL, rb"\1\1"),
    "standstill lost": lambda t, p, e: _of(t, t.heads(), STANDSTILL, b""),
    "standstill longer": lambda t, p, e: _of(t, t.heads(), rb"G4 ([PF])", rb"G4 \g<1>9"),
    "zeros behind a point": lambda t, p, e: t.sub(p, rb" F", ZEROS + b" F"),
    "zeros in front of a point": lambda t, p, e: t.sub(p, AXIS, rb"\g<1>" + ZEROS + b"1."),
    "zeros behind an end": lambda t, p, e: t.sub(
        e - 1, rb"\.([0-9]*) F", rb".\g<1>" + ZEROS + b" F"
    ),
    "zeros behind F": lambda t, p, e: t.sub(p, rb"(F[0-9.]+)", rb"\g<1>" + ZEROS),
    "zeros behind the last F": lambda t, p, e: t.sub(e - 1, rb"(F[0-9.]+)", rb"\g<1>" + ZEROS),
    "zeros behind the F restored": lambda t, p, e: _of(
        t, t.tails, rb"(F[0-9]+\.[0-9]*)", rb"\g<1>" + ZEROS
    ),
    "blanks in a point": lambda t, p, e: t.sub(p, rb" F", b" " * 240 + b" F"),
    "blanks behind a point": lambda t, p, e: t.sub(p, rb"(\r?\n)", b" " * 240 + rb"\1"),
    "long stamp": lambda t, p, e: t.sub(t.stamp, rb"(\)?\r?\n)", b"x" * 1100 + rb"\1"),
    "long comment": lambda t, p, e: t.sub(t.comments[0], rb"(\)?\r?\n)", b"x" * 1100 + rb"\1"),
    "M5 behind a stream": lambda t, p, e: t.sub(e, rb"(\r?\n)", rb"\1M5\1"),
    "G93 not restored": lambda t, p, e: _of(t, t.tails, rb" G93", b""),
    "G61.1 for G61": lambda t, p, e: _of(t, t.points, rb"G61(?!\.)", b"G61.1"),
    "G95 left behind": lambda t, p, e: t.sub(e, rb"G0", b"G0 G95"),
    "G91 left behind": lambda t, p, e: t.sub(
        e, rb"G0", b"G0 G90" if t.incremental(e) else b"G0 G91"
    ),
    "both distance modes": lambda t, p, e: t.sub(e, rb"G0", b"G0 G91 G90"),
    "plane changed": lambda t, p, e: t.sub(e, rb"G0", b"G0 G19"),
    "unit changed": lambda t, p, e: t.sub(e, rb"G0", b"G0 G20"),
    "work system changed": lambda t, p, e: t.sub(e, rb"G0", b"G0 G55"),
    "compensation begun": lambda t, p, e: t.sub(e, rb"G0", b"G0 G41"),
    "motion in the tail": lambda t, p, e: t.sub(e, rb"G0", b"G0 X0"),
    "stop added": lambda t, p, e: t.sub(e, rb"(\r?\n)", rb"\1M0\1"),
    "stop lost": lambda t, p, e: _of(t, [n + 1 for n in t.tails], rb"M1[\r\n]+", b""),
    "head lost": lambda t, p, e: t.head() and t.cut(t.head()),
    "head changed": lambda t, p, e: t.head() and t.sub(t.head(), rb"M8", b"M9"),
    "word of the head lost": lambda t, p, e: t.head() and t.sub(t.head(), rb" M8", b""),
    "N word of the head changed": lambda t, p, e: t.head() and t.sub(t.head(), rb"N", b"N1"),
    "comment changed": lambda t, p, e: t.sub(t.comments[0], rb"gcodejerk: ", b"gcodejerk: Q"),
    "comment of another block": lambda t, p, e: t.sub(t.comments[0], rb"G0", b"G1"),
    "comment opened": lambda t, p, e: t.sub(t.comments[0], rb"\)", b""),
    "comment without its mark": lambda t, p, e: t.sub(t.comments[0], rb"^[(;]", b""),
    "words behind a comment": lambda t, p, e: t.sub(t.comments[0], rb"\)", b") X1"),
    "file cut": lambda t, p, e: b"".join(t.lines[:p]),
    "file cut in a line": lambda t, p, e: b"".join(t.lines[:p]) + t.lines[p][:6],
    "file cut behind a stream": lambda t, p, e: b"".join(t.lines[: e + 1]),
    "file cut by a byte": lambda t, p, e: b"".join(t.lines)[:-1],
    "file empty": lambda t, p, e: b"",
    "byte behind the end": lambda t, p, e: b"".join(t.lines) + b"\n",
    "block behind the end": lambda t, p, e: b"".join(t.lines) + b"G0 X1.\n",
    "program twice": lambda t, p, e: b"".join(t.lines) * 2,
    "bytes in front": lambda t, p, e: b"\n" + b"".join(t.lines),
    "zero bytes": lambda t, p, e: b"".join(t.lines[:p]) + b"\0" * len(t.text([p])),
    "stamp doubled": lambda t, p, e: t.cut(t.stamp, t.lines[t.stamp], t.lines[t.stamp]),
    "stamp with words": lambda t, p, e: t.sub(t.stamp, rb"\)", b") G91"),
    "stamp changed": lambda t, p, e: t.sub(t.stamp, rb"stamp [0-9]", b"stamp 9"),
    "machine of the stamp changed": lambda t, p, e: t.sub(t.stamp, rb"(sum:\w+ ).", rb"\1Q"),
    "kept line lost": lambda t, p, e: t.cut(t.kept[-1]),
    "kept line doubled": lambda t, p, e: t.cut(t.kept[0], *[t.lines[t.kept[0]]] * 2),
    "kept line moved": lambda t, p, e: _moved_up(t),
    "blank added to a kept line": lambda t, p, e: _kept(t, rb"(?=\r?\n|$)", b" "),
    "line end of a kept line": lambda t, p, e: _kept(t, rb"\r?\n", _other_end),
    "line end of a kept line to CR": lambda t, p, e: _kept(t, rb"\r?\n", b"\r"),
    "kept comment changed": lambda t, p, e: _kept(t, rb"([(;].*[a-z])", rb"\1x"),
    "kept N word changed": lambda t, p, e: _kept(t, rb"N([0-9]+)", rb"N1\1"),
    "kept N word lost": lambda t, p, e: _kept(t, rb"N[0-9]+ ", b""),
    "kept F changed": lambda t, p, e: _kept(t, rb"F([0-9.]+)", _scaled(1.01)),
    "kept axis word changed": lambda t, p, e: _kept(t, AXIS, _shift(1)),
    "kept G code changed": lambda t, p, e: _kept(t, rb"G1(?![0-9])", b"G0"),
    "kept mode lost": lambda t, p, e: _kept(t, rb"G90 ?", b""),
    "kept unit changed": lambda t, p, e: _kept(t, rb"G21|G71", b"G20"),
    "kept decimal point lost": lambda t, p, e: _kept(t, rb"([XYZF][0-9]+)\.", rb"\1"),
    "block delete on a kept line": lambda t, p, e: _kept(t, rb"^", b"/"),
    "block delete on a head": lambda t, p, e: t.head() and t.sub(t.head(), rb"^", b"/"),
    "block delete on a tail": lambda t, p, e: t.sub(e, rb"^", b"/"),
    "checksum on a tail": lambda t, p, e: t.sub(e, rb"(?=\r?\n)", b"*71"),
    "checksum on a point": lambda t, p, e: t.sub(p, rb"(?=\r?\n)", b"*71"),
    "end of the program lost": lambda t, p, e: _kept(t, rb"M2(?![0-9])", b"M9"),
}

SUM_ALONE = {
    "end point doubled": "the tool waits for one block where it has arrived, as slow profiles do",
    "stamp changed": "which version wrote a file changes nothing of how it moves",
    "machine of the stamp changed": "a name, not the machine that it is judged for",
}


def with_its_sum(data):
    """A damaged output with the sum that it should have, as whoever damaged it could put in."""
    match = SUM.search(data)
    if not match:
        return data
    zeros = data[: match.start(2)] + b"0" * 16 + data[match.end(2) :]
    digest = hashlib.blake2b(zeros, digest_size=8).hexdigest().encode()
    return data[: match.start(2)] + digest + data[match.end(2) :]


class Damaged(Text):
    """A text with what the damages ask of it."""

    def __init__(self, data, output, dialect):
        super().__init__(data, output)
        self.dialect = dialect

    def incremental(self, p):
        """Whether the stream of a point is one of increments: its first points are tiny."""
        stated = [
            m for line in self.lines[:p] for m in re.findall(rb"G9[01](?![0-9.])", line)
            if not line.startswith(COMMENTS)
        ]  # fmt: skip
        return bool(stated) and stated[-1] == b"G91"

    def head(self):
        """Line of what else a block says, in front of its stream."""
        after = (n + 1 for n in self.comments)
        heads = (n for n in after if re.search(rb"M8|N[0-9]", self.lines[n]))
        return next(heads, None)


def test_an_undamaged_output_has_the_sum_that_this_file_computes():
    data = b"G21 G90 G94 G64 P0.02\nF60\nG0 X0 Y0 Z0\nG0 X10 M8\nM2\n"
    output = process(data, machine_for("linuxcnc"), verify=False).output
    assert SUM.search(output)
    assert with_its_sum(output) == output


def test_there_are_forty_kinds_of_damage_that_the_sum_is_not_needed_for():
    assert set(SUM_ALONE) < set(DAMAGE)
    assert len(set(DAMAGE) - set(SUM_ALONE)) >= 40


APPLIED = set()
"""Kinds of damage that some drawn program of this run had room for."""


STRIDE = 2
"""Kinds of damage from one that a drawn program gets to the next."""


def missed(dialect, program, pick, stride=1):
    """Kinds of damage to a processed program that nobody notices; None if it has no room for it."""
    # The form of LinuxCNC's own streams has damages of its own.
    own = {"linuxcnc": "mach", "rs274": "mach", "iso-mill": "haas", "any-mill": "fanuc"}
    own |= dict.fromkeys(("centroid", "uccnc", "edingcnc", "planetcnc", "masso", "duet"), "mach")
    own |= dict.fromkeys(("mitsubishi", "mazatrol-eia", "syntec"), "fanuc")
    machine, controller = machine_for(dialect), own.get(dialect, dialect.split("-")[0])
    output = process(program, machine, verify=False, controller=controller, dialect=dialect).output
    text = Damaged(program, output, dialect)
    if not (text.inner and text.tails and text.kept):
        return None
    assert verify(program, output, machine, dialect=dialect).ok
    out = []
    turn = pick.randrange(stride**2)
    for k, (name, damage) in enumerate(DAMAGE.items()):
        if k % stride != turn % stride:
            continue
        damaged = damage(text, pick.choice(text.inner), pick.choice(text.tails))
        if damaged is None or damaged == output:
            continue
        APPLIED.add(name)
        as_it_is = k % stride**2 == turn
        if as_it_is and verify(program, damaged, machine, dialect=dialect, most=1).ok:
            out.append(f"{name}, by the sum too")
        if name not in SUM_ALONE:
            whole = with_its_sum(damaged)
            if verify(program, whole, machine, dialect=dialect, most=1).ok:
                out.append(name)
    return out


@pytest.mark.parametrize("dialect", DIALECTS)
@SETTINGS
@given(st.data(), st.randoms(use_true_random=False))
def test_every_damage_is_noticed(dialect, data, pick):
    found = missed(dialect, data.draw(calm_programs(dialect)), pick, STRIDE)
    assume(found is not None)
    assert found == []


def test_every_kind_of_damage_is_done_to_programs_that_have_room_for_all():
    moves = "N7 G0 X12.5 Y-7. M8\n(cut)\nG1 X2.5 F33.\nG0 Z3.4 M1\nG91 G0 X3.3\n"
    moves += "N9 G90 G1 Z1. F20.\nM2\n"
    APPLIED.clear()
    for dialect, head in (
        ("linuxcnc", "G21 G90 G94 G61\nF60\nG0 X0 Y0 Z0\n"),
        ("linuxcnc", "G21 G90 G93 G61.1\nG0 X0 Y0 Z0\n"),
        ("fanuc", "G21 G17 G40 G90 G94 G64\nG0 X0. Y0. Z0. F200.\n"),
        ("siemens", "G71 G17 G40 G90 G94 G60\nG0 X0. Y0. Z0. F200.\n"),
    ):
        comment = "; cut" if dialect == "siemens" else "(cut)"
        program = (head + moves.replace("(cut)", comment)).encode()
        assert missed(dialect, program, random.Random(3)) == []
    assert set(DAMAGE) == APPLIED
