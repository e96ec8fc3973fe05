"""The page as a file: a template, and what takes the places in it.

This module owns the assembly. Style and scripts stand in files beside it; the policy of the page
names each of them by its sum, so that nothing else can run in it, and forbids every request.

Rule: one pass over the template, so that nothing that was put in is looked at again.
"""

from __future__ import annotations

import base64
import hashlib
import re
from importlib.resources import files
from typing import Any, BinaryIO

import numpy as np

from gcodejerk._version import __version__
from gcodejerk.errors import ProgramError
from gcodejerk.machine import Machine
from gcodejerk.nc.feed_moves import feed_moves
from gcodejerk.report.page import SUFFIX, headline
from gcodejerk.report.page.columns import (
    MOST_RAPIDS,
    Figures,
    chosen_rapids,
    mode_columns,
    packed,
    rapid_columns,
    reason_names,
)
from gcodejerk.report.page.text import escaped, script_data, visible
from gcodejerk.report.records import rotary_axes, summary_of
from gcodejerk.rewrite.result import Result

MARK = "<!doctype html>\n<!-- gcodejerk report"
"""How every page begins: by this a page of ours is known, and may be replaced."""
SCRIPTS = ("vibration.js", "views.js", "table.js", "page.js")
MOST_LINES = 100_000
"""Programs of more lines are drawn without their feed moves."""
MOST_POINTS = 40_000
"""Of the feed moves."""
_PLACE = re.compile(r"\{\{(\w+)\}\}")


def is_page(name: str) -> bool:
    """Whether a report of this name is a page.

    Examples
    --------
    >>> is_page("part.HTML"), is_page("part.json")
    (True, False)
    """
    return name.lower().endswith(SUFFIX)


def write_page(
    file: BinaryIO,
    result: Result,
    machine: Machine,
    output: str | None,
    source: BinaryIO,
    written: int,
) -> None:
    """Write the report on one processed program as a page.

    Parameters
    ----------
    file : binary file
        Where it goes.
    result : Result
        Of `process_file`.
    machine : Machine
        What it was processed for.
    output : str or None
        Name of the file that was written.
    source : binary file
        The program.
    written : int
        Size of the output, with what belongs beside it. [bytes]
    """
    file.write(page_html(result, machine, output, source, written).encode("utf-8"))


def page_html(
    result: Result, machine: Machine, output: str | None, source: BinaryIO, written: int
) -> str:
    """The text of a page; as `write_page`."""
    summary = summary_of(result)
    unit = headline.Unit.of(summary)
    figures = Figures.of(result)
    rows = chosen_rapids(figures, MOST_RAPIDS)
    feed, cut = _feed(result, machine, source)
    data = {
        "unit": {
            "length": unit.length,
            "perMm": unit.per_mm,
            "small": unit.small,
            "smallPerMm": unit.small_per_mm,
        },
        "tolerance": machine.design.tolerance,
        "profile": result.plans.designed,
        "positioning": machine.positioning,
        "rotary": rotary_axes(machine),
        "reasons": reason_names(),
        "modes": mode_columns(result),
        "rapids": rapid_columns(result, source, figures, rows),
        "feed": packed(feed, "f4"),
    }
    style = _text("uPlot.min.css") + _text("page.css")
    library = _text("uPlot.iife.min.js")
    script = "(() => {\n'use strict';\n" + "".join(map(_text, SCRIPTS)) + "})();\n"
    set_anew = result.settings is not None and bool(result.settings.changed)
    sizes = (result.program.size, written)
    places = {
        "version": escaped(__version__),
        "policy": _policy(style, (library, script)),
        "style": style,
        "library": library,
        "licence": escaped(_text("uPlot.LICENSE")),
        "script": script,
        "data": script_data(data),
        "name": escaped(result.program.name),
        "title": escaped(_base_name(result.program.name)),
        "output": escaped(output or "not written"),
        "machine": escaped(machine.name),
        "machine_file": escaped(machine.source),
        "controller": escaped(result.controller),
        "form": escaped(result.form),
        "profile": escaped(result.profile),
        "dialect": escaped(result.program.dialect),
        "proof": _proof(result),
        "sentence": escaped(headline.sentence(summary, unit)),
        "figures": _figures(headline.three_figures(summary, unit, sizes, set_anew)),
        "reasons": headline.reasons_html(result),
        "left": headline.number_of(summary["left"], "rapid"),
        "state": " ".join(_states(result, summary)),
        "notes": headline.notes_html(result.notes),
        "bounds": " ".join(_bounds(result, len(rows), cut)),
    }
    return _PLACE.sub(lambda place: places[place[1]], _text("page.html"))


def _feed(result: Result, machine: Machine, source: BinaryIO) -> tuple[Any, bool]:
    """Feed moves as X, Y, Z one behind the other, NaN between lines; whether some are missing."""
    program = result.program
    if program.lines > MOST_LINES:
        return np.zeros(0), True
    source.seek(0)
    gap = (np.nan, np.nan, np.nan)
    points: list[tuple[float, ...]] = []
    cut = False
    try:
        for begin, line in feed_moves(
            source, dialect=program.dialect, start=machine.program_start()
        ):
            if len(points) + len(line) > MOST_POINTS:
                cut = True
                break
            if not points or points[-1] != begin:
                points += [gap, begin]
            points += line
    except ProgramError:  # what could be read once can be drawn or not
        return np.zeros(0), True
    return np.array(points, dtype=np.float64).ravel(), cut


def _bounds(result: Result, shown: int, cut: bool) -> list[str]:
    """What is not on the page, as paragraphs."""
    out = []
    if shown < len(result.plans):
        every = headline.number_of(len(result.plans), "rapid")
        out.append(
            f"<p>This page shows the {headline.number_of(shown, 'rapid')} that leave the most, of "
            f"{every}; <code>--report FILE.json</code> has them all.</p>"
        )
    if cut:
        out.append("<p>The program is long: not all of its feed moves are drawn.</p>")
    return out


def _states(result: Result, summary: dict[str, Any]) -> list[str]:
    """Classes by which the style leaves out what a page has nothing for."""
    out = []
    if not summary["rapids"]:
        out.append("no-rapids")
    if not summary["left"]:
        out.append("none-left")
    if not result.notes:
        out.append("no-notes")
    return out


def _figures(three: list[tuple[str, str, str, str]]) -> str:
    """The three figures as HTML."""
    out = []
    for name, before, after, says in three:
        change = f'<span class="now">{escaped(before)}</span>'
        if after:
            change = (
                f'<span class="then">{escaped(before)}<span class="visually-hidden"> before, '
                '</span><span aria-hidden="true"> →</span></span> '
                f'<span class="now">{escaped(after)}<span class="visually-hidden"> after</span>'
                "</span>"
            )
        out.append(
            f'<div class="figure"><dt>{escaped(name)}</dt><dd><p class="change">{change}</p>'
            f"<p>{escaped(says)}</p></dd></div>"
        )
    return "\n".join(out)


def _proof(result: Result) -> str:
    """What is known of the output's correctness."""
    found = result.verification
    if found is None:
        return "The output was not read back (<code>--no-verify</code>)."
    if not found.rewritten:
        return "The output was read back and verified."
    text = (
        f"The output was read back and verified: {headline.grouped(found.confirmed)} "
        f"of {headline.number_of(found.rewritten, 'rewritten rapid')} confirmed by a second "
        "reading of the program"
    )
    rest = found.rewritten - found.confirmed
    return f"{text}; {headline.grouped(rest)} rest on one reading alone." if rest else f"{text}."


def _policy(style: str, scripts: tuple[str, ...]) -> str:
    """What the page may do: run its own scripts, use its own style, and ask nobody for anything."""
    sums = " ".join(_sum(script) for script in scripts)
    return (
        f"default-src 'none'; script-src {sums}; style-src {_sum(style)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _sum(text: str) -> str:
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def _text(name: str) -> str:
    """A file of this folder."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _base_name(path: str) -> str:
    """The name without its folders, of whichever system."""
    return re.split(r"[/\\]", visible(path))[-1] or path
