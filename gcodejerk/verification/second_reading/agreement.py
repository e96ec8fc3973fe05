"""Whether the second reading agrees with what `nc` says of each rewritten rapid.

Everything else that is verified rests on where `nc` believes a rapid to start and end, and on what
it believes to be in force. Here the original is read once more (`reading`, `tracking`).

Rule: where the second reading knows, it must agree, or the file is refused. Where it does not know,
it says so by a number and nothing is refused: `nc` follows more than it does.
"""

from __future__ import annotations

import math
from array import array
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, BinaryIO

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.nc import Dialect, Rapids, Start, find_dialect
from gcodejerk.nc.dialects.at_start import codes_at_start, dialect_at_start
from gcodejerk.storage import kept, release
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.second_reading.ahead import Ahead
from gcodejerk.verification.second_reading.comparing import Columns, disagreement, is_known
from gcodejerk.verification.second_reading.elsewhere import lines_behind
from gcodejerk.verification.second_reading.known import NEAR, Facts, Observation
from gcodejerk.verification.second_reading.looking import begins_again, jumps_back
from gcodejerk.verification.second_reading.reading import Line, Text, pieces
from gcodejerk.verification.second_reading.routes import LostError, calls, flows
from gcodejerk.verification.second_reading.stepping import Stepper
from gcodejerk.verification.second_reading.straight import PlainLines
from gcodejerk.verification.second_reading.tracking import Tracker
from gcodejerk.verification.second_reading.walking import Walker, given_up

MOST_BYTES = 4_000_000
"""Of a file whose flow is followed."""
MARK = b"\xef\xbb\xbf"
"""Of UTF-8, in front of the first line."""


def confirm(
    original: BinaryIO,
    dialect: Dialect | str,
    start: Start,
    rapids: Rapids,
    rewritten: Iterable[int],
    found: Findings,
) -> int:
    """Read the original a second time and compare.

    Parameters
    ----------
    original : BinaryIO
        Seekable; read from where it stands to its end.
    dialect : Dialect or str
        How it is written.
    start : Start
        What it may assume when it starts.
    rapids : Rapids
        What `nc` says.
    rewritten : iterable of int
        Indices of the rapids that were replaced, ascending.
    found : Findings
        Where they disagree.

    Returns
    -------
    int
        How many of them the second reading confirms.
    """
    index = kept(np.fromiter(rewritten, dtype=np.int64))
    if not len(index):
        return 0
    confirmed = 0
    plain = Columns(rapids, index)
    lines = array("q", plain.line.tobytes())
    for k, seen in observations(original, find_dialect(dialect), start, lines, plain):
        i = int(index[k])
        follows = k > 0 and index[k - 1] == i - 1 and rapids.line[i - 1] + 1 == rapids.line[i]
        problem = disagreement(seen, rapids, i, bool(follows))
        if problem:
            advice = "leave this rapid alone, and report the program: one of two readings is wrong"
            _differ(found, int(rapids.line[i]), problem, advice)
        confirmed += not problem and is_known(seen, rapids, i)
    return confirmed + plain.confirmed


@dataclass(frozen=True, slots=True)
class Context:
    """What the first reading says of a block that was replaced otherwise than by a stream."""

    line: int
    start: Sequence[float]
    """Positions in front of it. [mm, deg]"""
    modes: Mapping[str, Any]
    """In force behind it, by the names of `Observation.modes`."""


def confirm_contexts(
    original: BinaryIO,
    dialect: Dialect | str,
    start: Start,
    contexts: Sequence[Context],
    found: Findings,
) -> int:
    """Compare what two readings say of blocks of drilling cycles.

    Parameters
    ----------
    original, dialect, start, found
        As for `confirm`.
    contexts : sequence of Context
        What the first reading says, by ascending line.

    Returns
    -------
    int
        How many blocks the second reading confirms.
    """
    confirmed = 0
    lines = [context.line for context in contexts]
    for k, seen in observations(original, find_dialect(dialect), start, lines):
        context = contexts[k]
        problem, known = "", bool(seen.modes)
        for axis, here in enumerate(seen.start):
            told = context.start[axis]
            if abs(here - told) > NEAR * max(1.0, abs(here) / 1e3):
                problem = f"{AXES[axis]} stands at {here:.6g}, not at {told:.6g} [mm or deg]"
            known = known and (here == here or told != told)
        for name, told in context.modes.items():
            mine = seen.modes.get(name)
            if mine is None or told is None or mine != mine or told != told:
                known = known and (told is None or told != told)
            elif mine != told:
                problem = f"{name} is {mine:g}, not {told:g}"
        if problem:
            advice = "process it without --expand-cycles, and report the program"
            _differ(found, context.line, problem, advice)
        confirmed += known and not problem
    return confirmed


def _differ(found: Findings, line: int, problem: str, advice: str) -> None:
    """Note in what the two readings of a line differ."""
    told = f"a second reading of the program does not agree: {problem}"
    found.add(Kind.READING, None, line, told, advice)


def observations(
    original: BinaryIO,
    dialect: Dialect,
    start: Start,
    lines: Sequence[int],
    plain: Columns | None = None,
) -> Iterator[tuple[int, Observation]]:
    """What the second reading sees in these lines.

    Parameters
    ----------
    original, dialect, start
        As for `confirm`.
    lines : sequence of int
        Ascending, counted from 1.
    plain : optional
        Compares those that stand among plain lines by itself; where it agrees to all of them,
        they are not among those that are yielded.

    Yields
    ------
    k : int
        Index into `lines`.
    seen : Observation
    """
    dialect = dialect.set_up(start)
    begin = original.tell()
    doubt = jumps_back(original, dialect)
    again = bool(start.positions or start.startup) and begins_again(original, dialect)
    decimals = dialect.whole_numbers == "machine" and start.decimal_point != "calculator"
    stepper = Stepper(Text(dialect, decimals), dialect)
    seen = _as_it_flows(original, dialect, start, stepper)
    if seen is not None:
        yield from ((k, seen.get(line - 1, Observation())) for k, line in enumerate(lines))
        return
    tracker = _begin(stepper.text, dialect, start)
    tracker.doubt = doubt
    if again:
        tracker.forget()
    if dialect.dark_rapids and start.spindle == "mill" and lines:
        tracker.dark = _behaves_like_a_laser(original, dialect, start)
        original.seek(begin)
    agrees = None if plain is None else plain.agrees
    ahead = Ahead(stepper, tracker, PlainLines(dialect, decimals), agrees)
    yield from _from_above(original, stepper, tracker, ahead, lines)


def _as_it_flows(
    original: BinaryIO, dialect: Dialect, start: Start, stepper: Stepper
) -> dict[int, Observation] | None:
    """What is seen in the lines, from 0, where jumps and calls are followed; None: without any."""
    begin = original.tell()
    whole = original.read(MOST_BYTES + 1)
    original.seek(begin)
    walks = flows(whole, dialect)
    if len(whole) <= MOST_BYTES:
        more = lines_behind(whole, dialect, start)
        new = partial(_begin, stepper.text, dialect, start)
        for rest in ([more] if more else []) + ([[]] if walks or calls(whole, dialect) else []):
            walked = _walked(whole, stepper, new, rest)
            if walked is not None:
                return walked
    # what is not followed is read from above, as far as nobody else can come there
    return {} if walks and dialect.text.variables != "Q" else None


def _from_above(
    original: BinaryIO,
    stepper: Stepper,
    tracker: Tracker,
    ahead: Ahead,
    lines: Sequence[int],
) -> Iterator[tuple[int, Observation]]:
    """What is seen in a program that is read from its first line to its last; as `observations`."""
    text, number, following = stepper.text, 1, 0
    line = lines[0] if lines else math.inf
    for data in pieces(original):
        release()
        at, size = 0, len(data)
        ahead.begin()
        while at < size:
            taken = ahead.take(data, at, number)
            if taken is not None:
                number, at = taken
                following = bisect_left(lines, number, following)
                line = lines[following] if following < len(lines) else math.inf
                continue
            motion = tracker.g.get("motion")
            run = tracker.take_run(text, data, at) or ahead.take_run(data, at)
            if run is not None:
                against = None if motion is None else "it moves with feed"
                tracker.run(run[0])
                number, at = number + run[0].lines, run[1]
                while line < number:
                    yield following, Observation(against)
                    following += 1
                    line = lines[following] if following < len(lines) else math.inf
                continue
            end = data.find(b"\n", at)
            end = size if end < 0 else end
            bare = data[at:end].rstrip(b"\r").removeprefix(MARK if number == 1 else b"")
            found = stepper.step(tracker, bare)
            if number == line:
                yield following, found
                following += 1
                line = lines[following] if following < len(lines) else math.inf
            number, at = number + 1, end + 1


def _walked(
    whole: bytes, stepper: Stepper, begin: Callable[[], Tracker], behind: list[bytes]
) -> dict[int, Observation] | None:
    """What is seen in the lines of a file with flow, from 0; None where it is not followed."""
    lines = [line.rstrip(b"\r") for line in whole.removeprefix(MARK).split(b"\n")]
    try:
        return Walker(stepper, begin, [*lines, *behind]).walk()
    except LostError:
        return given_up(lines) if stepper.dialect.text.names else None


def _behaves_like_a_laser(original: BinaryIO, dialect: Dialect, start: Start) -> bool:
    """Whether any line of the program does what only programs for lasers do."""
    text = Text(dialect, False)
    tracker = _begin(text, dialect, start)
    for data in pieces(original):
        for line in data.split(b"\n"):
            tracker.follow(text.read(line.rstrip(b"\r"), not tracker.begun))
    return tracker.habits


def _begin(text: Text, dialect: Dialect, start: Start) -> Tracker:
    """A tracker in the state that programs start in."""
    tracker = Tracker(
        dialect,
        Facts(
            start.positions,
            start.offsets,
            start.tool_lengths,
            start.diameter,
            start.decimal_point,
            start.wraps,
            start.home,
            start.tool_change,
            start.resume,
            start.spindle,
            start.limits,
            start.along,
            start.straight,
            start.linear,
            (start.rapid_feed.feed, start.rapid_feed.clearance) if start.rapid_feed else None,
        ),
    )
    taken, _ = codes_at_start(start.startup, dialect)
    codes = text.read(taken.encode("latin-1", "replace"), first=False)
    tracker.dialect = dialect_at_start(dialect)
    for words in [[word] for word in codes.words] if dialect.one_command else [codes.words]:
        tracker.follow(Line(words=words))
    tracker.dialect = dialect
    tracker.place()
    return tracker


begin_tracker = _begin
"""The same for those who hold a program against another one."""
