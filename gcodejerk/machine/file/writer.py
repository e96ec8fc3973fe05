"""A Machine as the text of a machine file.

Rule: what is written reads back as an equal Machine. Everything is spelled out, defaults too, in
mm; so the text, with the lines of spectra in place of their files, is also the canonical form whose
hash names a machine's settings.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace

from gcodejerk.machine.file.drives import digest
from gcodejerk.machine.file.drives_text import servo_text, structure_text
from gcodejerk.machine.file.scalar_text import braces, number_text, quoted
from gcodejerk.machine.file.table import SCHEMA_VERSION
from gcodejerk.machine.parts import (
    AVERAGES,
    FREE,
    Axis,
    ControllerOptions,
    ControllerParameter,
    Description,
    Filter,
    Limits,
    Mode,
    PathLimits,
    ProgramStart,
    Spectrum,
)
from gcodejerk.start import CycleSettings


def machine_yaml(machine: Description) -> str:
    """Text that `Machine.loads` reads as the same machine.

    Parameters
    ----------
    machine : Description
        As loaded; one made by hand must be one that a file could describe.

    Returns
    -------
    str
        YAML, in mm whatever the unit of the file was. Spectra stay files of their own: the text
        belongs into the folder in which their names begin.
    """
    design, program = machine.design, machine.program
    offsets = {name: _flow(values) for name, values in program.offsets.items()}
    lengths = {f"H{number}": number_text(value) for number, value in program.tool_lengths.items()}
    return "\n".join(
        [
            f"schema: {SCHEMA_VERSION}",
            f"name: {quoted(machine.name)}",
            f"controller: {quoted(machine.controller)}",
            f"dialect: {quoted(machine.dialect)}",
            "units: mm",
            f"interval: {number_text(machine.interval)}",
            f"positioning: {machine.positioning}",
            *([f"spindle: {machine.spindle}"] if machine.spindle is not None else []),
            *_path(machine.path),
            "axes:",
            *(line for axis in machine.axes for line in _axis(axis)),
            *_modes(machine.modes, ""),
            *structure_text(machine.structure),
            "design:",
            f"  profile: {design.profile}",
            f"  band: {number_text(design.band)}",
            f"  guard: {number_text(design.guard)}",
            f"  tolerance: {number_text(design.tolerance)}",
            f"  minimum_length: {number_text(design.minimum_length)}",
            f"  max_extension: {number_text(design.max_extension)}",
            *_controller_options(machine.controller_options),
            *_controller_parameters(machine.controller_parameters),
            "program:",
            f"  start: {_flow(program.start)}",
            f"  offsets: {braces(offsets | lengths)}",
            f"  startup: {quoted(program.startup)}",
            *(
                [f"  decimal_point: {program.decimal_point}"]
                if program.decimal_point is not None
                else []
            ),
            *(
                [f"  resume_after_stop: {program.resume_after_stop}"]
                if program.resume_after_stop is not None
                else []
            ),
            *_lists(program),
            *([f"  home: {_flow(program.home)}"] if program.home else []),
            *(
                [f"  tool_change: {_flow(program.tool_change)}"]
                if program.tool_change is not None
                else []
            ),
            *_cycles(program.cycles),
            *(
                [f"  unrolled_lines: {program.unrolled_lines}"]
                if program.unrolled_lines is not None
                else []
            ),
            *(
                [f"  subprograms: {quoted(machine.subprograms.folder)}"]
                if machine.subprograms is not None
                else []
            ),
            "",
        ]
    )


def _path(path: PathLimits) -> list[str]:
    """Limits of the path, where there are any."""
    if path == FREE:
        return []
    return [
        "path:",
        f"  rapid: {_along(path.rapid)}",
        *([f"  limit: {_along(path.limit)}"] if path.limit != path.rapid else []),
    ]


def _along(limits: Limits) -> str:
    values = {"velocity": limits.velocity, "acceleration": limits.acceleration}
    return _flow({key: value for key, value in values.items() if math.isfinite(value)})


def _cycles(cycles: CycleSettings) -> list[str]:
    """Settings of drilling cycles, where there are any."""
    values = {name: getattr(cycles, name) for name in CycleSettings.__dataclass_fields__}
    texts = {
        name: value if isinstance(value, str) else number_text(value)
        for name, value in values.items()
        if value is not None
    }
    return [f"  cycles: {braces(texts)}"] if texts else []


def _lists(program: ProgramStart) -> list[str]:
    """Lists of codes, where there are any."""
    lists = {name: getattr(program, name) for name in ("harmless", "m_before", "m_after")}
    return [f"  {name}: [{', '.join(codes)}]" for name, codes in lists.items() if codes]


def _controller_options(options: ControllerOptions) -> list[str]:
    """What is not as usual."""
    usual = ControllerOptions()
    texts = {
        "version": str(options.version),
        "planner_type": str(options.planner_type),
        "servo_period": "" if options.servo_period is None else number_text(options.servo_period),
        "optimization_depth": str(options.optimization_depth),
        "max_acceleration": _flow(options.max_acceleration),
        "override_guard": str(options.override_guard).lower(),
        "counts_per_unit": _flow(options.counts_per_unit),
        "axis_names": braces({axis: quoted(name) for axis, name in options.axis_names.items()}),
        "isx90": "" if options.isx90 is None else number_text(options.isx90),
        "fanuc_distance": str(options.fanuc_distance),
        "confirmed": f"[{', '.join(options.confirmed)}]",
    }
    said = [name for name in texts if getattr(options, name) != getattr(usual, name)]
    lines = [f"  {name}: {texts[name]}" for name in said]
    return ["controller_options:", *lines] if lines else []


def _controller_parameters(confirmed: tuple[ControllerParameter, ...]) -> list[str]:
    """Settings of the control, one line each."""
    lines = ["controller_parameters:"] if confirmed else []
    for one in confirmed:
        texts = {
            "number": quoted(one.number),
            "axis": one.axis,
            "unit": None if one.unit is None else quoted(one.unit),
            "meaning": quoted(one.meaning) if one.meaning else None,
            "old": None if one.old is None else quoted(one.old),
        }
        inner = ", ".join(f"{key}: {text}" for key, text in texts.items() if text is not None)
        lines.append(f"  - {{{inner}}}")
    return lines


def settings_text(machine: Description) -> str:
    """Text that is the same for equal machines only, wherever their spectra are kept.

    Parameters
    ----------
    machine : Description
        As for `machine_yaml`.

    Returns
    -------
    str
        What `machine_yaml` writes, with what is in a spectrum file or in a folder of subprograms in
        place of its name.
    """
    structure = None if machine.structure is None else digest(machine.structure)
    axes = tuple(_with_lines(axis) for axis in machine.axes)
    files = machine.subprograms
    files = None if files is None else replace(files, folder=files.digest)
    return machine_yaml(replace(machine, axes=axes, structure=structure, subprograms=files))


def _with_lines(axis: Axis) -> Axis:
    if axis.spectrum is None:
        return axis
    lines = (axis.spectrum.peak, axis.spectrum.frequency, axis.spectrum.weight)
    return replace(axis, spectrum=replace(axis.spectrum, source=repr(lines)))


def _axis(axis: Axis) -> list[str]:
    lines = [
        f"  {axis.name}:",
        f"    type: {'rotary' if axis.rotary else 'linear'}",
        f"    diameter: {'true' if axis.diameter else 'false'}",
        f"    resolution: {number_text(axis.resolution)}",
        f"    rapid: {_rapid(axis)}",
        f"    limit: {_limits(axis.limit)}",
    ]
    if axis.rotary and axis.wrap is not None:
        lines.append(f"    wrap: {axis.wrap}")
    if axis.travel is not None:
        lines.append(f"    travel: [{', '.join(map(number_text, axis.travel))}]")
    if axis.spectrum is not None:
        return [*lines, f"    spectrum: {_spectrum(axis.spectrum)}", *servo_text(axis.servo)]
    return lines + _modes(axis.modes, "    ", axis.name) + servo_text(axis.servo)


def _spectrum(spectrum: Spectrum) -> str:
    values = {
        # Always in quotes: a file may be called 1e3.
        "file": json.dumps(spectrum.source, ensure_ascii=False),
        "participation": number_text(spectrum.participation),
    }
    return braces(values)


def _modes(modes: tuple[Mode, ...], indent: str, axis: str | None = None) -> list[str]:
    """Lines of the key `modes`; an axis's own modes give a number as participation."""
    if not modes:
        return [f"{indent}modes: []"]
    lines = [f"{indent}modes:"]
    for mode in modes:
        values = {
            "name": quoted(mode.name),
            "frequency": number_text(mode.frequency),
            "damping": number_text(mode.damping),
            "participation": number_text(mode.participation_of(axis))
            if axis
            else _flow(dict(mode.participation)),
        }
        lines.append(f"{indent}  - {braces(values)}")
    return lines


def _rapid(axis: Axis) -> str:
    """What the control's own rapids are set to; what its planner does not need is not there."""
    own = {name: number_text(value) for name, value in axis.law}
    behind = {} if axis.filter is None else {"filter": _filter(axis.filter)}
    return _limits(axis.rapid, {"planner": axis.planner} | own | behind)


def _filter(behind: Filter) -> str:
    if behind.kind in AVERAGES:
        return braces({"type": behind.kind, "time": number_text(behind.time)})
    shaped = {"frequency": behind.frequency, "damping": behind.damping}
    return braces({"type": behind.kind} | {k: number_text(x) for k, x in shaped.items()})


def _limits(limits: Limits, more: Mapping[str, str] | None = None) -> str:
    """Limits in braces; an infinite jerk is written by leaving it out."""
    values = {"velocity": limits.velocity, "acceleration": limits.acceleration}
    if math.isfinite(limits.jerk):
        values["jerk"] = limits.jerk
    return braces({key: number_text(value) for key, value in values.items()} | dict(more or {}))


def _flow(values: Mapping[str, float]) -> str:
    return braces({key: number_text(value) for key, value in values.items()})
