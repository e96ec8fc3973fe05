"""A survey as JSON: the profile that the map would choose, and what each mode keeps of it."""

from __future__ import annotations

from typing import Any

from gcodejerk._version import __version__
from gcodejerk.machine import Mode
from gcodejerk.studies.amplitude_map import Survey


def map_record(survey: Survey) -> dict[str, Any]:
    """The numbers of `tables.map_tables`, whole.

    Parameters
    ----------
    survey : Survey
        Of one move of one axis.

    Returns
    -------
    dict
        Times in s, amplitudes in mm/s^2 (deg/s^2), displacements in mm (deg); `chosen` is null
        where no time is long enough for the limits.
    """
    chosen = survey.choose()
    return {
        "gcodejerk": __version__,
        "machine": survey.machine.source,
        "move": {survey.axis.name: survey.length},
        "condition": str(survey.condition),
        "conventional_time": survey.conventional_time,
        "chosen": None if chosen is None else {"T1": chosen.T1, "T_SUM": chosen.T_SUM},
        "modes": [
            {"mode": mode.name, "frequency": mode.frequency, "damping": mode.damping}
            | _left(survey, "conventional_", survey.conventional_amplitude(mode), mode)
            | (
                {}
                if chosen is None
                else _left(survey, "", survey.amplitude(mode, chosen.T1, chosen.T_SUM), mode)
            )
            for mode in survey.counted_modes
        ],
    }


def _left(survey: Survey, prefix: str, amplitude: float, mode: Mode) -> dict[str, float]:
    return {
        f"{prefix}acceleration": amplitude,
        f"{prefix}displacement": survey.displacement(mode, amplitude),
    }
