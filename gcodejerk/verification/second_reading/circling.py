"""Arcs and words that a control may refuse while the program goes on, and runs of feed moves.

Rule: an arc that misses its end, or of which too little is known, is run and not run.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import LEFT_OVER, PLANES, Effect
from gcodejerk.nc.dialects.gcodes import G1, G4, G40, G43_1, G80, G90, G91
from gcodejerk.units import MM_PER_INCH as INCH
from gcodejerk.verification.second_reading.drilling import Drilling
from gcodejerk.verification.second_reading.reading import NAN, Run, Text
from gcodejerk.verification.second_reading.sorting import Sorted

_NO_MOTION: frozenset[Effect] = frozenset(("return", "table", "local", "set"))
_TAKES: frozenset[Effect] = _NO_MOTION | {"words"}
_ALONE = {"motion", "plane", "distance", "arc distance", "feed mode", "units"}
_CENTRES = dict(zip("XYZ", "IJK", strict=True))
_COMMENT = re.compile(rb"\([^()]*\)")
_CODE = re.compile(rb"G[ \t]*0?([123])(?![0-9.])")
_WORDS = re.compile(rb"([GIJKRXYZ])[ \t]*([-+]?[0-9.]+)")

_NUMERIC = b"0123456789.+- \t\r"

NO_FEED = re.compile(rb"F[ \t]*[-+]?0*[.]?0*(?![0-9.])")
"""F0."""


def misses(way: complex, centre: complex, radius: float | None) -> bool:
    """Whether an arc may not meet its end, after grbl's gcode.c [mm]; NaN counts as missed."""
    if radius is not None:
        return not (abs(way) > 2e-4 and 2.0 * abs(radius) - abs(way) > 2e-4)
    here, there = abs(centre), abs(way - centre)
    near = abs(here - there) <= 0.0048
    return not (near or abs(here - there) <= min(0.49, 0.00098 * here))


def _doubled(run: bytes) -> bool:
    """Whether any line has two words of one letter, comments left out."""
    run = _COMMENT.sub(b"", run) if b"(" in run else run
    # the letters of hundreds of lines, of which most have the same
    letters = set(run.translate(None, _NUMERIC).split(b"\n"))
    return any(len(set(line)) < len(line) for line in letters)


class Circling(Drilling):
    """Takes runs of feed moves, and doubts arcs."""

    @property
    def feeding(self) -> bool:
        """Whether lines without a code are feed moves whose last words say where they end."""
        return self.may_run and self.g.get("motion") in (10, *self.dialect.arcs)

    @property
    def may_run(self) -> bool:
        """Whether a run may be taken that states its own motion."""
        return (
            self.facts.rapid_feed is None
            and self.g.get("distance") == G90
            and self.cycle is None
            and not self.ended
            and self.contour is None
            and self.g.get("compensation") is not None
            and self.bars.get(LEFT_OVER, False) is False
            and not any(on is not False for on in self.frames.values())
        )

    def take_run(self, text: Text, data: bytes, at: int) -> tuple[Run, int] | None:
        """Take a run of feed moves, if one begins here whose arcs all meet their ends."""
        if not self.may_run or text.tried[0] < at < text.tried[1]:
            return None
        if self.lacks_feed():
            return self._take_unfed(text, data, at)
        run = text.take_run(data, at, stated=not self.feeding)
        if run is not None and self._doubts_run(data, at, run[1]):
            text.tried = at, run[1]  # line by line, then: who looks again and again never ends
            return None
        return run

    def _doubts_run(self, data: bytes, begin: int, end: int) -> bool:
        """Whether any line of a run of feed moves may be refused."""
        rules = self.dialect
        if _doubled(data[begin:end]):
            return True
        if (rules.feed_needed or rules.feed_of_moves) and NO_FEED.search(data, begin, end):
            return True
        return rules.arcs_refused and self._strays(data[begin:end])

    def _take_unfed(self, text: Text, data: bytes, at: int) -> tuple[Run, int] | None:
        """Take feed moves in front of any F, each of which is refused or not."""
        if self.g.get("compensation") != G40:
            return None
        stated = not (self.feeding or self.g.get("motion") is None)
        found = text.take_run(data, at, stated)
        if found is not None and _doubled(data[at : found[1]]):
            text.tried = at, found[1]
            return None
        first = -1 if found is None else data.find(b"F", at, found[1])
        if first >= 0:
            lines = data[at : data.rfind(b"\n", at, first) + 1]
            found = text.take_run(lines, 0, stated) if lines else None
            found = None if found is None else (found[0], at + found[1])
        if found is not None:
            words = _COMMENT.sub(b"", data[at : found[1]])
            found[0].stated = tuple(int(n) * 10 for n in _CODE.findall(words))
        return found

    def _run_unfed(self, run: Run) -> None:
        """Follow them: what may have been left out leaves nobody knows where the axes stand."""
        motion = self.g.get("motion")
        if motion is None or set(run.stated) - {motion}:
            self.g["motion"] = None
            self.lose(AXES if len(run.stated) < run.lines else "")
        self.lose("".join(run.last) if self.stays() else AXES)

    def stays(self) -> bool:
        """Whether nobody moves an axis while the program waits."""
        resume = self.facts.resume
        return resume == "same" or (resume is None and self.dialect.same_after_stop)

    def run(self, run: Run) -> None:
        """Follow a run of feed moves."""
        self.begun = self.started = True
        if self.lacks_feed():
            self._run_unfed(run)
            return
        for letter, number in run.last.items():
            if letter == "F":
                self.feed, self.feed_whole = number, self.matters(run.feed_whole)
            else:
                self.end_run(AXES.index(letter), number * self.scale(letter))
        if run.code is not None and self.dialect.modal_motion:
            self.g["motion"] = run.code
        if self.g.get("compensation") != G40:
            self.displaced("".join(run.last))

    def displaced(self, named: str) -> None:
        """Keep where the program says that axes stand which the tool's radius displaces."""
        for k, axis in enumerate(AXES):
            if axis in self.in_plane() and axis in named:
                self.meant[k] = self.at[k]
        self.lose(self.in_plane())

    def matters(self, whole: bool) -> bool:
        """Whether a number without a decimal point, which this one is or not, may mean another."""
        return whole and self.dialect.whole_numbers == "machine"

    def _strays(self, run: bytes) -> bool:
        """Whether any arc of a run may be refused."""
        plane = PLANES.get(self.g.get("plane") or 0)
        if not any(mark in run for mark in (b"I", b"J", b"K", b"R")):
            return False
        if self.unit is None:
            return any(axis in run for axis in (b"A", b"B", b"C"))
        if plane is None or self.diameter is not False:
            return True
        first, second = plane[:2]
        here = complex(self.at[AXES.index(first)], self.at[AXES.index(second)]) / self.unit
        arcs = self.g.get("motion") in self.dialect.arcs
        for line in run.split(b"\n"):
            words = {letter.decode(): float(n) for letter, n in _WORDS.findall(_bare(line))}
            arcs = words["G"] > 1.5 if "G" in words else arcs
            there = complex(words.get(first, here.real), words.get(second, here.imag))
            if arcs and words and self._fails(words, there - here, plane[:2]):
                return True
            here = there
        return False

    def _fails(self, words: dict[str, float], way: complex, axes: tuple[str, ...]) -> bool:
        """Whether an arc with these words may be refused; its way in the program's unit."""
        if not set(axes) & words.keys():
            return True
        way = complex(*(n if a in words else 0.0 for a, n in zip(axes, (way.real, way.imag))))  # noqa: B905
        unit = self.unit or 1.0
        centre = complex(*(words.get(_CENTRES[axis], 0.0) for axis in axes))
        radius = words["R"] * unit if "R" in words else None
        return misses(way * unit, centre * unit, radius)

    def lacks_feed(self) -> bool:
        """Whether a feed move may be refused, since it has no F."""
        return self.dialect.feed_needed and not self.feed > 0.0

    def may_be_feed(self, block: Sorted) -> bool:
        """Whether F may be a feed though something else takes the words of its block."""
        if self.dialect.one_command:  # the motion before may be in force
            return self.dialect.feed_of_moves and not block.g and not block.m
        return G4 not in block.g.values()

    def counts_feed(self, g: Mapping[str, int]) -> bool | None:
        """Whether F counts beside these codes; None: not on every control."""
        if not self.dialect.feed_of_moves or "motion" not in g:
            return not self.dialect.feed_of_moves
        return None if g["motion"] in self.dialect.redrawn else True

    def doubts_feed(self, block: Sorted) -> bool:
        """Whether a block is a feed move without F that the control may refuse."""
        dialect, g, values = self.dialect, block.g, block.values
        motion = g.get("motion", self.g.get("motion"))
        moves = block.axes or "motion" in g or (motion != G1 and {"I", "J", "K"} & values.keys())
        feeds = motion in (G1, *dialect.arcs, *dialect.redrawn)
        if not dialect.feed_needed or not moves or not feeds:
            return False
        if any(dialect.effect(code) in _TAKES for code in g.values()):
            return False
        another = "feed mode" in g and self.mode_of(g["feed mode"]) != self.feed_mode
        return not values.get("F", NAN if another else self.feed) > 0.0

    def takes_twice(self, block: Sorted) -> bool:
        """Whether a strict control gets a motion beside what has the axis words for itself."""
        if not self.dialect.strict or block.g.get("motion", G80) == G80:
            return False
        taken = any(self.dialect.effect(code) in _NO_MOTION for code in block.g.values())
        return taken or block.g.get("tool length") == G43_1

    def may_be_refused(self, block: Sorted) -> bool:
        """Whether some of the dialect's controls may refuse a block."""
        codes = {f"G{code / 10:g}" for code in block.g.values()} | {f"M{m}" for m in block.m}
        if not codes.isdisjoint(self.dialect.refused) or self.doubts_words(block):
            return True
        return self.doubts_feed(block) or self.doubts_arc(block)

    def doubts_words(self, block: Sorted) -> bool:
        """Whether a block holds words, or some beside others, that not every control takes."""
        rules, values = self.dialect.refuses, block.values
        effects = {self.dialect.effect(code) for code in block.g.values()}
        bare = not block.axes and (
            (rules.bare_table and "table" in effects)
            or (rules.bare_centre and not set("IJKR").isdisjoint(values))
        )
        negative = any(values.get(letter, 0.0) < 0.0 for letter in "FST")
        still = self.dialect.feed_of_moves and "motion" in block.g and values.get("F") == 0.0
        tool = values.get("T", 0.0)
        wrong = rules.tool < math.inf and not (tool <= rules.tool and tool.is_integer())
        wrong = wrong or negative or still or bare or self._lacks_time(block)
        taken = not effects.isdisjoint(_NO_MOTION)
        return wrong or self._doubts_taken(block, taken=taken)

    def _lacks_time(self, block: Sorted) -> bool:
        """Whether a dwell has no time, or a feed motion in G93 no F."""
        rules, g = self.dialect.refuses, block.g
        if rules.bare_dwell and G4 in g.values() and "P" not in block.values:
            return True
        if not rules.bare_inverse or "F" in block.values or g.get("motion", G80) in (0, G80):
            return False
        mode = self.mode_of(g["feed mode"]) if "feed mode" in g else self.feed_mode
        return mode == 93 or (mode is None and self.inverse is not False)

    def _doubts_taken(self, block: Sorted, *, taken: bool) -> bool:
        """The same of axis words that no motion takes; `taken`: one like G28 has them."""
        g, rules = block.g, self.dialect.refuses
        length, stated = g.get("tool length"), g.get("motion", G80) != G80
        if length == G43_1 and rules.length_axis:
            taken = True
            if block.axes != 1 << AXES.index(rules.length_axis):
                return True
        if length in rules.lengths and (block.axes or taken or stated):
            return True
        motion = g.get("motion", self.g.get("motion"))
        still = motion is None or (motion == G80 and taken)
        return rules.still_words and still and bool(block.axes)

    def doubts_arc(self, block: Sorted) -> bool:
        """Whether a block is an arc that the control may refuse."""
        dialect, g, values = self.dialect, block.g, block.values
        arc = dialect.arcs_refused and g.get("motion", self.g.get("motion")) in dialect.arcs
        if not arc or not (block.axes or {"I", "J", "K", "R"} & values.keys()):
            return False
        if any(dialect.effect(code) in _TAKES for code in g.values()):
            return False
        before = self.unit
        if "units" in g:
            self.unit = INCH if dialect.units[g["units"]] else 1.0
        plane = PLANES.get(g.get("plane", self.g.get("plane")) or 0)
        failed = self.unit is not None or bool({"A", "B", "C"} & values.keys())
        if plane is not None and self.unit is not None and set(g) <= _ALONE:
            ends = []
            for axis in plane[:2]:
                stated = g.get("distance", self.g.get("distance")) == G91 or axis not in values
                stands = 0.0 if stated else self.at[AXES.index(axis)] / self.unit
                ends.append(values.get(axis, 0.0) - stands)
            failed = self.diameter is not False or self._fails(values, complex(*ends), plane[:2])
        self.unit = before
        return failed


def _bare(line: bytes) -> bytes:
    """A line of a run without its comment."""
    return line.partition(b"(")[0]
