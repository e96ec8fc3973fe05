"""The command `verify`: that a program is its original with only its rapids re-timed."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, BinaryIO

import typer

from gcodejerk.cli.common import (
    Bar,
    DialectOption,
    JsonOption,
    MachineOption,
    ProfileOption,
    load_machine,
    progress,
    refuse,
)
from gcodejerk.cli.rapid_feed import ClearanceOption, RapidFeedOption, counting
from gcodejerk.cli.subprograms import SubprogramsOption, calling

if TYPE_CHECKING:
    from gcodejerk.machine import Machine
    from gcodejerk.rewrite.expanded import Front
    from gcodejerk.verification.findings import Verification


def verify(
    original: Annotated[str, typer.Argument(metavar="ORIGINAL", help="the program as it was")],
    processed: Annotated[
        str,
        typer.Argument(metavar="PROCESSED", help="the rewritten program, or its table or rows"),
    ],
    machine: MachineOption = None,
    profile: ProfileOption = None,
    dialect: DialectOption = None,
    controller: Annotated[
        str | None, typer.Option(metavar="NAME", help="what the streams are written for")
    ] = None,
    expand_cycles: Annotated[
        bool, typer.Option("--expand-cycles", help="the original's cycles are written out")
    ] = False,
    unroll: Annotated[
        bool, typer.Option("--unroll", help="the original's loops and calls are written out")
    ] = False,
    rapid_feed: RapidFeedOption = None,
    rapid_clearance: ClearanceOption = None,
    subprograms: SubprogramsOption = None,
    report: Annotated[
        str | None,
        typer.Option(metavar="FILE.json", help="hold streams for LinuxCNC to its profiles, too"),
    ] = None,
    most: Annotated[int, typer.Option(min=1, help="stop after so many violations")] = 100,
    as_json: JsonOption = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="exit status alone")] = False,
) -> None:
    """Prove that a program is the original with only its rapids re-timed; list what it is not."""
    from gcodejerk.batch.files import open_input
    from gcodejerk.rewrite.expanded import Front, verify_written
    from gcodejerk.verification import verify_files
    from gcodejerk.verification.bytes.alignment import ALIGNED
    from gcodejerk.verification.bytes.hal import CONTROLLER
    from gcodejerk.verification.proof import beside_of
    from gcodejerk.verification.reported import read_reported
    from gcodejerk.verification.rows.files import rows_format, stated_profile
    from gcodejerk.verification.table import is_table

    front = Front(unroll, expand_cycles)
    named = processed.lower().endswith(".csv")
    in_table = f"{front.options}: a table of streams has no {front.what} written out"
    refuse(
        (as_json and quiet, "--json prints, and -q is the exit status alone: choose one"),
        (original == processed == "-", "only one of the two can be standard input"),
        (report is not None and front, "--report: its lines are the original's, as it was"),
        (named and front, in_table),
    )
    described = counting(load_machine(machine, [original]), rapid_feed, rapid_clearance)
    described = calling(described, subprograms)
    reported = None if report is None else read_reported(report)
    told = ""
    with ExitStack() as files:
        one, other = (files.enter_context(open_input(name)) for name in (original, processed))
        names = (original, processed)
        table = named or is_table(other) or rows_format(other) is not None
        refuse((table and front, in_table))
        stated = profile or stated_profile(other)
        described, dialect, front = _said(
            other, processed, described, profile, dialect, controller, front
        )
        none = table or front or described.controller not in ALIGNED
        held_to = (
            "--report holds streams for LinuxCNC in the original's own lines to their profiles"
        )
        refuse(
            (
                report is not None and none,
                f"{held_to}, and {processed} has none: leave --report out",
            )
        )
        samples = beside_of(processed) if described.controller == CONTROLLER else None
        beside = files.enter_context(open_input(samples)) if samples is not None else None
        tell = _telling(files.enter_context(progress(quiet)))
        if front:
            found, written = verify_written(
                one, other, described, front, names=names, dialect=dialect, most=most,
                beside=beside, progress=tell,
            )  # fmt: skip
            told = written.told
        else:
            found = verify_files(
                one, other, described, names=names, dialect=dialect, most=most, table=table,
                beside=beside, reported=reported, progress=tell,
            )  # fmt: skip
    if as_json:
        print(json.dumps(_findings(found, original, processed), indent=1, ensure_ascii=False))
    elif not quiet:
        _tell(found, original, processed, told, most)
        _tell_assumed(found, processed, described, bool(stated) or not table)
    if not found.ok:
        raise typer.Exit(1)


def _telling(show: Bar | None) -> Callable[[int, int], None] | None:
    """What shows how far the proof is, where somebody looks; until it says so, that it reads."""
    if show is None:
        return None
    show.wait("reading")
    return partial(show, "verifying")


def _said(
    other: BinaryIO,
    processed: str,
    machine: Machine,
    profile: str | None,
    dialect: str | None,
    controller: str | None,
    front: Front,
) -> tuple[Machine, str | None, Front]:
    """The machine, the dialect and what was written out: what users do not say, the file does."""
    from gcodejerk.rewrite.expanded import Front
    from gcodejerk.verification.bytes.stamp import read_stamp
    from gcodejerk.verification.rows.files import stated_profile

    stamp = read_stamp(other, machine)
    if stamp is not None and not stamp.known:
        print(
            f"{processed}: note: stamped for another machine file, with other subprograms or "
            f"with options that are not known here; verified as {machine.source} and the "
            "options say",
            file=sys.stderr,
        )
    elif stamp is not None:
        profile, dialect = profile or stamp.profile, dialect or stamp.dialect
        front = Front(front.unroll or stamp.unroll, front.cycles or stamp.expand_cycles)
        controller = controller or stamp.controller
    profile = profile or stated_profile(other)
    if controller is not None:
        machine = replace(machine, controller=controller)
    if profile is not None:
        machine = replace(machine, design=replace(machine.design, profile=profile))
    return machine, dialect, front


def _tell(found: Verification, original: str, processed: str, told: str, most: int) -> None:
    """Print the violations, and what they come to."""
    for violation in found.violations:
        file, line = (
            (processed, violation.line) if violation.line else (original, violation.original_line)
        )
        place = f"{file}:{line}" if line else file
        print(f"{place}: {violation.kind}: {violation.problem}")
    if not found.ok:
        more = " or more" if len(found.violations) >= most else ""
        print(f"{processed}: {len(found.violations)}{more} violations: do not run it")
    elif found.places:
        print(
            f"{processed}: is {original} with its control set and restored at {found.places} "
            "places and nothing else changed"
        )
    else:
        print(
            f"{processed}: is {original} with {told}{found.rewritten} of its {found.rapids} "
            "rapids re-timed and nothing else changed; "
            f"{found.confirmed} of {found.rewritten} confirmed by a second reading"
            + _read_once(found.rewritten - found.confirmed)
        )


def _tell_assumed(found: Verification, processed: str, machine: Machine, stated: bool) -> None:
    """Say what a duration was judged by, where no profile was stated."""
    from gcodejerk.verification.findings import Kind

    if not stated and any(one.kind is Kind.TIME for one in found.violations):
        print(
            f"{processed}: note: the table does not say with which profile it was made, taken as "
            f"{machine.design.profile}; repeat the --profile of `process`, if there was one",
            file=sys.stderr,
        )


def _findings(found: Verification, original: str, processed: str) -> dict[str, object]:
    """What a verification found, for other programs."""
    return {
        "original": original,
        "processed": processed,
        "ok": found.ok,
        "rapids": found.rapids,
        "rewritten": found.rewritten,
        "confirmed": found.confirmed,
        "violations": [
            {
                "kind": str(one.kind),
                "line": one.line,
                "original_line": one.original_line,
                "problem": one.problem,
            }
            for one in found.violations
        ],
    }


def _read_once(count: int) -> str:
    """What rests on one reading alone: not refused, and not as certain as the rest."""
    if not count:
        return ""
    whom = "the other rests" if count == 1 else f"the other {count} rest"
    return f"; {whom} on one reading alone, which the second could not follow"
