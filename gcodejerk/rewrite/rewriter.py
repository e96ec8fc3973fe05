"""Streams into a program: what is replaced, and what is copied.

Rule 1: what is not a planned rapid's block is copied from the source, byte for byte.

Rule 2: the source is read once more while it is copied, and has to be what was planned.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.advice import stamp_note
from gcodejerk.emit import Controller, Options
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import Program
from gcodejerk.rewrite.expanded import TERMINATOR_LENGTH
from gcodejerk.rewrite.stamp import SUM_DIGITS, SUM_MARK, SUM_UNKNOWN, SUM_WITHIN
from gcodejerk.storage import Growing, windows

COPY_SIZE = 1 << 20


def digest_of(source: BinaryIO) -> bytes:
    """What a file holds now, as `Program.digest` has it."""
    source.seek(0)
    digest = hashlib.blake2b(digest_size=16)
    while data := source.read(COPY_SIZE):
        digest.update(data)
    return digest.digest()


def changed_error(name: str) -> EmitError:
    """The error for a program that somebody else has written to meanwhile."""
    return EmitError(
        f"{name} was changed while it was being processed",
        "run the command again when nothing writes to the file",
    )


class Rewriter:
    """Copies the source and puts streams in the place of blocks, in one pass through the file."""

    def __init__(
        self,
        source: BinaryIO,
        target: BinaryIO | None,
        program: Program,
        emitter: Controller,
        options: Options,
        stamp: bytes,
        beside: BinaryIO | None = None,
        guarded: bool = False,
    ) -> None:
        """Begin.

        Parameters
        ----------
        source : binary file
            The program; seekable.
        target : binary file or None
            Empty and seekable; None to write nothing.
        program : Program
            As it was read.
        emitter : Controller
            Writes the streams.
        options : Options
            The user's choices, and the program's dialect.
        stamp : bytes
            Text of the stamp, of `stamp_text`.
        beside : binary file, optional
            Takes what the emitter writes beside the program.
        guarded : bool, optional
            Streams run at 100 % of both overrides only: the operator is told so.
        """
        self.source, self.target, self.program = source, target, program
        self.beside = beside if emitter.beside else None
        self.sums = hashlib.blake2b(digest_size=6)
        self.opening_at: int | None = None
        self.emitter, self.options = emitter, options
        self.stamp = b""
        if emitter.in_place and options.dialect.writing is not None:
            opens, closes = options.dialect.writing.comment
            note = stamp_note(emitter.name, guarded).encode()
            self.stamp = b"".join(opens + text + closes + program.newline for text in (stamp, note))
        self.digest = hashlib.blake2b(digest_size=16)
        self.written = hashlib.blake2b(digest_size=SUM_DIGITS // 2)
        self.sum_at: int | None = None
        self.at = 0
        self.between = b""
        self.edits = Growing(np.int64, width=3)
        self.noted: list[tuple[int, int, int]] = []
        """Edits that are still to be added."""
        self.size = 0
        """Of the output so far."""
        self.pieces: list[bytes] = []
        self.waiting = 0
        """Bytes that are still to be written."""
        self.like: NDArray[np.int64] | None = None
        self.copies: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self.kept: dict[int, bytes] = {}
        """Texts of moves that stand in other places, too."""
        self.texts: dict[int, bytes] = {}
        """Of the window, by move; and what belongs beside the program."""
        self.aside: dict[int, bytes] = {}
        self.uses: NDArray[np.int32] = np.zeros(0, dtype=np.int32)
        """In how many they still stand, of each move."""
        source.seek(0)

    def repeat(self, like: NDArray[np.int64]) -> None:
        """Write streams that are the same again, where they come (`same_streams`)."""
        self.like = like
        copies = Growing(np.int64)
        self.uses = np.zeros(len(like), dtype=np.int32)
        for part in windows(len(like)):
            rows = part.start + np.flatnonzero(like[part] != np.arange(part.start, part.stop))
            copies.extend(rows)
            np.add.at(self.uses, like[rows], 1)
        self.copies = copies.finish()

    def write_header(self, machine: Machine) -> None:
        """Write the first lines of a file of its own."""
        if self.target is not None:
            self._sign(self.emitter.header(machine))
        self._put_beside(self.emitter.beside_header(machine))

    def begin(self) -> None:
        """Copy what stands in front of the first stream, and write the stamp."""
        if self.target is None or not self.emitter.in_place or self.noted or len(self.edits):
            return
        self.source.seek(self.at)
        self._copy(self.program.insert_at)
        self._put_stamp()

    def add(
        self,
        moves: NDArray[np.int64],
        texts: Sequence[bytes],
        aside: Sequence[bytes] | None = None,
    ) -> None:
        """Take texts, and what belongs beside them; those of one window are written together."""
        self.texts.update(zip(moves.tolist(), texts, strict=True))
        if aside is not None:
            self.aside.update(zip(moves.tolist(), aside, strict=True))

    def write(self) -> None:
        """Write the streams of a window; windows come in the order of the file."""
        texts, aside, self.texts, self.aside = self.texts, self.aside, {}, {}
        if texts:
            self._write_texts(texts, aside, max(texts))

    def _write_texts(self, texts: dict[int, bytes], aside: dict[int, bytes], last: int) -> None:
        """Write texts, and those that were written before and come in front of the last."""
        moves = np.array(sorted(texts), dtype=np.int64)
        between = self.copies[:0]
        if self.like is not None:
            self.kept.update((move, text) for move, text in texts.items() if self.uses[move])
            count = int(np.searchsorted(self.copies, last))
            between, self.copies = self.copies[:count], self.copies[count:]
        self.source.seek(self.at)
        for part in windows(len(between)):
            again = between[part]
            before = int(np.searchsorted(moves, again[-1]))
            self._write_rows(np.sort(np.concatenate([moves[:before], again])), texts, aside)
            moves = moves[before:]
        for part in windows(len(moves)):
            self._write_rows(moves[part], texts, aside)

    def _write_rows(
        self, rows: NDArray[np.int64], texts: dict[int, bytes], aside: dict[int, bytes]
    ) -> None:
        """Write the texts of some rapids, in the order of the file."""
        rapids = self.program.rapids
        firsts = rows if self.like is None else self.like[rows]
        ends = rapids.end[rows] + TERMINATOR_LENGTH[rapids.terminator[rows]]
        columns = (rows, firsts, rapids.begin[rows], ends)
        for move, first, at, end in zip(*(c.tolist() for c in columns), strict=True):
            text = texts.get(move) or self._text_again(first)
            if text is None:
                continue
            self._copy(at)
            self._read(end)
            self._put(self.between + text, move)
            self.between = self.emitter.between
            if aside:
                self._put_beside(aside[move])

    def _text_again(self, first: int) -> bytes | None:
        """The text of a move once more; it is forgotten when it comes no more."""
        text = self.kept.get(first)
        if text is not None:
            self.uses[first] -= 1
            if not self.uses[first]:
                del self.kept[first]
        return text

    def _put_beside(self, text: bytes) -> None:
        """Write to the file beside the output."""
        if self.beside is not None:
            self.beside.write(text)
            self.sums.update(text)

    def blocks(self, moves: NDArray[np.int64]) -> list[bytes]:
        """The blocks of rapids."""
        rapids, blocks = self.program.rapids, []
        begins, ends = rapids.begin[moves].tolist(), rapids.end[moves].tolist()
        for begin, end in zip(begins, ends, strict=True):
            self.source.seek(begin)
            blocks.append(self.source.read(end - begin))
        return blocks

    def _put(self, text: bytes, move: int) -> None:
        """Write what is not the source's, and note where."""
        if self.emitter.in_place:
            self.noted.append((self.size, self.size + len(text), move))
        self._sign(text)

    def _sign(self, text: bytes) -> None:
        """Write, many pieces at a time, and sum up."""
        self.pieces.append(text)
        self.size += len(text)
        self.waiting += len(text)
        if self.waiting > COPY_SIZE:
            self._flush()

    def _flush(self) -> None:
        """Write what waits."""
        assert self.target is not None
        text = b"".join(self.pieces)
        self.pieces, self.waiting = [], 0
        self.target.write(text)
        self.written.update(text)
        self.edits.extend(np.array(self.noted, dtype=np.int64).reshape(-1, 3))
        self.noted = []

    def _put_stamp(self) -> None:
        """Write the stamp, its sum to be filled in at the end."""
        assert self.target is not None
        at = self.size
        if at < SUM_WITHIN:
            found = self.stamp.find(SUM_UNKNOWN)
            self.sum_at = None if found < 0 else at + found + len(SUM_MARK)
        stamp = self.stamp if self.sum_at is not None else self.stamp.replace(SUM_UNKNOWN, b"")
        self.opening_at = at + len(stamp)
        self._put(stamp + self.emitter.opening(self.program.newline), -1)

    def finish(self) -> None:
        """Copy what follows the last stream, and see that the source is still what was planned."""
        if self.target is None:
            return
        if len(self.copies):
            self._write_texts({}, {}, len(self.program.rapids))
        self.source.seek(self.at)
        self._copy(self.program.size)
        self._flush()
        self.target.write(self.emitter.footer(self.written.hexdigest()))
        if self.source.read(1) or self.digest.digest() != self.program.digest:
            raise changed_error(self.program.name)
        if self.beside is not None and self.opening_at is not None:
            self._name_beside(self.opening_at)
        if self.sum_at is not None:
            self.target.seek(self.sum_at)
            self.target.write(self.written.hexdigest().encode())
            self.target.seek(0, io.SEEK_END)
        self.target.flush()

    def _name_beside(self, at: int) -> None:
        """Write the sum of the file beside into the program, and sum that up anew."""
        assert self.target is not None
        assert self.beside is not None
        self.beside.flush()
        digest = self.sums.digest()
        sums = (int.from_bytes(digest[:3], "big"), int.from_bytes(digest[3:], "big"))
        self.target.seek(at)
        self.target.write(self.emitter.opening(self.program.newline, sums))
        self.target.seek(0)
        self.written = hashlib.blake2b(digest_size=SUM_DIGITS // 2)
        while data := self.target.read(COPY_SIZE):
            self.written.update(data)

    def _read(self, end: int) -> bytes:
        """The source's next bytes, up to an offset."""
        data = self.source.read(end - self.at)
        self.at = end
        self.digest.update(data)
        return data

    def _copy(self, end: int) -> None:
        """Copy the source up to an offset; only read it where the output is its own file."""
        while self.at < end:
            data = self._read(min(end, self.at + COPY_SIZE))
            if self.target is not None and self.emitter.in_place:
                self._sign(data)
