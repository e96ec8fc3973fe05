"""From the text of a machine file to a Description.

Rule: here stands only what involves several keys: defaults that depend on other keys, and what does
not fit together. What a single key may hold is the table's.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from gcodejerk.axes import AXES
from gcodejerk.errors import MachineError
from gcodejerk.machine.file.checker import Checker, KeyPath, dotted
from gcodejerk.machine.file.document import Document
from gcodejerk.machine.file.drives import check_servos, servo_of, structure_of
from gcodejerk.machine.file.planner import choose_planners, own_law, planner_warnings
from gcodejerk.machine.file.plausibility import COARSEST_RESOLUTION, plausibility_warnings
from gcodejerk.machine.file.table import DIALECT_OF_CONTROLLER
from gcodejerk.machine.parts import (
    FREE,
    Axis,
    ControllerOptions,
    ControllerParameter,
    Description,
    Design,
    Filter,
    Limits,
    Mode,
    PathLimits,
    ProgramStart,
    Spectrum,
)
from gcodejerk.machine.problems import Problems, place_order
from gcodejerk.machine.spectrum import load_spectrum
from gcodejerk.machine.subprograms import Subprograms, load_subprograms
from gcodejerk.start import CycleSettings

JERK_OVER_RAPID = 10.0
"""`limit.jerk` where only `rapid.jerk` is given, as a multiple of that (contract, section 2)."""


def load_text(text: str, name: str) -> Description:
    """What a text says of a machine.

    Parameters
    ----------
    text : str
        YAML.
    name : str
        What messages call the file; the names of spectrum files begin in its folder.

    Returns
    -------
    Description
        The machine, every default filled in.

    Raises
    ------
    MachineFileError
        Everything that is wrong with the text.
    """
    problems = Problems()
    checker = Checker(Document(text, name), problems)
    values = checker.read()
    _check_axis_types(values, checker)
    _check_resolutions(values, checker)
    _check_rotary_participations(values, checker)
    spectra = _spectra(values, Path(name).parent, checker)
    _check_frequencies(values, checker)
    _check_participations(values, checker)
    _check_m_codes(values, checker)
    _check_path(values, checker)
    check_servos(values, checker)
    folder = Path(name).parent
    structure = structure_of(values.get("structure", {}), values.get("axes", {}), folder, checker)
    planners = choose_planners(values, checker)
    subprograms = _subprograms(values, folder, checker)
    problems.raise_any()
    described = _machine(values, spectra, planners, name, checker)
    return replace(described, structure=structure, subprograms=subprograms)


def _check_axis_types(values: dict[str, Any], checker: Checker) -> None:
    for name, axis in values.get("axes", {}).items():
        if axis.get("type") == "rotary" and name not in "ABC":
            checker.problems.add(
                checker.place(("axes", name, "type")),
                f"axes.{name}.type is 'rotary', expected linear: {name} is measured in mm",
                "call a rotary axis A, B or C",
            )
        if "wrap" in axis and name not in checker.rotary:
            checker.problems.add(
                checker.place(("axes", name, "wrap")),
                f"axes.{name}.wrap is {axis['wrap']!r}, but {name} is a linear axis, which does "
                "not turn",
                "leave wrap out",
            )
        if axis.get("diameter") and name != "X":
            checker.problems.add(
                checker.place(("axes", name, "diameter")),
                f"axes.{name}.diameter is true, expected false: only X is given as a diameter",
                "leave diameter out",
            )


def _check_resolutions(values: dict[str, Any], checker: Checker) -> None:
    """Refuse steps so coarse that no rapid could be written in them."""
    for name, axis in values.get("axes", {}).items():
        resolution = axis.get("resolution")
        if isinstance(resolution, float) and resolution > COARSEST_RESOLUTION:
            unit = "deg" if axis.get("type") == "rotary" or name in "ABC" else "mm"
            checker.problems.add(
                checker.place(("axes", name, "resolution")),
                f"axes.{name}.resolution is {resolution:g}, expected at most "
                f"{COARSEST_RESOLUTION:g} [{unit}]",
                "give the control's least increment, for example 0.001; a steps-per-mm figure is "
                "its inverse",
            )


def _check_frequencies(values: dict[str, Any], checker: Checker) -> None:
    """Refuse a mode that the interval is too long for: samples cannot tell it from a slower one."""
    if "interval" not in values:
        return
    highest = 0.5 / values["interval"]
    for path, mode in _modes(values):
        if mode.get("frequency", 0.0) >= highest:
            checker.problems.add(
                checker.place((*path, "frequency")),
                f"{dotted((*path, 'frequency'))} is {mode['frequency']:g}, expected a number "
                f"below {highest:g} [Hz], half the sampling rate 1/interval",
                "leave the mode out, or set a shorter interval if the controller has one",
            )


def _modes(values: dict[str, Any]) -> list[tuple[KeyPath, dict[str, Any]]]:
    """Every mode of the file with its path."""
    found: list[tuple[KeyPath, dict[str, Any]]] = []
    for name, axis in values.get("axes", {}).items():
        found += [(("axes", name, "modes", i), mode) for i, mode in axis.get("modes", {}).items()]
    return found + [(("modes", i), mode) for i, mode in values.get("modes", {}).items()]


def _check_path(values: dict[str, Any], checker: Checker) -> None:
    """Refuse limits of the path where there is none: axes that run on their own, or only turn."""
    if not checker.given(("path",)):
        return
    if values.get("positioning") == "independent":
        checker.problems.add(
            checker.place(("path",)),
            "path is given beside positioning: independent, where every axis runs on its own",
            "leave path out, or write positioning: linear if the control bounds the path of G0",
        )
    elif values.get("axes") and not set(values["axes"]) - checker.rotary:
        checker.problems.add(
            checker.place(("path",)),
            "path bounds linear axes, and the machine has none",
            "leave path out",
        )


def _check_m_codes(values: dict[str, Any], checker: Checker) -> None:
    """Refuse an M code that runs before the motion of its block, and behind it."""
    program = values.get("program", {})
    before = _codes(program, "m_before")
    for i, name in program.get("m_after", {}).items():
        if _code(name) in before:
            checker.problems.add(
                checker.place(("program", "m_after", i)),
                f"program.m_after holds {name}, which program.m_before holds, too",
                "name it once: the control runs it before the motion of its block, or behind it",
            )


def _check_participations(values: dict[str, Any], checker: Checker) -> None:
    """Refuse structure modes that an axis excites which is not there."""
    # program.start and program.offsets may name any axis: the program may move one that the file
    # does not describe, and where it stands is still worth knowing.
    if "axes" not in values:
        return
    has = [axis for axis in AXES if axis in checker.axes]
    for i, mode in values.get("modes", {}).items():
        path: KeyPath = ("modes", i, "participation")
        for axis in mode.get("participation", ()):
            if axis not in has:
                checker.problems.add(
                    checker.key_place((*path, axis)),
                    f"{dotted((*path, axis))} is about axis {axis}, which the machine does not "
                    f"have; it has {', '.join(has)}",
                    f"leave it out, or describe axes.{axis}",
                )


def _check_rotary_participations(values: dict[str, Any], checker: Checker) -> None:
    """Refuse a rotary axis that does not say how far its modes move the tool for a degree."""
    for name in sorted(checker.rotary.intersection(values.get("axes", {}))):
        axis = values["axes"][name]
        path: KeyPath = ("axes", name)
        silent = [
            (*path, "modes", i)
            for i, mode in axis.get("modes", {}).items()
            if i != "spectrum" and "participation" not in mode
        ]
        spectra = (axis.get("spectrum"), axis.get("modes", {}).get("spectrum"))
        for key, spectrum in zip((("spectrum",), ("modes", "spectrum")), spectra, strict=True):
            if spectrum and (isinstance(spectrum, str) or "participation" not in spectrum):
                silent.append((*path, *key))
        for where in silent:
            checker.problems.add(
                checker.place(where),
                f"{dotted(where)} has no participation, but {name} is a rotary axis: 1 would be "
                "1 mm at the tool for each degree",
                "state mm per degree: the tool's distance from the axis [mm] * pi/180 for a mode "
                "that swings with it, e.g. participation: 1.75 at 100 mm",
            )


def _spectra(values: dict[str, Any], folder: Path, checker: Checker) -> dict[str, Spectrum]:
    """Read the spectra; from here on `modes` of an axis is a list, however they were given."""
    highest = 0.5 / values["interval"] if "interval" in values else math.inf
    spectra = {}
    for name, axis in values.get("axes", {}).items():
        path: KeyPath = ("axes", name, "spectrum")
        modes, given = axis.get("modes", {}), axis.get("spectrum", {})
        if given and modes:
            checker.problems.add(
                checker.place(path),
                f"{dotted(path)} is given beside axes.{name}.modes, expected only one of them",
                "keep the spectrum, which was measured, or the modes, which know the damping",
            )
        if "spectrum" in modes:
            path, given, axis["modes"] = ("axes", name, "modes", "spectrum"), modes["spectrum"], {}
        file = given if isinstance(given, str) else given.get("file")
        if file is None:
            continue
        participation = 1.0 if isinstance(given, str) else given.get("participation", 1.0)
        try:
            spectra[name] = load_spectrum(file, folder, highest, participation)
        except MachineError as error:
            what = f"is no spectrum: {error.place}: " if error.place else ""
            checker.problems.add(
                checker.place(path if isinstance(given, str) else (*path, "file")),
                f"{dotted(path)} is {file!r}, which {what}{error.problem}",
                error.remedy,
            )
    return spectra


def _subprograms(values: dict[str, Any], folder: Path, checker: Checker) -> Subprograms | None:
    """Read the folder of subprograms."""
    given = values.get("program", {}).get("subprograms")
    if given is None:
        return None
    try:
        return load_subprograms(given, folder)
    except MachineError as error:
        path: KeyPath = ("program", "subprograms")
        checker.problems.add(checker.place(path), f"{dotted(path)}: {error.problem}", error.remedy)
    return None


def _machine(
    values: dict[str, Any],
    spectra: dict[str, Spectrum],
    planners: dict[str, str],
    name: str,
    checker: Checker,
) -> Description:
    controller = values["controller"]
    axes = values["axes"]
    path = _path(values.get("path", {}))
    return Description(
        name=values.get("name", Path(name).stem),
        controller=controller,
        dialect=values.get("dialect", DIALECT_OF_CONTROLLER.get(controller, "auto")),
        interval=values["interval"],
        positioning=values["positioning"],
        spindle=values.get("spindle"),
        path=path,
        axes=tuple(
            _on_path(_axis(a, axes[a], a in checker.rotary, spectra.get(a), planners[a]), path)
            for a in AXES
            if a in axes
        ),
        modes=tuple(
            _mode(mode, mode["participation"]) for mode in values.get("modes", {}).values()
        ),
        design=Design(**values["design"]),
        program=_program(values["program"]),
        controller_options=_controller_options(values.get("controller_options", {})),
        controller_parameters=tuple(
            ControllerParameter(**one) for one in values.get("controller_parameters", {}).values()
        ),
        inch=checker.inch,
        source=name,
        warnings=tuple(
            sorted(
                [
                    *planner_warnings(values, planners, checker),
                    *plausibility_warnings(values, checker),
                ],
                key=place_order,
            )
        ),
        named_at={
            ".".join(path): checker.place(path)
            for path in (("controller",), ("dialect",), ("program", "startup"))
            if checker.given(path)
        },
    )


def _path(values: dict[str, Any]) -> PathLimits:
    if "rapid" not in values:
        return FREE
    own, more = values["rapid"], values.get("limit", {})
    velocity, acceleration = own.get("velocity", math.inf), own.get("acceleration", math.inf)
    return PathLimits(
        Limits(velocity, acceleration, math.inf),
        Limits(more.get("velocity", velocity), more.get("acceleration", acceleration), math.inf),
    )


def _on_path(axis: Axis, path: PathLimits) -> Axis:
    """An axis alone is a path: what it may do beyond that it never does."""
    if axis.rotary or path == FREE:
        return axis
    return replace(
        axis,
        rapid=_narrowed(axis.rapid, path.rapid),
        limit=_narrowed(axis.limit, path.limit),
    )


def _narrowed(own: Limits, most: Limits) -> Limits:
    return Limits(
        min(own.velocity, most.velocity), min(own.acceleration, most.acceleration), own.jerk
    )


def _axis(
    name: str, values: dict[str, Any], rotary: bool, spectrum: Spectrum | None, planner: str
) -> Axis:
    return Axis(
        name=name,
        rotary=rotary,
        wrap=values.get("wrap", None if rotary else "none"),
        diameter=values["diameter"],
        resolution=values["resolution"],
        rapid=(rapid := _rapid(values["rapid"])),
        limit=_limit(values.get("limit", {}), rapid),
        travel=values.get("travel"),
        modes=tuple(
            _mode(mode, {name: mode.get("participation", 1.0)})
            for mode in values.get("modes", {}).values()
        ),
        spectrum=spectrum,
        planner=planner,
        law=own_law(values["rapid"], planner),
        filter=_filter(values["rapid"].get("filter")),
        servo=servo_of(values.get("servo", {})),
    )


def _rapid(values: dict[str, float]) -> Limits:
    return Limits(values["velocity"], values["acceleration"], values.get("jerk", math.inf))


def _filter(values: dict[str, Any] | None) -> Filter | None:
    if not values:
        return None
    numbers = {name: values.get(name, 0.0) for name in ("time", "frequency", "damping")}
    return Filter(values["type"], **numbers)


def _limit(values: dict[str, float], rapid: Limits) -> Limits:
    return Limits(
        values.get("velocity", rapid.velocity),
        values.get("acceleration", rapid.acceleration),
        values.get("jerk", JERK_OVER_RAPID * rapid.jerk),
    )


def _mode(values: dict[str, Any], participation: dict[str, float]) -> Mode:
    return Mode(
        name=values.get("name", f"{values['frequency']:g} Hz"),
        frequency=values["frequency"],
        damping=values["damping"],
        participation=tuple((a, participation[a]) for a in AXES if a in participation),
    )


def _controller_options(values: dict[str, Any]) -> ControllerOptions:
    planner = values.get("planner_type")
    return ControllerOptions(
        version=values.get("version"),
        planner_type=None if planner is None else int(planner),
        servo_period=values.get("servo_period"),
        optimization_depth=int(values["optimization_depth"]),
        max_acceleration=values.get("max_acceleration", {}),
        override_guard=values["override_guard"],
        counts_per_unit=values.get("counts_per_unit", {}),
        axis_names=values.get("axis_names", {}),
        isx90=values.get("isx90"),
        fanuc_distance=values.get("fanuc_distance"),
        confirmed=tuple(sorted(set(values.get("confirmed", {}).values()))),
    )


def _code(name: str) -> str:
    """A code as readers of programs spell it: ``M150``, ``G187``, ``G10.9``."""
    return f"{name[0].upper()}{float(name[1:]):g}"


def _codes(values: dict[str, Any], key: str) -> tuple[str, ...]:
    """The codes of a list, each once."""
    return tuple(sorted({_code(name) for name in values.get(key, {}).values()}))


def _program(values: dict[str, Any]) -> ProgramStart:
    offsets = values.get("offsets", {})
    return ProgramStart(
        start=values.get("start", {}),
        offsets={key: value for key, value in offsets.items() if isinstance(value, dict)},
        tool_lengths={
            int(key[1:]): value for key, value in offsets.items() if not isinstance(value, dict)
        },
        startup=values["startup"],
        decimal_point=values.get("decimal_point"),
        resume_after_stop=values.get("resume_after_stop"),
        harmless=_codes(values, "harmless"),
        home=values.get("home", {}),
        tool_change=values.get("tool_change"),
        m_before=_codes(values, "m_before"),
        m_after=_codes(values, "m_after"),
        cycles=CycleSettings(**values.get("cycles", {})),
        unrolled_lines=None
        if values.get("unrolled_lines") is None
        else int(values["unrolled_lines"]),
    )
