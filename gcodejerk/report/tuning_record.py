"""A tuned control as JSON: its settings, what they leave, and what more or less time would buy."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gcodejerk._version import __version__
from gcodejerk.emit.sheets import Change, changes
from gcodejerk.parameters import Outcome, Tuning
from gcodejerk.parameters.tuning import SPREAD
from gcodejerk.report.records import Record, number
from gcodejerk.rewrite.control_settings import ControlSettings


def tuning_record(tuning: Tuning, way: str) -> Record:
    """The record of a tuning.

    Parameters
    ----------
    tuning : Tuning
        Of `parameters.tune`.
    way : str
        Which of the controller's ways of setting it.

    Returns
    -------
    dict
        Times in s, residuals in mm, numbers as the control has them.
    """
    scheme = tuning.scheme
    return {
        "gcodejerk": __version__,
        "machine": tuning.machine.source,
        "controller": scheme.controller,
        "settings_of": way,
        "law": scheme.family.name,
        "goal": tuning.goal,
        "band": tuning.machine.design.band,
        "rapids": {"distinct": len(tuning.moves), "all": number(float(tuning.moves.count.sum()))},
        "today": outcome_record(tuning.today),
        "law_as_today": outcome_record(tuning.as_set),
        "chosen": outcome_record(tuning.chosen),
        "fits": tuning.fits,
        "gains": tuning.gains,
        "proven": tuning.proven,
        "judged": tuning.judged,
        "settings": setting_records(changes(tuning)),
        "curve": [
            {
                "time": number(point.total),
                "residual": number(point.value),
                "settings": [
                    s.text(x) for s, x in zip(scheme.settings, point.written, strict=True)
                ],
            }
            for point in tuning.curve
        ],
        "robustness": {
            "frequency_error": np.round(SPREAD, 6).tolist(),
            "today": [number(x) for x in tuning.spread[0].tolist()],
            "law_as_today": [number(x) for x in tuning.spread[1].tolist()],
            "chosen": [number(x) for x in tuning.spread[2].tolist()],
        },
        "cannot": list(scheme.cannot),
        "notes": list(scheme.notes),
    }


def setting_records(changed: Iterable[Change]) -> list[Record]:
    """Old and new number of each setting, and where the fact is from."""
    return [
        {
            "number": c.setting.number,
            "axis": c.setting.axis,
            "unit": c.unit,
            "meaning": c.setting.meaning,
            "old": c.old or None,
            "new": c.new,
            "fact": c.setting.mark,
            "source": c.setting.source,
            "where": c.setting.where,
            "restart": c.setting.restart,
            "live": c.live,
        }
        for c in changed
    ]


def settings_record(settings: ControlSettings) -> Record:
    """What the report on a program says of the control's settings."""
    tuning = settings.tuning
    return {
        "settings": setting_records(settings.changed),
        "settings_at": settings.places,
        "tuning": None
        if tuning is None
        else {
            "law": tuning.scheme.family.name,
            "goal": tuning.goal,
            "band": tuning.machine.design.band,
            "today": outcome_record(tuning.today),
            "chosen": outcome_record(tuning.chosen),
            "gains": tuning.gains,
            "proven": tuning.proven,
        },
    }


def outcome_record(outcome: Outcome) -> Record:
    """What one way of moving takes and leaves."""
    return {"time": number(outcome.total), "residual": number(outcome.value)}
