"""An amplitude map as a table for other programs: one row for each point that has a profile."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.studies.amplitude_map import Survey

Array = NDArray[np.float64]


def map_csv(survey: Survey, T1: Array, T_SUM: Array) -> bytes:
    """The map of a survey in long form.

    Parameters
    ----------
    survey : Survey
        The move, and the modes it is judged by.
    T1, T_SUM : ndarray, shape (n,), (k,)
        Axes of the map. [s]

    Returns
    -------
    bytes
        Header `T1,T_SUM,amplitude` (of one mode, participation 1) or `T1,T_SUM,displacement` (the
        worst of all modes); by T_SUM, then by T1. [s], [s], [mm/s^2] or [mm]
    """
    values = survey.values(T1, T_SUM)
    row, column = np.nonzero(np.isfinite(values))
    points = zip(
        T1[column].tolist(), T_SUM[row].tolist(), values[row, column].tolist(), strict=True
    )
    quantity = "amplitude" if survey.mode is not None else "displacement"
    lines = [f"T1,T_SUM,{quantity}", *(f"{a:.10g},{b:.10g},{value:.10g}" for a, b, value in points)]
    return "\n".join(lines).encode() + b"\n"
