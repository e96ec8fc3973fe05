"""A measured resonance spectrum: from the lines of a CSV file to the lines of a Spectrum.

Rule: of the measured directions only the sum counts, for by that Klipper judges too. All of a file
is read and checked, also what lies outside the usable band.

Rule: errors are about the file alone. Where the machine file names it, the loader knows.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.parts import Spectrum
from gcodejerk.machine.reading import NotAFileError, read_file

Array = NDArray[np.float64]

MOST_BYTES = 10_000_000
MOST_ROWS = 200_000
"""Of a file; Klipper writes some hundreds."""
FEWEST_LINES = 8
MOST_LINES = 48
"""Of a Spectrum: every line is an oscillator that each candidate of a profile is held against."""
NEGLIGIBLE = 1e-4
"""Share of the energy that may be left out."""

# What is below is no vibration of the machine but drift, gravity as the sensor tilts, and the
# motion itself. Klipper has the same bound (MIN_FREQ in klippy/extras/shaper_calibrate.py): it used
# to set the PSD below it to zero, and now fades it out between twice the bound and none.
LOWEST_FREQUENCY = 5.0

_REMEDY = "write frequency [Hz] and PSD on each line, with a comma between: 42.5,1.3e+3"


def load_spectrum(
    source: str, folder: Path, highest: float, participation: float = 1.0
) -> Spectrum:
    """Spectrum from a file.

    Parameters
    ----------
    source : str
        The file, as the machine file names it.
    folder : Path
        Where a relative name begins.
    highest : float
        Frequency that lines have to be below: half the sampling rate, or infinity where that is
        not known. [Hz]
    participation : float, optional
        How strongly the axis excites what was measured. [-]

    Returns
    -------
    Spectrum
        Its lines, `MOST_LINES` at most.

    Raises
    ------
    MachineError
        The file cannot be read, is no spectrum, or has no line in the usable band. The problem
        completes "which"; its place, where it has one, is in the spectrum file.
    """
    return read_spectrum(_read(folder / source), source, highest, participation)


def read_spectrum(data: bytes, source: str, highest: float, participation: float = 1.0) -> Spectrum:
    r"""As `load_spectrum`, from the bytes of a file: Klipper's, or plain `f,PSD`.

    Parameters
    ----------
    data : bytes
        The whole file.
    source : str
        What messages call it.
    highest, participation
        As for `load_spectrum`.

    Notes
    -----
    The PSD is the column `psd_xyz` where there is one, otherwise the sum of `psd_x`, `psd_y` and
    `psd_z`, otherwise the second column. A line stands for the frequencies up to the middle
    between it and its neighbours (the trapezoidal rule).

    Examples
    --------
    A fifth of the energy at 30 Hz and the rest at 40 Hz; lines without any are left out:

    >>> psd = {10: 0, 20: 0, 30: 1, 40: 4, 50: 0, 60: 0, 70: 0, 80: 0}
    >>> text = "\n".join(f"{f},{value}" for f, value in psd.items())
    >>> spectrum = read_spectrum(text.encode(), "x.csv", highest=500.0)
    >>> spectrum.frequency, spectrum.weight, spectrum.peak
    ((30.0, 40.0), (0.2, 0.8), 40.0)
    """
    f, psd = _table(data, source)
    usable = (f >= LOWEST_FREQUENCY) & (f < highest)
    f, psd = f[usable], psd[usable]
    band = f"from {LOWEST_FREQUENCY:g} Hz"
    if highest < math.inf:
        band += f" to below {highest:g} Hz, half the sampling rate 1/interval"
    if len(f) < FEWEST_LINES:
        raise MachineError(
            f"has {len(f) or 'no'} line{'s' * (len(f) != 1)} {band}, "
            f"expected at least {FEWEST_LINES}",
            "give frequencies in Hz, and more of them; for single peaks write modes instead",
        )
    if not psd.any():
        raise MachineError(
            f"is zero everywhere {band}",
            "measure again; where nothing vibrates, leave the spectrum out",
        )
    frequency, weight = reduced(f, psd / psd.max(), _widths(f))
    return Spectrum(
        source=source,
        frequency=tuple(frequency.tolist()),
        weight=tuple(weight.tolist()),
        peak=float(f[psd.argmax()]),
        participation=participation,
    )


def reduced(frequency: Array, psd: Array, width: Array) -> tuple[Array, Array]:
    r"""Fewer lines that hold the same energy.

    Parameters
    ----------
    frequency, psd, width : ndarray, shape (n,)
        Lines [Hz], rising; their power spectral density, the largest of which is 1; and how much of
        the frequency axis each stands for [Hz].

    Returns
    -------
    frequency, weight : ndarray, shape (m,)
        At most `MOST_LINES` lines [Hz] and their shares of the energy [-].

    Notes
    -----
    Lines are left out only where together they hold less than `NEGLIGIBLE` of the energy. If too
    many are left, neighbours are merged in cells, each into its centroid. The cells are those of an
    n-level quantiser with the least mean square error: of the density p^(1/3) for values of the
    density p [1]_, here the PSD.

    References
    ----------
    .. [1] P. F. Panter and W. Dite, Proceedings of the IRE 39(1), 1951, pp. 44-48.
    """
    energy = psd * width
    kept = ~_negligible(energy)
    f, energy, density = frequency[kept], energy[kept], np.cbrt(psd[kept]) * width[kept]
    if len(f) > MOST_LINES:
        middle = np.cumsum(density) - 0.5 * density
        # The last line may round up into a cell of its own.
        cell = np.minimum(np.floor(MOST_LINES * middle / density.sum()), MOST_LINES - 1)
        first = np.flatnonzero(np.diff(cell, prepend=-1.0))
        last = np.append(first[1:], len(f)) - 1
        merged = np.add.reduceat(energy, first)
        # From the cell's first line: a line that stays alone keeps its frequency to the last bit.
        above = f - f[first].repeat(last - first + 1)
        centroid = f[first] + np.add.reduceat(energy * above, first) / merged
        f, energy = np.minimum(centroid, f[last]), merged
    weight = energy / energy.sum()
    weight[weight.argmax()] -= math.fsum([*weight, -1.0])
    return f, weight


def _negligible(energy: Array) -> NDArray[np.bool_]:
    """The weakest lines, which together hold less than `NEGLIGIBLE` of the energy."""
    order = np.argsort(energy, kind="stable")
    weakest = np.cumsum(energy[order]) < NEGLIGIBLE * energy.sum()
    mask = np.zeros(len(energy), dtype=np.bool_)
    mask[order[weakest]] = True
    return mask


def _widths(f: Array) -> Array:
    """How much of the frequency axis each line stands for [Hz], by the trapezoidal rule."""
    gaps = np.diff(f, prepend=f[0], append=f[-1])
    widths: Array = 0.5 * (gaps[:-1] + gaps[1:])
    return widths


def _read(path: Path) -> bytes:
    try:
        data = read_file(path, MOST_BYTES + 1)
    except IsADirectoryError:
        raise MachineError("is a folder, expected a CSV file", "name the file in it") from None
    except NotAFileError:
        raise MachineError("is not a file, expected a CSV file", "name a file") from None
    except FileNotFoundError:
        raise MachineError(
            "does not exist", "give its path from the folder of the machine file"
        ) from None
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise MachineError(
            f"cannot be read: {reason}", "check the path and its permissions"
        ) from None
    if len(data) > MOST_BYTES:
        raise MachineError(
            f"is larger than {MOST_BYTES // 1_000_000} MB, which no spectrum is",
            "name the spectrum, not the recording that it was made from",
        )
    return data


def _table(data: bytes, source: str) -> tuple[Array, Array]:
    """Columns of frequency and PSD, every line checked."""
    if b"\x00" in data:
        raise MachineError("is not text", "save it as comma-separated text in UTF-8")
    if max(data.count(b"\n"), data.count(b"\r")) > MOST_ROWS:
        raise MachineError(
            f"has more than {MOST_ROWS} lines, which no spectrum has",
            "name the spectrum, not the recording that it was made from",
        )
    # Only numbers and a few ASCII words are looked at: a comment may be in any encoding.
    text = data.decode("utf-8-sig", errors="replace")
    columns, header = [1], False
    f: list[float] = []
    psd: list[float] = []
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        cells = line.split(",")
        comment = not line.strip() or line.lstrip().startswith("#")
        if comment or (not f and not header and not _is_number(cells[0])):
            # numpy writes the names of the columns as a comment; one without them changes nothing.
            columns, header = _columns(cells) or columns, header or not comment
            continue
        try:
            frequency, *directions = (float(cells[column]) for column in (0, *columns))
        except (ValueError, IndexError):
            raise _wrong(source, number, line, "numbers", _REMEDY) from None
        value = sum(directions)
        if not (frequency < math.inf and value < math.inf and min(frequency, *directions) >= 0.0):
            remedy = "name the spectrum, not the recording in time that it was made from"
            raise _wrong(source, number, line, "finite numbers of at least 0", remedy)
        if f and frequency <= f[-1]:
            expected = f"a frequency above {f[-1]:g} Hz, that of the line before"
            raise _wrong(source, number, line, expected, "sort the lines by frequency")
        f.append(frequency)
        psd.append(value)
    return np.array(f), np.array(psd)


def _columns(cells: list[str]) -> list[int]:
    """Columns that add up to the PSD, by the names in a header; none for other text."""
    names = [cell.strip('#" \t').lower() for cell in cells]
    wanted = ("psd_xyz",) if "psd_xyz" in names else ("psd_x", "psd_y", "psd_z")
    return [names.index(name) for name in wanted if name in names]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _wrong(source: str, number: int, line: str, expected: str, remedy: str) -> MachineError:
    shown = repr(line if len(line) <= 60 else line[:57] + "...")
    return MachineError(f"the line is {shown}, expected {expected}", remedy, Place(source, number))
