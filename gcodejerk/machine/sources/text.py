"""A draft as a machine file: every number with its unit and origin behind it.

Rule: the text is for people to go on with. What it writes, `Machine.loads` reads; whoever calls
this lets it be read before anybody gets it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable

from gcodejerk.machine.file.scalar_text import number_text, quoted
from gcodejerk.machine.sources.draft import Draft, DraftAxis, Fact

COLUMN = 36
"""Where comments begin."""
MOST = 1000
"""Characters of a comment or note."""
_STEPS = ("velocity", "acceleration", "jerk")


def text_of(draft: Draft) -> str:
    """The text of a machine file.

    Parameters
    ----------
    draft : Draft
        Settled.

    Returns
    -------
    str
        Commented YAML.
    """
    sources = ", ".join(draft.sources)
    head = f"made by `gcodejerk machine new` from {sources}" if sources else "made by questions"
    name = _shown(draft.name)[:200].strip() or "My machine"
    lines = [
        f"# {name}: {head}{f' ({draft.kind})' if draft.kind else ''}.",
        "# Every number says where it comes from. ASSUMED: nobody said so; look at these first.",
    ]
    for note in draft.notes:
        lines += _wrapped(note)
    lines += [
        "schema: 1",
        f"name: {quoted(name)}",
        _line(f"controller: {draft.controller}", "what is written by default"),
    ]
    if draft.dialect is not None:
        lines.append(_line(f"dialect: {draft.dialect}", "how programs are read"))
    lines.append("units: mm")
    if draft.interval is not None:
        lines.append(
            _line(f"interval: {_digits(draft.interval.value)}", f"s; {draft.interval.comment}")
        )
    if draft.positioning is not None:
        lines.append(_line(f"positioning: {draft.positioning[0]}", draft.positioning[1]))
    if draft.spindle is not None:
        lines.append(_line(f"spindle: {draft.spindle[0]}", draft.spindle[1]))
    lines += _path(draft)
    lines += ["", "axes:"]
    for axis in draft.ordered():
        lines += _axis(axis, draft)
    if not draft.known:
        lines += [
            "",
            "# Nobody has said how this machine vibrates, so every rapid is left alone until",
            "# somebody does. Record it: `gcodejerk machine test-program --machine THIS_FILE`",
            "# writes a program of rapids and dwells; a sensor at the tool shows what rings",
            "# behind each of them. Then write, under its axis:",
            "#     modes:",
            "#       - {name: column, frequency: 30, damping: 0.03, participation: 1.0}",
        ]
    lines += _rest(draft)
    return "\n".join(lines) + "\n"


def _path(draft: Draft) -> Iterable[str]:
    """What bounds all linear axes together."""
    if not draft.path or draft.positioning is None or draft.positioning[0] != "linear":
        return
    units = {"velocity": "mm/s", "acceleration": "mm/s^2"}
    yield ""
    yield _line("path:", "what the control bounds along the path, whichever axes move")
    for name, facts in (("rapid", draft.path), ("limit", draft.path_limit)):
        if facts:
            yield f"  {name}:"
        for key, fact in facts.items():
            yield _fact(f"    {key}", fact, units[key])


def _axis(axis: DraftAxis, draft: Draft) -> Iterable[str]:
    unit = "deg" if axis.rotary else "mm"
    units = {"velocity": f"{unit}/s", "acceleration": f"{unit}/s^2", "jerk": f"{unit}/s^3"}
    yield f"  {axis.name}:"
    if axis.diameter:
        yield _line("    diameter: true", "programs state diameters")
    if axis.resolution is not None:
        yield _fact("    resolution", axis.resolution, unit)
    yield _line("    rapid:", "what the control's own G0 does today")
    for key in _STEPS:
        fact = getattr(axis, key)
        if fact is not None:
            yield _fact(f"      {key}", fact, units[key])
    if draft.planner is not None:
        yield _line(f"      planner: {draft.planner[0]}", draft.planner[1])
    for key, fact in axis.law.items():
        yield _fact(f"      {key}", fact, "s" if key.endswith("average") else "")
    if axis.filter is not None:
        inner = ", ".join(
            f"{key}: {value if isinstance(value, str) else number_text(value)}"
            for key, value in axis.filter[0].items()
        )
        yield _line(f"      filter: {{{inner}}}", axis.filter[1])
    if axis.limit_acceleration is not None:
        yield _line("    limit:", "what a designed profile may use; what is not here, as rapid")
        yield _fact("      acceleration", axis.limit_acceleration, units["acceleration"])
    if axis.wrap is not None:
        yield f"    wrap: {axis.wrap}"
    if axis.travel is not None:
        low, high = (_digits(end) for end in axis.travel)
        yield _line(f"    travel: [{low}, {high}]", f"{unit}; {axis.travel_origin}")
    if axis.spectrum is not None:
        yield _line(f"    spectrum: {{file: {quoted(axis.spectrum)}}}", "as measured")
    if axis.modes:
        yield "    modes:"
    for name, frequency, damping, participation, origin in axis.modes:
        yield f"      - name: {quoted(name)}"
        yield _line(f"        frequency: {number_text(frequency)}", f"Hz; {origin}")
        yield f"        damping: {number_text(damping)}"
        yield f"        participation: {number_text(participation)}"


def _rest(draft: Draft) -> Iterable[str]:
    yield ""
    yield "design:"
    yield _line("  tolerance: 0.01", "mm; ASSUMED: what counts as settled; 0.001 for fine work")
    if draft.options:
        yield "controller_options:"
        for key, (text, origin) in draft.options.items():
            yield _line(f"  {key}: {text}", origin)
    if draft.startup is not None:
        yield "program:"
        yield _line(f"  startup: {quoted(draft.startup[0])}", draft.startup[1])


def _fact(key: str, fact: Fact, unit: str) -> str:
    return _line(f"{key}: {_digits(fact.value)}", "; ".join(filter(None, (unit, fact.comment))))


def _digits(value: float) -> str:
    """A number as people write it: at most nine digits, which no control has."""
    return number_text(float(f"{value:.9g}"))


def _line(text: str, comment: str) -> str:
    """A line with its comment, which may hold anything but line ends."""
    return f"{text:<{COLUMN}}  # {_shown(comment)}"


def _shown(text: str) -> str:
    """Text of somebody else's as one line."""
    return "".join(c if c.isprintable() else "?" for c in text).strip()[:MOST]


def _wrapped(note: str) -> list[str]:
    """A note as comment lines."""
    return textwrap.wrap(_shown(note), 100, initial_indent="# ! ", subsequent_indent="#   ")
