"""Files of sensors and controls, read into samples or a spectrum.

This module owns the formats: what is told by a header, what by a first line, what the user has to
say. Any CSV with times and columns can be read; the formats that are known need no option.

| format | known by | source |
|---|---|---|
| Klipper, raw | `#time,accel_x,...`, s and mm/s^2 | klippy/extras/adxl345.py |
| Klipper, PSD | `freq,psd_x,...` | klippy/extras/shaper_calibrate.py |
| Duet | `Sample,X,Y,Z`, last line `Rate N`, g | general knowledge |
| phyphox | `"Time (s)","Acceleration x (m/s^2)"` | general knowledge |
| PicoQuake | `#` lines with `data_rate`, `count,a_x,..`, g | PicoQuake docs |
| LinuxCNC halscope | `# Sampling period is N ns` | src/hal/utils/scope_files.c |
| LinuxCNC halsampler | columns without header; --rate | man halsampler |
| TwinCAT Scope and others | a header; --time, --column | Beckhoff TE13xx |
| UFF 58, Shake&Tune's .stdata | their first bytes; `containers` | pyuff; Klippain Shake&Tune |
"""

from __future__ import annotations

import csv
import io
import re
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gcodejerk.identification.containers import COMPRESSED, Read, chosen, read_stdata, read_uff
from gcodejerk.identification.record import RecordError, Samples, Spectrum, unit_of
from gcodejerk.motion.profiles.profile import Array

LARGEST = 1 << 30
"""Bytes of a file."""
HEAD_LINES = 40
SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
NO_NUMBERS = ("nan", "inf", "-inf", "+inf", "infinity", "-infinity")
"""What numpy reads all the same; the record is refused with its place later."""
_NUMBER = re.compile(r"[-+]?(\d+(?:[.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?$")
_TIME = re.compile(r"^#?\W*(time|t|zeit|timestamp)\b|^#?\W*(time|t)[ _(\[]", re.IGNORECASE)
_COUNT = re.compile(r"^\W*(sample|count|index|n|no\.?)\W*$", re.IGNORECASE)


def read_records(
    path: str | Path,
    *,
    time: str | None = None,
    columns: Sequence[str] = (),
    rate: float | None = None,
) -> list[Read]:
    """Read all that a file holds: one table, or the records of a UFF 58 or .stdata file.

    Parameters
    ----------
    path, time, columns, rate
        As `read_file` has them; `time` and `rate` are of tables.

    Returns
    -------
    list of Samples, Spectrum or FrequencyResponse

    Raises
    ------
    RecordError
        As `read_file`.
    """
    name = str(path)
    data = _content(path)
    if data[:4] == COMPRESSED:
        return chosen(read_stdata(name, data), columns)
    if re.match(rb"\s*-1\s*\n\s*58\b", data):
        return chosen(read_uff(name, path), columns)
    return [_read_table(name, data, time, columns, rate)]


def read_file(
    path: str | Path,
    *,
    time: str | None = None,
    columns: Sequence[str] = (),
    rate: float | None = None,
) -> Read:
    """Read a file of a sensor or a control that holds one record.

    Parameters
    ----------
    path : str or Path
    time : str, optional
        Name, or number from 1, of the column of times.
    columns : sequence of str, optional
        Names, or numbers from 1, of the channels; all by default.
    rate : float, optional
        In place of times. [Hz]

    Returns
    -------
    Samples or Spectrum

    Raises
    ------
    RecordError
        It cannot be read, or is not understood.
    """
    found = read_records(path, time=time, columns=columns, rate=rate)
    if len(found) != 1:
        raise RecordError(f"{path} holds {len(found)} records", "give a file of one")
    return found[0]


def _content(path: str | Path) -> bytes:
    """The bytes of a file, if they are not too many."""
    if str(path) == "-":
        return sys.stdin.buffer.read()
    try:
        size = Path(path).stat().st_size
        if size > LARGEST:
            raise RecordError(f"{path} has {size >> 20} MB, expected at most 1024", "cut it")
        return Path(path).read_bytes()
    except OSError as error:
        raise RecordError(
            f"{path} cannot be read: {error.strerror}", "check the name and the folder"
        ) from None


def _read_table(
    name: str, data: bytes, time: str | None, columns: Sequence[str], rate: float | None
) -> Samples | Spectrum:
    """A table of text."""
    text = data.decode("utf-8-sig", "replace")
    if "\x00" in text[:4096]:
        raise RecordError(f"{name} is no text", "export the record as CSV")
    lines = {k: line for k, line in enumerate(text.splitlines(), 1) if line.strip()}
    if not lines:
        raise RecordError(f"{name} is empty", "record again")
    return _Table(name, list(lines.values()), list(lines)).read(time, columns, rate)


class _Table:
    """Lines of a file, taken apart."""

    def __init__(self, name: str, lines: list[str], numbers: list[int]) -> None:
        self.name = name
        self.period = self._stated(lines, r"Sampling period is ([\d.]+) *ns", 1e-9)
        ends = self._stated(lines[-1:], r"Rate[ :]+([\d.]+)", 1.0)
        rated = self._stated(lines[:HEAD_LINES], r"data_rate\W+([\d.]+)", 1.0)
        self.rate = ends or rated or (1.0 / self.period if self.period else None)
        self.lost = [k for k, line in enumerate(lines) if line.strip() == "overrun"]
        kept = [k for k, line in enumerate(lines) if line.strip() != "overrun"]
        if ends:
            kept = kept[:-1]
        body = [lines[k] for k in kept]
        self.separator = self._find_separator(body)
        first = next((k for k, line in enumerate(body) if self._is_row(line)), None)
        if first is None:
            raise RecordError(
                f"{name} has no line of numbers",
                "a table of samples is expected: times and accelerations, one sample a line",
            )
        self.header = self._find_header(body[:first])
        self.comma = self.separator != "," and any("," in line for line in body[first : first + 5])
        self.rows = body[first:]
        self.numbers = [numbers[k] for k in kept[first:]]

    @staticmethod
    def _stated(lines: list[str], pattern: str, scale: float) -> float | None:
        for line in lines[:HEAD_LINES]:
            if found := re.search(pattern, line, re.IGNORECASE):
                return scale * float(found[1])
        return None

    @staticmethod
    def _find_separator(lines: list[str]) -> str | None:
        """What stands between columns, None: blanks."""
        sample = lines[min(len(lines) - 1, len(lines) // 2)]
        for mark in (";", "\t"):
            if mark in sample:
                return mark
        return "," if "," in sample else None

    def _cells(self, line: str) -> list[str]:
        if self.separator is None:
            return line.split()
        cells = next(csv.reader([line], delimiter=self.separator))
        return [cell.strip() for cell in (cells[:-1] if cells and not cells[-1] else cells)]

    def _is_row(self, line: str) -> bool:
        if line.lstrip().startswith("#"):
            return False
        cells = self._cells(line)
        return bool(cells) and all(_NUMBER.match(cell) for cell in cells)

    def _find_header(self, lines: list[str]) -> list[str]:
        """Names of the columns: the last line above the numbers that has several."""
        for line in reversed(lines):
            cells = self._cells(line.lstrip("# "))
            if len(cells) > 1 and not line.lstrip().startswith("# "):
                return cells
        return []

    def read(
        self, time: str | None, columns: Sequence[str], rate: float | None
    ) -> Samples | Spectrum:
        """What the table holds."""
        values = self._numbers()
        names = self.header or [f"column {k + 1}" for k in range(values.shape[1])]
        if len(names) != values.shape[1]:
            raise RecordError(
                f"{self.name} has {len(names)} names above {values.shape[1]} columns",
                "its header and its rows have to agree",
            )
        if names[0].lower().lstrip("#") in ("freq", "frequency", "freq (hz)", "frequency [hz]"):
            return self._spectrum(names, values, columns)
        at = None if rate is not None and time is None else self._time_column(names, time)
        chosen = self._chosen(names, columns, at)
        times = None
        if at is not None:
            times = values[:, at] * self._seconds(names[at])
        elif rate is None and self.rate is None:
            raise RecordError(
                f"{self.name} has no column of times: {', '.join(names)}",
                "state --time NAME or --rate HZ",
            )
        units = {unit_of(names[k]) for k in chosen}
        unit = units.pop() if len(units) == 1 else None
        if unit is None and self._has_klipper_names(names):
            unit = "mm/s^2"
        if unit is None and (names[0].lower() in ("sample", "count") and self.rate):
            unit = "g"
        return Samples(
            self.name, times, rate or self.rate, tuple(names[k].strip('# "') for k in chosen),
            values[:, chosen].T, unit, tuple(self.lost),
        )  # fmt: skip

    @staticmethod
    def _has_klipper_names(names: list[str]) -> bool:
        return [name.lstrip("# ") for name in names[:4]] == [
            "time", "accel_x", "accel_y", "accel_z",
        ]  # fmt: skip

    def _numbers(self) -> Array:
        text = "\n".join(self.rows)
        if self.comma:
            text = text.replace(",", ".")
        if self.separator in (";", ","):
            text = re.sub(rf"{self.separator}\s*$", "", text, flags=re.MULTILINE)
        try:
            out: Array = np.loadtxt(
                io.StringIO(text), delimiter=self.separator, ndmin=2, comments="#", quotechar='"'
            )
        except ValueError as error:
            raise self._bad_row() or RecordError(f"{self.name}: {error}") from None
        return out

    def _bad_row(self) -> RecordError | None:
        """The first row that is not as the first one, or holds no number."""
        wide = len(self._cells(self.rows[0]))
        for number, row in zip(self.numbers, self.rows, strict=True):
            if row.lstrip().startswith("#"):
                continue
            cells = self._cells(row)
            if len(cells) != wide:
                return RecordError(
                    f"{self.name}:{number}: {len(cells)} columns, above it {wide}",
                    "every row is as many numbers: mend it, or cut the record there",
                )
            for k, cell in enumerate(cells):
                if not _NUMBER.match(cell) and cell.lower() not in NO_NUMBERS:
                    return RecordError(
                        f"{self.name}:{number}: {cell[:40]!r} in column {k + 1} is no number",
                        "every row is as many numbers: mend it, or cut the record there",
                    )
        return None

    def _spectrum(self, names: list[str], values: Array, columns: Sequence[str]) -> Spectrum:
        axes = [k for k, name in enumerate(names) if re.fullmatch(r"psd_[xyz]", name.lower())]
        chosen = [self._index(names, column) for column in columns]
        chosen = chosen or axes or list(range(1, values.shape[1]))
        # The scores of shapers stand beside what was scaled for them: `mzv(54.2)`.
        shapers = any(re.fullmatch(r"\w+\([\d.]+\)", name) for name in names)
        scaled = shapers or "calibration" in Path(self.name).name
        return Spectrum(
            self.name, values[:, 0], tuple(names[k] for k in chosen), values[:, chosen].T,
            normalized=scaled,
        )  # fmt: skip

    def _time_column(self, names: list[str], time: str | None) -> int | None:
        if time is not None:
            return self._index(names, time)
        found = [k for k, name in enumerate(names) if _TIME.search(name.strip('"'))]
        return found[0] if found else None

    def _chosen(self, names: list[str], columns: Sequence[str], at: int | None) -> list[int]:
        if columns:
            return [self._index(names, column) for column in columns]
        rest = [k for k, name in enumerate(names) if k != at and not _COUNT.match(name)]
        felt = [k for k in rest if re.search(r"acc|^\W*a?_?[xyz]\W*$", names[k], re.IGNORECASE)]
        chosen = felt or rest
        # phyphox and others add the length of the vector.
        return [k for k in chosen if not re.search(r"abs|norm|total", names[k], re.IGNORECASE)]

    def _index(self, names: list[str], said: str) -> int:
        plain = [name.strip('# "') for name in names]
        if said in plain:
            return plain.index(said)
        if said.isdigit() and 1 <= int(said) <= len(names):
            return int(said) - 1
        raise RecordError(
            f"{self.name} has no column {said!r}", f"its columns are {', '.join(plain)}"
        )

    @staticmethod
    def _seconds(name: str) -> float:
        found = re.search(r"[(\[_ ](s|sec|ms|us|µs|ns)[)\]]?\W*$", name.strip('"'), re.IGNORECASE)
        return SECONDS[found[1].lower()] if found else 1.0
