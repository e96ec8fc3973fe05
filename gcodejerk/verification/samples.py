"""The file of samples beside a program (controller `linuxcnc-hal`), judged like points of streams.

For each rapid that the program asks for it has one head, `rapid NUMBER LINE SAMPLES X Y Z BRAKING`,
and below it a sample for the end of each interval: the share of the feed that stands in the program
(form `adaptive-feed`), or the share of the way (form `position`). Played, they are positions on the
rapid's line, one interval apart: these have to begin at its start, end at its end, and keep what
every stream keeps.

Rule: how LinuxCNC makes positions of speeds is written down here a second time: in each period it
goes on by the mean of the speeds at its two ends.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import BinaryIO

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.units import SECONDS_PER_MINUTE
from gcodejerk.verification.bytes.form import Stream
from gcodejerk.verification.bytes.hal import ADAPTIVE, Beside
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.physics.points import Array, Paths

NEAR = 1e-5
"""The tiny blocks stay this close to the ends of the rapid, and so does the sum of speeds. [mm]"""
CRAWL = 0.05
"""Fastest of the tiny blocks. [mm/s]"""
STEP = {True: 1e-5, False: 1e-8}
"""What the samples may be off, by whether they are speeds. [mm]"""
_NUMBER = rb"-?[0-9.]{1,25}(?:e[-+][0-9]{1,3})?"
_HEAD = re.compile(
    rb"rapid ([0-9]{1,9}) ([0-9]{1,12}) ([0-9]{1,6})" + (rb" (" + _NUMBER + rb")") * 4 + rb"\n"
)
_SAMPLE = re.compile(_NUMBER + rb"\n")
LONGEST = 200
AT_ONCE = 1 << 16
"""Samples that are judged at a time, about: 5 MB of positions."""


class SampleReader:
    """Reads the file rapid by rapid, in step with the program."""

    def __init__(
        self, file: BinaryIO, beside: Beside, rapids: Rapids, machine: Machine, found: Findings
    ) -> None:
        self.file, self.rapids, self.machine, self.found = file, rapids, machine, found
        self.adaptive = beside.form == ADAPTIVE
        self.line = 2
        """Of the next line of the file."""
        self.broken = False

    def complain(self, stream: Stream | None, problem: str, kind: Kind = Kind.SAMPLES) -> None:
        """Note what is wrong with a rapid's samples."""
        line = None if stream is None else stream.line
        original = None if stream is None else stream.original_line
        self.found.add(kind, line, original, problem)

    def paths(self, streams: Sequence[Stream], written: Paths) -> Iterator[Paths]:
        """The positions that are played for streams, as far as they can be read.

        Parameters
        ----------
        streams : sequence of Stream
            As the program has them, in its order.
        written : Paths
            Their points.

        Yields
        ------
        Paths
            Of some of the streams: those of so many samples that are judged at a time.
        """
        parts: list[Array] = []
        first = held = 0
        for k, stream in enumerate(streams):
            samples = self._samples(stream)
            if samples is None:
                return
            way = written.displacement[k]
            points = written.position[written.begin[k] : written.end[k]]
            share: Array | None = samples
            if self.adaptive:
                feed = written.feed[written.begin[k] : written.end[k]]
                share = self._shares(stream, samples, points, feed * written.unit[k], way)
            if share is None:
                return
            off = abs(float(share[-1]) - 1.0) * float(np.linalg.norm(way))
            if off > (NEAR if self.adaptive else 0.0):
                problem = f"the samples end {off:.3g} mm off the end of the rapid"
                self.complain(stream, problem, Kind.END)
            from_start = np.concatenate([[0.0], share])
            parts.append(written.start[k] + from_start[:, np.newaxis] * way)
            held += len(from_start)
            if k + 1 == len(streams) or held > AT_ONCE:
                yield self._played(written.take(np.arange(first, k + 1)), parts)
                parts, first, held = [], k + 1, 0

    def _played(self, written: Paths, parts: Sequence[Array]) -> Paths:
        """Streams whose positions are those of the samples, in place of the points."""
        size = np.array([len(part) for part in parts], dtype=np.int64)
        end = np.cumsum(size)
        step = np.full(written.step.shape, STEP[self.adaptive])
        position = np.concatenate(parts)
        return replace(
            written,
            begin=end - size,
            end=end,
            position=position,
            feed=np.full(len(position), np.nan),
            step=step,
        )

    def _shares(
        self, stream: Stream, factors: Array, points: Array, speeds: Array, way: Array
    ) -> Array | None:
        """Shares of the way after each interval, from shares of the feed."""
        length = float(np.linalg.norm(way[:3]))
        near = [np.linalg.norm(point - points[0]) for point in points[1:4]]
        far = np.linalg.norm(points[4] - points[5])
        if max(*near, far) > NEAR or not 0.0 < speeds[2] / SECONDS_PER_MINUTE <= CRAWL:
            self.complain(stream, "the tiny blocks are not tiny, or not slow", Kind.FORM)
            return None
        if factors.min() < 0.0 or factors.max() > 1.0 or factors[-1] != 0.0:
            self.complain(stream, "shares of the feed lie from 0 to 1, the last is 0")
            return None
        speed = np.concatenate([[0.0], factors]) * speeds[4] / SECONDS_PER_MINUTE
        moved = np.cumsum(0.5 * (speed[1:] + speed[:-1])) * self.machine.interval
        return np.asarray(moved / length)

    def _samples(self, stream: Stream) -> Array | None:
        """Samples of the next rapid, which has to be that of a stream."""
        if self.broken:
            return None
        line = self.file.readline(LONGEST)
        match = _HEAD.fullmatch(line)
        i = stream.rapid
        if match is None:
            shown = line.decode("latin-1").strip()
            return self._stop(stream, f"expected the head of a rapid, found '{shown}'")
        number, place, count = (int(match[k]) for k in (1, 2, 3))
        if number != i + 1 or place != self.rapids.line[i]:
            return self._stop(
                stream, f"the program asks for rapid {i + 1}, its samples are those of {number}"
            )
        way = np.array([float(match[k]) for k in (4, 5, 6)])
        if np.abs(way - (self.rapids.target[i] - self.rapids.start[i])[:3]).max() > 1e-9:
            return self._stop(stream, "the samples are those of another way")
        first = self.line + 1
        rows = [self.file.readline(LONGEST) for _ in range(count)]
        self.line = first + count
        if not rows or not all(_SAMPLE.fullmatch(row) for row in rows):
            return self._stop(stream, f"samples of rapid {number} are missing, or no numbers")
        braking = self._braking(way)
        if not 0.0 < float(match[7]) <= braking * (1.0 + 1e-9):
            self.complain(stream, f"braking {float(match[7]):g} is above {braking:g} 1/s^2")
        return np.array([float(row) for row in rows])

    def _braking(self, way: Array) -> float:
        """Highest deceleration of the share of a way within the axes' limits [1/s^2]."""
        return min(
            axis.limit.acceleration / abs(float(way["XYZ".index(axis.name)]))
            for axis in self.machine.axes
            if axis.name in AXES[:3] and way["XYZ".index(axis.name)]
        )

    def _stop(self, stream: Stream, problem: str) -> Array | None:
        """Note that the file cannot be read on; None."""
        self.broken = True
        self.complain(stream, f"line {self.line} of the samples: {problem}")
        return None

    def finish(self) -> None:
        """See that nothing is left over."""
        if not self.broken and not self.found.full and self.file.read(1):
            self.complain(None, f"line {self.line} of the samples: nothing asks for this rapid")
