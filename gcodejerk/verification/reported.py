"""The profiles that a report tells of, for a proof that holds the streams to them.

Rule: only what the report promises is read (`process --report FILE.json`): lines of rapids, and the
segments of those that have one law for all axes.
"""

from __future__ import annotations

import gzip
import json
import zlib
from pathlib import Path

import numpy as np

from gcodejerk.errors import VerifyError
from gcodejerk.verification.physics.aligned import Reported

PACKED = b"\x1f\x8b"
"""How gzip begins."""


def read_reported(path: str | Path) -> Reported:
    """Read the profiles of a report.

    Parameters
    ----------
    path : str or Path
        What `process --report FILE.json` wrote.

    Returns
    -------
    mapping of int to ndarray, shape (s, 2)
        Line of a rapid to the segments of its profile: duration [s] and jerk [mm/s^3].

    Raises
    ------
    VerifyError
        The file cannot be read, or is no such report.
    """
    try:
        data = Path(path).read_bytes()
        data = gzip.decompress(data) if data.startswith(PACKED) else data
        rapids = json.loads(data.decode("utf-8"))["rapids"]
        return {
            int(rapid["line"]): np.array(
                [[float(s["duration"]), float(s["jerk"])] for s in rapid["segments"]]
            ).reshape(-1, 2)
            for rapid in rapids
            if rapid["status"] == "planned" and isinstance(rapid["segments"], list)
        }
    except OSError as error:
        raise VerifyError(
            f"cannot read '{path}': {error.strerror}", "give the name of a file that can be read"
        ) from error
    except (ValueError, KeyError, TypeError, EOFError, zlib.error) as error:
        raise VerifyError(
            f"'{path}' is no report of process ({type(error).__name__}: {error})",
            "give the file that `process --report FILE.json` wrote",
        ) from error
