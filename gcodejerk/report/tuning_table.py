"""A tuned control for a terminal: its settings, before and after, and what time would buy."""

from __future__ import annotations

from collections.abc import Mapping

from gcodejerk.emit.sheets import GOAL_TEXT, changes
from gcodejerk.parameters import MARKS, Tuning
from gcodejerk.report.screen import ScreenTable
from gcodejerk.report.tables import UM_PER_MM


def tuning_tables(tuning: Tuning, tried: Mapping[str, float] | None = None) -> list[ScreenTable]:
    """Outcomes, settings, and the curve of time, as tables.

    Parameters
    ----------
    tuning : Tuning
        Of `parameters.tune`.
    tried : mapping of str to float, optional
        Numbers of the user's, by the keys of their settings; PlanError where one cannot be set.

    Returns
    -------
    list of ScreenTable
    """
    return [
        _outcomes(tuning, tried or {}),
        _settings(tuning),
        *([_curve(tuning)] if tuning.curve else []),
    ]


def _outcomes(tuning: Tuning, tried: Mapping[str, float]) -> ScreenTable:
    """Today, the control's law with today's numbers, with those that are tried, and the choice."""
    table = ScreenTable(
        ("", "left"), ("all rapids\n[s]", "right"), ("residual\n[um]", "right"),
        ("of today's", "right"), wrap=("",),
    )  # fmt: skip
    rows = [
        ("today, as the machine file has it", tuning.today),
        (f"{tuning.scheme.controller}, settings as today", tuning.as_set),
        (f"{tuning.scheme.controller}, new settings", tuning.chosen),
    ]
    if tried:
        said = ", ".join(f"{key} = {number:g}" for key, number in tried.items())
        rows.insert(2, (f"{tuning.scheme.controller}, {said}", tuning.outcome(tried)))
    for name, one in rows:
        share = one.value / tuning.today.value if tuning.today.value else 0.0
        table.add_row(
            name, f"{one.total:.3f}", f"{one.value * UM_PER_MM:.3g}", f"{100 * share:.1f} %"
        )
    return table


def _settings(tuning: Tuning) -> ScreenTable:
    """Old and new numbers."""
    table = ScreenTable(
        ("setting", "left"), ("unit", "left"), ("today", "right"), ("new", "right"),
        ("facts", "left"), wrap=("facts",), drop=("unit", "facts"),
    )  # fmt: skip
    for change in changes(tuning):
        mark = change.setting.mark
        table.add_row(
            change.setting.key, change.unit, change.old or "-", change.new, f"{mark}: {MARKS[mark]}"
        )
    return table


def _curve(tuning: Tuning) -> ScreenTable:
    """What less and more time would buy."""
    table = ScreenTable(
        ("time\n[s]", "right"), ("of today's", "right"), ("residual\n[um]", "right"),
        ("settings", "left"), wrap=("settings",),
    )  # fmt: skip
    settings = tuning.scheme.settings
    for point in tuning.curve:
        numbers = " ".join(s.text(x) for s, x in zip(settings, point.written, strict=True))
        share = f"{100.0 * point.total / tuning.today.total:.0f} %"
        table.add_row(f"{point.total:.3f}", share, f"{point.value * UM_PER_MM:.3g}", numbers)
    return table


def tuning_notes(tuning: Tuning) -> list[str]:
    """What the tables mean, and what the user has to know."""
    band = 100.0 * tuning.machine.design.band
    out = [
        f"residual: {GOAL_TEXT[tuning.goal]}, with every frequency anywhere within {band:g} % "
        f"of the machine file; {len(tuning.moves)} distinct rapids"
    ]
    if not tuning.fits:
        out.append("no setting of this control takes so little time: give it more (--time 1.1)")
    elif not tuning.gains:
        out.append("no setting of this control leaves less in no more time: leave it as it is")
    out += [f"this control cannot express {text}" for text in tuning.scheme.cannot]
    out += list(tuning.scheme.notes)
    if not tuning.proven:
        out.append(
            "the best of what was searched; that no other setting is better is proven for the "
            "worst rapid of a control whose settings are chosen together"
        )
    return out
