"""Proof that calls of CYCLE81 and CYCLE82 were written out as the moves that they make (Siemens).

What such a cycle does is told here once more, from its parameters: rapidly to the reference plane
and its clearance, with the feed in force to the depth, a dwell in seconds, rapidly to the
retraction plane; behind MCALL the same behind every block that moves, until MCALL stands alone.

Rule: everything else is kept byte for byte, and so is a series as a whole, or not at all.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import BinaryIO

from gcodejerk.nc import Dialect, Start
from gcodejerk.nc.dialects.gcodes import G17, G40, G90
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.program import split_lines
from gcodejerk.nc.reader import Reader
from gcodejerk.nc.text.chunks import read_chunks
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.cycles.lines import WrittenLines, squeezed
from gcodejerk.verification.findings import Findings, Kind, Verification
from gcodejerk.verification.second_reading.agreement import Context, confirm_contexts
from gcodejerk.verification.second_reading.reading import pieces

_CALL = re.compile(
    rb"[ \t]*(?P<number>N[0-9]+)?[ \t]*(?P<modal>MCALL)?[ \t]*"
    rb"(?:(?P<name>CYCLE8[12])[ \t]*\((?P<arguments>[^()]*)\))?[ \t]*(?P<comment>;.*)?",
    re.IGNORECASE | re.DOTALL,
)
_POSITION = re.compile(
    rb"[ \t]*(?:N[0-9]+)?(?:[ \t]*(?:G0*[01]|[XYF]=?[-+]?[0-9.]+)(?![0-9.]))+[ \t]*(?:;.*)?",
    re.IGNORECASE | re.DOTALL,
)
_STILL = re.compile(
    rb"[ \t]*(?:N[0-9]+)?(?:[ \t]*(?:[FS]=?[0-9.]+|M0*[345789])(?![0-9.]))*[ \t]*(?:;.*)?",
    re.IGNORECASE | re.DOTALL,
)
_ELSEWHERE = re.compile(
    rb"\b(?:GOTO[FBCS]?|IF|WHILE|REPEATB?|UNTIL|LOOP|FOR|CASE|PROC)\b|%_N_", re.IGNORECASE
)
_MOVE = re.compile(rb"G9 (G0|G1) Z([-+]?[0-9]+(?:\.[0-9]+)?)")
_DWELL = re.compile(rb"G4 F([0-9]+(?:\.[0-9]+)?)")
_REST = b"G4 F0.001"
_COMMENT = b"; gcodejerk: "
_NAMES = ("RTP", "RFP", "SDIS", "DP", "DPR", "DTB")
Step = tuple[bytes, Fraction]


@dataclass(slots=True)
class _Series:
    """From MCALL to MCALL."""

    way: list[Step] | None
    written: bool


def has_calls(dialect: Dialect) -> bool:
    """Whether a dialect calls its cycles by names."""
    return bool(dialect.drilling.named)


def check_calls(
    original: BinaryIO,
    expanded: BinaryIO,
    dialect: Dialect,
    start: Start,
    names: tuple[str, str],
    most: int,
) -> Verification:
    """Compare a program with the same program after its calls were written out.

    Parameters
    ----------
    original, expanded, dialect, start, names, most
        As for `gcodejerk.verification.cycles.expansion.check_expansion`.

    Returns
    -------
    Verification
    """
    begin = original.tell()
    heads = sum(len(_ELSEWHERE.findall(re.sub(rb";[^\n]*", b"", p))) for p in pieces(original))
    original.seek(begin)
    proof = _Proof(Window(expanded), Reader("<original>", dialect, start), most)
    # The head of a main program stands once; a second one is that of a subprogram.
    proof.jumps = heads > proof.one_head(original)
    original.seek(begin)
    for chunk in read_chunks(original, names[0]):
        if not proof.newline:
            head = chunk.data.split(b"\n", 1)[0]
            proof.newline = b"\r\n" if head.endswith(b"\r") else b"\n"
        if not all(proof.line(*line) for line in split_lines(chunk)):
            break
    else:
        proof.end()
    original.seek(begin)
    confirmed = confirm_contexts(original, dialect, start, proof.contexts, proof.found)
    return Verification(
        proof.holes, proof.written, proof.kept, proof.found.sorted(), names, confirmed
    )


class _Proof:
    """Side by side through both files."""

    def __init__(self, theirs: Window, reader: Reader, most: int) -> None:
        self.theirs, self.reader = theirs, reader
        self.found = Findings(most)
        self.holes = self.written = self.kept = 0
        self.series: _Series | None = None
        self.jumps = False
        self.newline = b""
        self.contexts: list[Context] = []

    @staticmethod
    def one_head(original: BinaryIO) -> int:
        """Whether the file begins with the head of a program; 1 or 0."""
        begin = original.tell()
        first = original.readline(200).lstrip()
        original.seek(begin)
        return int(first.upper().startswith(b"%_N_"))

    def end(self) -> None:
        """Behind the last line of the original."""
        if not self.theirs.ended:
            self.found.add(Kind.ADDED, self.theirs.line, None, "the original ends here")
        if self.series is not None and self.series.written:
            self.found.add(Kind.SERIES, self.theirs.line, None, "MCALL never ends")

    def line(self, text: bytes, begin: int, number: int, terminator: int) -> bool:
        """Take one line of the original; whether the walk can go on."""
        reader, bare = self.reader, text.removesuffix(b"\r")
        before, problems = reader.state.copy(), reader.problem_count
        reader.read_line(text, begin, number, terminator)
        sure = problems == reader.problem_count and not reader.inside
        sure = sure and not bare.lstrip().startswith(b"/")
        whole = text + b"\n" * terminator
        call = _CALL.fullmatch(bare)
        calls = call is not None and (call["modal"] or call["name"])
        if before.ended or (not calls and b"MCALL" not in bare.upper() and self.series is None):
            return self._same(whole, number)
        if call is None or not calls:
            return self._within(bare, whole, number, before, sure=sure)
        if call["modal"]:
            return self._modal(call, whole, number, before, sure=sure)
        return self._once(call, whole, number, before, sure=sure)

    def _same(self, whole: bytes, number: int) -> bool:
        """A line that has to be kept."""
        if not self._is_kept(whole):
            found = self.theirs.peek_line()[:60].decode("latin-1").rstrip()
            mine = whole[:60].decode("latin-1").rstrip()
            if not self.theirs.peek(1):
                return self._complain(Kind.MISSING, number, f"file ends where '{mine}' follows")
            return self._complain(Kind.CHANGED, number, f"expected '{mine}', found '{found}'")
        self.theirs.skip(len(whole))
        self.kept += 1
        return True

    def _is_kept(self, whole: bytes) -> bool:
        if self.theirs.peek(len(whole)) != whole:
            return False
        return whole.endswith(b"\n") or len(self.theirs.peek(len(whole) + 1)) == len(whole)

    def _modal(
        self, call: re.Match[bytes], whole: bytes, number: int, before: State, *, sure: bool
    ) -> bool:
        """MCALL, alone or with a cycle."""
        if self.series is not None and call["name"] is None:
            series, self.series = self.series, None
            if not series.written:
                return self._same(whole, number)
            return self._replaced(call, whole, number, None, None, sure=sure)
        nested, kept = self.series is not None, self._is_kept(whole)
        if nested and self.series is not None and self.series.written:
            return self._complain(Kind.SERIES, number, "another cycle is called before MCALL alone")
        way = self._way(call, before) if call["name"] is not None and not nested else None
        if call["name"] is not None:
            self.series = _Series(way, not kept)
        if kept:
            return self._same(whole, number)
        if way is None:
            return self._complain(Kind.SERIES, number, "nobody knows what this cycle does")
        return self._replaced(call, whole, number, None, None, sure=sure)

    def _once(
        self, call: re.Match[bytes], whole: bytes, number: int, before: State, *, sure: bool
    ) -> bool:
        """A cycle in a block of its own."""
        self.holes += 1
        if self._is_kept(whole):
            return self._same(whole, number)
        way = self._way(call, before) if self.series is None else None
        if way is None or not _tells(before):
            return self._complain(Kind.SERIES, number, "nobody knows what this cycle does here")
        self.written += 1
        self.contexts.append(Context(number, list(before.position), _modes(before)))
        return self._replaced(call, whole, number, way, before, sure=sure)

    def _within(self, bare: bytes, whole: bytes, number: int, before: State, *, sure: bool) -> bool:
        """A line between two MCALL, or one that calls in a way that is not known."""
        series, state = self.series, self.reader.state
        moves = bool(re.search(rb"[XYZABCUVW]=?[-+.0-9]", bare.split(b";")[0], re.IGNORECASE))
        self.holes += moves
        if not self._same(whole, number):
            return False
        if series is None or not series.written:
            return True
        if _STILL.fullmatch(bare) and sure and not state.ended:
            return True
        goes = [(before.position[k], state.position[k]) for k in range(2)]
        goes_on = any(a == a and b == b and a != b for a, b in goes) and _tells(state)
        if not _POSITION.fullmatch(bare) or not (sure and goes_on) or series.way is None:
            return self._complain(Kind.SERIES, number, "nobody knows whether this drills")
        self.kept -= 1
        self.written += 1
        self.contexts.append(Context(number, list(before.position), _modes(state)))
        lines = WrittenLines(self.theirs)
        if not self._moves(lines, series.way, state, number):
            return False
        return self._well_ended(lines, whole, number)

    def _way(self, call: re.Match[bytes], state: State) -> list[Step] | None:
        """What a call makes: its moves and its dwell; None where that is not known."""
        said: dict[str, Fraction] = {}
        for k, text in enumerate(call["arguments"].split(b",")):
            if not text.strip():
                continue
            try:
                value = Fraction(text.strip().decode("ascii"))
            except ValueError:
                return None
            if k >= (6 if call["name"].endswith(b"2") else 5):
                if value:
                    return None
                continue
            said[_NAMES[k]] = value
        zero = Fraction(0)
        if {"RTP", "RFP"} - said.keys() or not {"DP", "DPR"} & said.keys():
            return None
        low = said["RFP"] - said["DPR"] if said.get("DPR") else said.get("DP", said["RFP"])
        high = said["RFP"] + said.get("SDIS", zero)
        depths = said.get("DPR", zero) >= 0 and said.get("SDIS", zero) >= 0
        if not depths or not low < said["RFP"] <= high <= said["RTP"] or said.get("DTB", zero) < 0:
            return None
        frame = state.transformed or state.compensation != G40
        if frame or state.plane != G17 or state.unit != 1.0:
            return None
        dwell = said.get("DTB", zero)
        rest = [(b"G4", dwell)] if dwell else []
        return [(b"G0", high), (b"G1", low), *rest, (b"G0", said["RTP"])]

    def _replaced(
        self,
        call: re.Match[bytes],
        whole: bytes,
        number: int,
        way: list[Step] | None,
        state: State | None,
        *,
        sure: bool,
    ) -> bool:
        """A line whose call is gone: what else it said, and the moves of a hole."""
        if not sure or self.jumps:
            return self._complain(Kind.SERIES, number, "its series is not certain")
        lines = WrittenLines(self.theirs)
        if lines.peek().startswith(_COMMENT):
            lines.next()
        head = squeezed((call["number"] or b"") + (call["comment"] or b""))
        if head and squeezed(lines.peek()) != head:
            return self._complain(Kind.HEAD, number, f"expected '{head.decode('latin-1')}'")
        if head:
            lines.next()
        if way is not None and state is not None and not self._moves(lines, way, state, number):
            return False
        return not lines.ends or self._well_ended(lines, whole, number)

    def _moves(self, lines: WrittenLines, way: list[Step], state: State, number: int) -> bool:
        """The moves of one hole, at rest over it, and G1 again where it is in force."""
        if self.jumps:
            return self._complain(Kind.SERIES, number, "the program jumps")
        if lines.next() != _REST:
            return self._complain(Kind.MODE, number, "no rest over the hole")
        for kind, value in way:
            got = lines.next()
            pattern = _DWELL if kind == b"G4" else _MOVE
            match = pattern.fullmatch(got)
            right = match is not None and Fraction(match[match.lastindex or 1].decode()) == value
            if match is None or not right or (kind != b"G4" and match[1] != kind):
                told = f"expected {kind.decode()} to {float(value):g}"
                return self._complain(
                    Kind.CYCLE, number, f"{told}, found '{got.decode('latin-1')}'"
                )
        if state.motion == 10 and lines.next() != b"G1":
            return self._complain(Kind.MODE, number, "G1 of the program does not return")
        return True

    def _well_ended(self, lines: WrittenLines, whole: bytes, number: int) -> bool:
        """Whether the lines end as those of the file do."""
        last = whole[len(whole.rstrip(b"\r\n")) :]
        if lines.well_ended(last if b"\n" in last else self.newline, last):
            return True
        return self._complain(Kind.LINE_END, number, "lines do not end as the block did")

    def _complain(self, kind: Kind, number: int, problem: str) -> bool:
        """Note a violation, with which the walk ends."""
        self.found.add(kind, self.theirs.line, number, problem)
        return False


def _tells(state: State) -> bool:
    """Whether all is known that blocks of G0 and G1 need."""
    known = state.distance == G90 and state.motion in (0, 10) and state.path in (61, 64)
    return known and state.feed_mode in (94, 95) and state.feed > 0.0


def _modes(state: State) -> dict[str, float | None]:
    """What the moves depend on, as the second reading names it."""
    return {
        "unit": state.unit,
        "incremental": state.distance != G90,
        "feed mode": state.feed_mode,
        "F": state.feed,
        "plane": state.plane,
        "path": state.path,
        "motion": None if state.motion is None else state.motion // 10,
    }
