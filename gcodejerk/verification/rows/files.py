"""Files of rows, read from their bytes: which format they are, the moves in them, their sum.

Rule: a file is read line by line, so that memory is that of one rapid. Its last line holds the sum
of all in front, so that every change shows, however small; a csv table has none.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.machine.file.table import PROFILES
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.rows.moves import Move, NoRowError, Steps
from gcodejerk.verification.rows.readers import (
    DOUBLES,
    RECORDS,
    TEXTS,
    Body,
    TextFormat,
    json_move,
    made,
    record_move,
    table_move,
)

HEAD = 4096
"""Of a file, in which its format shows. [bytes]"""
LONGEST_LINE = 1 << 24
DIGITS = 16
_TITLED = re.compile(rb"(?://|REM|#|!) gcodejerk \S{1,40} rows for ([a-z0-9]{1,20})\r?\n")
_RECORDS = b"(GCODEJERK "
_JSON = re.compile(rb'\{"gcodejerk": "[^"]{1,40}", "rows": 1, "controller": "json"')
_TABLE = re.compile(rb"block,t,([A-Z],[A-Z]_velocity,?)+\r?\n")
_PROFILE = re.compile(
    rb'^(?:(?:(?://|REM|#|!) |\()profile: |\{[ -~]{1,4000}? "profile": ")([a-z0-9]{1,20})\b',
    re.MULTILINE | re.IGNORECASE,
)
_NUMBER = re.compile(r"-?[0-9]{1,12}(?:\.[0-9]{1,15})?|nan")
_TITLE = re.compile(r"rapid at line ([0-9]{1,12}): .*")
_LEAVES = re.compile(r"leaves ([0-9.e+-]{1,25}) um, today's rapid [0-9.e+-]{1,25} um")
UM_PER_MM = 1e3


def rows_format(file: BinaryIO) -> str | None:
    r"""The controller of a file of rows; None where it is none. The file is left where it was.

    Examples
    --------
    >>> import io
    >>> rows_format(io.BytesIO(b"REM gcodejerk 0.1.0 rows for galil\nREM machine: M\n"))
    'galil'
    >>> rows_format(io.BytesIO(b"block,t,X,X_velocity\n")), rows_format(io.BytesIO(b"G0 X1\n"))
    ('csv', None)
    """
    at = file.tell()
    head = file.read(HEAD)
    file.seek(at)
    if head.startswith(_RECORDS):
        return "fanuc15"
    if match := _TITLED.match(head):
        name = match[1].decode()
        return name if name in TEXTS else None
    return "json" if _JSON.match(head) else "csv" if _TABLE.match(head) else None


def stated_profile(file: BinaryIO) -> str | None:
    """The profile that a file of rows says it was made with; None where it says none.

    Only who reads what was not stated otherwise needs it. The file is left where it was.
    """
    if rows_format(file) is None:
        return None
    at = file.tell()
    match = _PROFILE.search(file.read(HEAD))
    file.seek(at)
    name = match[1].decode().lower() if match else ""
    return name if name in PROFILES else None


class RowsFile:
    """Reads a file of rows move by move."""

    def __init__(self, file: BinaryIO, name: str, machine: Machine, found: Findings) -> None:
        self.file, self.name, self.machine, self.found = file, name, machine, found
        self.line = 0
        """Of the last line that was read."""
        self.sum = hashlib.blake2b(digest_size=DIGITS // 2)
        if name in TEXTS:
            self.steps: Steps = TEXTS[name].steps(machine)
        else:
            self.steps = (RECORDS if name == "fanuc15" else DOUBLES)(machine)

    def moves(self) -> Iterator[Move]:
        """Every move, up to the first line that is not of the format."""
        try:
            if self.name == "json":
                yield from self._document()
            elif self.name == "fanuc15":
                yield from self._stream()
            elif self.name == "csv":
                yield from self._table()
            else:
                yield from self._blocks(TEXTS[self.name])
        except NoRowError as error:
            self.found.add(Kind.TABLE, self.line, None, str(error))
        except UnicodeDecodeError:
            self.found.add(Kind.TABLE, self.line, None, "this is no text in ASCII")

    def _next(self) -> str | None:
        """The next line without its end, which is one LF; None behind the last."""
        raw = self.file.readline(LONGEST_LINE)
        if not raw:
            return None
        self.line += 1
        if not raw.endswith(b"\n") or b"\r" in raw:
            raise NoRowError("this line has no end, or not that of the others")
        self.raw = raw
        return raw[:-1].decode("ascii")

    def _check_sum(self, stated: str | None) -> None:
        """Compare the sum of all in front of the last line, and see that nothing follows."""
        if stated is None:
            raise NoRowError("the sum at the end is missing: the file is cut, or was added to")
        if stated != self.sum.hexdigest():
            self.found.add(
                Kind.STAMP, self.line, None, "the sum is not that of the file: it was changed"
            )
        if self.file.read(1):
            self.line += 1
            raise NoRowError("there is text behind the sum")

    def _parsed(self, text: TextFormat, body: list[str]) -> Body:
        """The rows of a titled block, which has some."""
        if not body:
            raise NoRowError("nothing stands below the title of a rapid")
        return text.parse(body, self.machine)

    # Complex: one grammar, line by line: its parts would hand five variables to each other.
    def _blocks(self, text: TextFormat) -> Iterator[Move]:
        """Titled blocks of lines; comments that no title begins are not looked at."""
        title: tuple[int, int] | None = None
        residual: float | None = None
        body: list[str] = []
        stated: str | None = None
        live = None
        while (line := self._next()) is not None:
            remark = line[len(text.comment) :] if line.startswith(text.comment) else None
            if remark is not None and (match := re.fullmatch(r"sum ([0-9a-f]{16})", remark)):
                stated = match[1]
                break
            self.sum.update(self.raw)
            begins = _TITLE.fullmatch(remark) if remark is not None else None
            if begins or line == "---":
                if title is not None:
                    yield made(*title, self._parsed(text, body), text, residual)
                title, residual, body = None, None, []
            if begins:
                title = (self.line, int(begins[1]))
            elif remark is not None and (match := _LEAVES.fullmatch(remark)):
                residual = float(match[1]) / UM_PER_MM
            elif title is not None and (remark is None or (text.inert and residual is not None)):
                if live is not None and live != (remark is None):
                    raise NoRowError("some rows are comments and some are not")
                live = remark is None
                body.append(line if remark is None else remark)
            elif remark is None and line != "---":
                raise NoRowError("rows below no title")
        if title is not None:
            yield made(*title, self._parsed(text, body), text, residual)
        self._check_sum(stated)

    def _stream(self) -> Iterator[Move]:
        """Text in parentheses, and binary records between a block G05 and a record of zeros."""
        size = 2 * len(self.machine.axes) + 1
        title: tuple[int, int] | None = None
        stated: str | None = None
        while (line := self._next()) is not None:
            if match := re.fullmatch(r"\(SUM ([0-9A-F]{16})\)", line):
                stated = match[1].lower()
                break
            self.sum.update(self.raw)
            if begins := re.fullmatch(r"\(RAPID AT LINE ([0-9]{1,12}): .*", line):
                title = (self.line, int(begins[1]))
            elif line == "G05" and title is not None:
                yield record_move(*title, self._records(size), self.machine)
                title = None
            elif not line.startswith("("):
                raise NoRowError("expected a comment, or a block G05 below the title of a rapid")
        self._check_sum(stated)

    def _records(self, size: int) -> bytes:
        """Records of one rapid, up to the record of zeros that ends it."""
        parts: list[bytes] = []
        while True:
            record = self.file.read(size)
            if len(record) < size:
                raise NoRowError("the records of a rapid have no end")
            self.sum.update(record)
            if not any(record):
                break
            parts.append(record)
        if not parts:
            raise NoRowError("a rapid without records: its first record says that it is over")
        return b"".join(parts)

    def _document(self) -> Iterator[Move]:
        """A JSON document, a rapid on each line."""
        self._next()
        before = self.raw
        stated = None
        while (line := self._next()) is not None:
            if match := re.fullmatch(r'\], "sum": "([0-9a-f]{16})"\}', line):
                # The line end in front belongs to the end of the document.
                self.sum.update(before[:-1])
                stated = match[1]
                break
            self.sum.update(before)
            before = self.raw
            if line:
                yield json_move(self.line, line.removesuffix(","))
        self._check_sum(stated)

    def _table(self) -> Iterator[Move]:
        """A table; the rows of a rapid stand together."""
        names = [name for a in self.machine.axis_names for name in (a, f"{a}_velocity")]
        wanted = ",".join(["block", "t", *names])
        if self._next() != wanted:
            raise NoRowError(f"the header is not '{wanted}'")
        columns = [AXES.index(a) for a in self.machine.axis_names]
        rows: list[list[float]] = []
        rapid = first = -1
        while (line := self._next()) is not None:
            cells = line.split(",")
            if len(cells) != 2 + len(names) or not all(map(_NUMBER.fullmatch, cells)):
                raise NoRowError(f"this is no row: '{line[:60]}'")
            if not cells[0].isdecimal():
                raise NoRowError(f"'{cells[0]}' is no line of the program")
            if int(cells[0]) != rapid:
                if rows:
                    yield table_move(first, rapid, np.array(rows), columns)
                rapid, first, rows = int(cells[0]), self.line, []
            rows.append([float(cell) for cell in cells[1:]])
        if rows:
            yield table_move(first, rapid, np.array(rows), columns)
