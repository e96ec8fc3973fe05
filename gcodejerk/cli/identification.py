"""The command `identify`: modes from a measurement."""

from __future__ import annotations

import math
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gcodejerk.cli.common import MachineOption, console, load_machine, refuse, said, say, waiting
from gcodejerk.cli.moves import FIGURES

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import RenderableType

    from gcodejerk.identification import Commanded, FrequencyResponse, Record, Search, Spectrum
    from gcodejerk.machine import Machine

BAND = (5.0, 150.0)
"""Where modes are looked for, as far as a record reaches. [Hz]"""
REACH = 0.4
"""Of the sampling rate: as far as a record reaches."""


def identify(
    ctx: typer.Context,
    records: Annotated[
        list[str],
        typer.Argument(metavar="RECORD...", help="accelerations over time, or spectra (CSV)"),
    ],
    axis: Annotated[str, typer.Option(metavar="AXIS", help="that moved")],
    channel: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="the column that feels the axis; for participations"),
    ] = None,
    machine: MachineOption = None,
    program: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="what ran, with --machine: which motions are the axis's, and participations",
        ),
    ] = None,
    time: Annotated[
        str | None, typer.Option(metavar="NAME", help="column of times, its name or number")
    ] = None,
    column: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="only this column; may be given again"),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="samples a second, without a column of times")
    ] = None,
    unit: Annotated[
        str | None, typer.Option(metavar="U", help="g, m/s^2 or mm/s^2, in place of the file's")
    ] = None,
    band: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LOW HIGH", help="where to look for modes [Hz], 5 150 by default"),
    ] = None,
    as_json: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE", help="write all figures; - is standard output"),
    ] = None,
    plot: Annotated[
        str | None, typer.Option("--plot", metavar="FILE", help="draw (.png, .svg, .pdf)")
    ] = None,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="FILE", help="write the block of a machine file"),
    ] = None,
) -> None:
    """Identify modes (frequency, damping, participation) from records of vibration."""
    from gcodejerk.identification import (
        FrequencyResponse,
        RecordError,
        Samples,
        Spectrum,
        make_record,
        read_records,
    )

    name = _checked(axis, unit, rate, band, plot)
    outputs = [one for one in (as_json, plot, output) if one is not None]
    _refuse_idle(ctx, program, channel, rate, time)
    refuse((len(set(outputs)) < len(outputs), "--json, --plot and -o are files of their own"))
    described, moves = _told(machine, program, name)
    _keep_apart(outputs, [*records, program], described)
    with waiting("reading"):
        read = [
            found
            for one in records
            for found in read_records(one, time=time, columns=column or (), rate=rate)
        ]
    spectra = [one for one in read if isinstance(one, Spectrum)]
    responses = [one for one in read if isinstance(one, FrequencyResponse)]
    taken = [make_record(one, unit) for one in read if isinstance(one, Samples)]
    if not taken:
        _refuse_beside_spectra(program=program, unit=unit, rate=rate, time=time)
    kinds = [one for one in (spectra, responses, taken) if one]
    if len(kinds) > 1:
        raise RecordError(
            f"{kinds[0][0].name} and {kinds[1][0].name} are not of one kind",
            "give records over time, or spectra, or frequency responses",
        )
    with waiting("searching"):
        if spectra:
            result = _spectra(spectra, name, band or BAND)
        elif responses:
            result = _responses(responses, name, band or BAND)
        else:
            result = _records(taken, name, channel, described, moves, band)
    _show(*result, as_json, plot, output)


def _refuse_idle(
    ctx: typer.Context,
    program: str | None,
    channel: str | None,
    rate: float | None,
    time: str | None,
) -> None:
    """Refuse options that do nothing without another, or beside it."""
    told = said(ctx, "machine")
    needs = "is for participations, which need what ran too: --program FILE"
    both = rate is not None and time is not None
    refuse(
        (program is None and channel is not None, f"--channel {needs}"),
        (program is None and told, f"--machine {needs}"),
        (both, "--rate is for records without a column of --time: choose one"),
    )


def _refuse_beside_spectra(**idle: object) -> None:
    """Refuse options that are of records over time alone."""
    for name, value in idle.items():
        if value is not None:
            raise typer.BadParameter(
                f"--{name} is of records over time, and these are spectra: leave --{name} out"
            )


def _checked(
    axis: str,
    unit: str | None,
    rate: float | None,
    band: tuple[float, float] | None,
    plot: str | None,
) -> str:
    """The axis, where the options make sense."""
    from gcodejerk.axes import AXES
    from gcodejerk.identification.record import UNITS

    if plot is not None and Path(plot).suffix.lower() not in FIGURES:
        raise typer.BadParameter(f"--plot {plot}: a figure is one of {', '.join(FIGURES)}")
    if unit is not None and unit not in UNITS:
        raise typer.BadParameter(f"--unit {unit}: it is one of {', '.join(UNITS)}")
    if rate is not None and not (math.isfinite(rate) and rate > 0.0):
        raise typer.BadParameter(f"--rate {rate:g}: it has to be above 0")
    if band is not None and not 0.0 < band[0] < band[1] < math.inf:
        raise typer.BadParameter(f"--band {band[0]:g} {band[1]:g}: the lower one first, above 0")
    if axis.upper() not in AXES:
        raise typer.BadParameter(f"--axis {axis}: it is one of {' '.join(AXES)}")
    return axis.upper()


def _told(
    machine: str | None, program: str | None, axis: str
) -> tuple[Machine | None, list[Commanded]]:
    """The machine and the rapids that it was told, as far as the user says them."""
    from gcodejerk.batch.files import open_input
    from gcodejerk.identification import commanded_rapids

    if program is None:
        return None, []
    described = load_machine(machine, [program])
    described.axis(axis)
    with open_input(program) as source:
        return described, commanded_rapids(source.read(), described, program)


_Result = tuple[
    "RenderableType",
    "list[str]",
    str,
    "Callable[[], dict[str, Any]]",
    "Callable[[Any, str], None]",
]
"""Table, sentences, block, JSON, figure."""


def _records(
    records: list[Record],
    axis: str,
    channel: str | None,
    machine: Machine | None,
    moves: list[Commanded],
    band: tuple[float, float] | None,
) -> _Result:
    from gcodejerk.identification import RecordError, find_decays

    for record in records:
        if channel is not None and channel not in record.channels:
            raise RecordError(
                f"{record.name} has no channel {channel!r}",
                f"its channels are {', '.join(record.channels)}",
            )
    reach = REACH * min(record.rate for record in records)
    low, high = band or (BAND[0], min(BAND[1], reach))
    if high > reach or low >= high:
        raise RecordError(
            f"{records[0].name} reaches to {reach:.0f} Hz only, not to {high:g} Hz",
            f"record faster, or state --band {BAND[0]:g} {reach:.0f}",
        )
    looked = (low, high)
    searches = [(record, find_decays(record, looked)) for record in records]
    return _searched(searches, axis, channel, machine, moves, looked)


def _searched(
    searches: list[tuple[Record, Search]],
    axis: str,
    channel: str | None,
    machine: Machine | None,
    moves: list[Commanded],
    looked: tuple[float, float],
) -> _Result:
    """What decays tell."""
    from gcodejerk.identification import identify_modes
    from gcodejerk.report.identification_figure import plot_identification
    from gcodejerk.report.identification_record import identification_record, modes_block
    from gcodejerk.report.identification_table import (
        identification_sentences,
        identification_table,
    )

    found = identify_modes(searches, axis, channel, machine, moves)
    return (
        identification_table(found),
        identification_sentences(found),
        modes_block(found),
        lambda: identification_record(found),
        lambda file, suffix: plot_identification(found, looked, file, suffix),
    )


def _responses(responses: list[FrequencyResponse], axis: str, band: tuple[float, float]) -> _Result:
    from gcodejerk.identification import take_response

    return _searched([take_response(one, band) for one in responses], axis, None, None, [], band)


def _spectra(spectra: list[Spectrum], axis: str, band: tuple[float, float]) -> _Result:
    from gcodejerk.identification import find_peaks
    from gcodejerk.report.identification_figure import plot_peaks
    from gcodejerk.report.identification_record import peaks_record, spectrum_block
    from gcodejerk.report.identification_table import peaks_sentences, peaks_table

    found = [find_peaks(one, band) for one in spectra]
    return (
        peaks_table(found),
        peaks_sentences(found),
        spectrum_block(found, axis),
        lambda: peaks_record(found, axis),
        lambda file, suffix: plot_peaks(found, band, file, suffix),
    )


def _keep_apart(outputs: list[str], read: list[str | None], machine: Machine | None) -> None:
    """Refuse outputs that are records, the program that was recorded, or the machine file."""
    from gcodejerk.batch.files import refuse_clashes

    refuse_clashes(outputs, [*read, None if machine is None else machine.source])


def _show(
    table: RenderableType,
    sentences: list[str],
    block: str,
    record: Callable[[], dict[str, Any]],
    draw: Callable[[Any, str], None],
    as_json: str | None,
    plot: str | None,
    output: str | None,
) -> None:
    """Write what was asked for, and print the rest where standard output is free."""
    from gcodejerk.batch.files import new_file
    from gcodejerk.report.records import dump

    with ExitStack() as outputs:
        if as_json is not None:
            outputs.enter_context(new_file(as_json)).write(dump(record()))
        if plot is not None:
            draw(outputs.enter_context(new_file(plot)), Path(plot).suffix)
        if output is not None:
            outputs.enter_context(new_file(output)).write(block.encode("utf-8", "replace"))
    if "-" in (as_json, plot, output):
        return
    console().print(table)
    for line in sentences:
        say(line)
    if output is None:
        print()
        print(block, end="")
