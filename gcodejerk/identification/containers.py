"""Records in files that a library reads: UFF 58 by pyuff, Shake&Tune's .stdata by zstandard.

Both libraries are optional (`pip install 'gcodejerk[identify]'`); where one is missing, the file is
refused with that remedy. One file may hold several records.

Source: pyuff (MIT) for UFF 58; Klippain Shake&Tune, shaketune/helpers/accelerometer.py, for
.stdata: a zstandard stream of JSON lines, each of them
`{"name": ..., "samples": [[t, ax, ay, az], ...]}` [s, mm/s^2].
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gcodejerk.identification.record import RecordError, Samples, Spectrum, unit_of
from gcodejerk.identification.responses import FrequencyResponse

Read = Samples | Spectrum | FrequencyResponse
"""What a file holds."""

COMPRESSED = b"\x28\xb5\x2f\xfd"
"""A zstandard stream begins so."""
REMEDY = "install it with: pip install 'gcodejerk[identify]'"
TIME_RESPONSE, AUTO_SPECTRUM, FREQUENCY_RESPONSE, PSD = 1, 2, 4, 9
"""Functions of UFF 58 (record 6, field 1)."""
LARGEST = 1 << 31
"""Bytes that a stream may hold."""


def read_stdata(name: str, data: bytes) -> list[Read]:
    """The measurements of Shake&Tune.

    Parameters
    ----------
    name : str
        What messages call the file.
    data : bytes

    Returns
    -------
    list of Samples

    Raises
    ------
    RecordError
        The library is missing, or the stream is not such a file.
    """
    try:
        import zstandard
    except ImportError:
        raise RecordError(
            f"{name} is compressed (Shake&Tune's .stdata), which zstandard reads: it is not "
            "installed",
            f"{REMEDY}; or record with OUTPUT=raw_data, and give the CSV file",
        ) from None
    try:
        with zstandard.ZstdDecompressor().stream_reader(io.BytesIO(data)) as stream:
            text = stream.read(LARGEST)
    except zstandard.ZstdError as error:
        raise RecordError(f"{name} is a broken stream: {error}", "copy the file again") from None
    out: list[Read] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            one = json.loads(line)
            rows = np.array(one["samples"], dtype=float)
            said = str(one["name"])
        except (ValueError, KeyError, TypeError):
            rows, said = np.zeros((0, 0)), ""
        if rows.ndim != 2 or rows.shape[1] != 4:
            raise RecordError(
                f"{name}, line {number} of the stream, is no measurement",
                "lines of name and samples of time and three accelerations are expected",
            )
        channels = ("accel_x", "accel_y", "accel_z")
        out.append(Samples(f"{name} {said}", rows[:, 0], None, channels, rows[:, 1:].T, "mm/s^2"))
    if not out:
        raise RecordError(f"{name} holds no measurement", "record again")
    return out


def read_uff(name: str, path: str | Path) -> list[Read]:
    """Records, spectra and frequency responses of a UFF 58 file; channels of one grid together.

    Parameters
    ----------
    name : str
        What messages call the file.
    path : str or Path

    Returns
    -------
    list of Samples, Spectrum or FrequencyResponse

    Raises
    ------
    RecordError
        The library is missing, or the file holds none of them.
    """
    try:
        import pyuff
    except ImportError:
        raise RecordError(
            f"{name} is a UFF 58 file, which pyuff reads: it is not installed",
            f"{REMEDY}; or write its records as CSV",
        ) from None
    try:
        found = pyuff.UFF(str(path)).read_sets()
    except Exception as error:  # whatever a library says of a broken file
        raise RecordError(f"{name} is no whole UFF file: {error}", "export it again") from None
    sets = [one for one in (found if isinstance(found, list) else [found]) if one.get("type") == 58]
    out: list[Read] = []
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for one in sets:
        kind = int(one.get("func_type", 0))
        if kind in (TIME_RESPONSE, AUTO_SPECTRUM, PSD, FREQUENCY_RESPONSE):
            x = np.asarray(one["x"], dtype=float)
            sort = PSD if kind == AUTO_SPECTRUM else kind
            key = (sort, len(x), float(x[0]), float(x[-1]), _unit(one))
            groups.setdefault(key, []).append(one)
    for (kind, *_, unit), members in groups.items():
        x = np.asarray(members[0]["x"], dtype=float)
        values = np.array([one["data"] for one in members])
        channels = tuple(_channel(one, k) for k, one in enumerate(members))
        if kind == TIME_RESPONSE:
            out.append(Samples(name, x, None, channels, values.real, unit))
        elif kind == FREQUENCY_RESPONSE:
            out.append(FrequencyResponse(name, x, channels, values.astype(np.complex128)))
        else:
            out.append(Spectrum(name, x, channels, values.real))
    if not out:
        raise RecordError(
            f"{name} holds neither records over time nor spectra nor frequency responses",
            "export them as UFF 58",
        )
    return out


def _unit(one: dict[str, Any]) -> str | None:
    return unit_of(f"a ({str(one.get('ordinate_axis_units_lab', '')).strip()})")


def _channel(one: dict[str, Any], k: int) -> str:
    """Node and direction, as the file has them."""
    direction = {1: "X", 2: "Y", 3: "Z", -1: "-X", -2: "-Y", -3: "-Z"}
    node, way = one.get("rsp_node", k + 1), direction.get(int(one.get("rsp_dir", 0)), "")
    return f"{node}{way}"


def chosen(found: Sequence[Read], columns: Sequence[str]) -> list[Read]:
    """Only some channels of what was read.

    Parameters
    ----------
    found : sequence of Samples or Spectrum
    columns : sequence of str
        Names of channels; all where there are none.

    Returns
    -------
    list of Samples or Spectrum

    Raises
    ------
    RecordError
        A record has no such channel.
    """
    if not columns:
        return list(found)
    out: list[Read] = []
    for one in found:
        missing = [name for name in columns if name not in one.channels]
        if missing:
            raise RecordError(
                f"{one.name} has no channel {missing[0]!r}",
                f"its channels are {', '.join(one.channels)}",
            )
        rows = [one.channels.index(name) for name in columns]
        kept: dict[str, Any] = {"channels": tuple(columns), "values": one.values[rows]}
        out.append(replace(one, **kept))
    return out
