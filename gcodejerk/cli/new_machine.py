"""The command `machine new`: a machine file from what people have, or from a few questions."""

from __future__ import annotations

import json
import os
import re
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gcodejerk.cli.common import ControllerOption, DialectOption, refuse

if TYPE_CHECKING:
    from gcodejerk.machine.sources import Draft

_NAMED = "linuxcnc, fanuc, haas, siemens, heidenhain, grbl, mach, marlin, klipper, csv, ..."


def machine_new(
    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE...]",
            help="LinuxCNC INI, grbl $$ dump, FluidNC YAML, Klipper printer.cfg and "
            "resonances_x.csv, Marlin M503, RepRapFirmware config.g, Fanuc parameters; without "
            "any, a few questions",
        ),
    ] = None,
    output: Annotated[
        str, typer.Option("-o", "--output", metavar="FILE", help="- is standard output")
    ] = "-",
    name: Annotated[str | None, typer.Option(help="what reports call the machine")] = None,
    controller: ControllerOption = None,
    dialect: DialectOption = None,
    positioning: Annotated[
        str | None, typer.Option(help="linear: G0 is straight; independent: each axis on its own")
    ] = None,
    interval: Annotated[
        str | None, typer.Option(metavar="T", help="of commands, with its unit, as in 1ms")
    ] = None,
    axis: Annotated[
        list[str] | None,
        typer.Option(
            "--axis", metavar="WORDS",
            help="'X velocity=36m/min acceleration=0.4g travel=-500:50', also jerk, resolution, "
            "wrap; may be given again",
        ),
    ] = None,
    mode: Annotated[
        list[str] | None,
        typer.Option(
            "--mode", metavar="WORDS", help="'Z frequency=30 damping=0.02 participation=1'"
        ),
    ] = None,
    headroom: Annotated[
        float | None,
        typer.Option(
            min=1.0, max=10.0, metavar="K",
            help="the drives can accelerate K times as much as rapids do today",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="replace the output file")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="print the file with what was assumed, as JSON")
    ] = False,
) -> None:  # fmt: skip
    """Make a commented machine file from a control's own configuration, or from answers."""
    from gcodejerk.batch.files import new_file, refuse_clashes
    from gcodejerk.machine.sources import draft_of, stated_axis, stated_mode, text_of

    _check_output(output, force)
    refuse_clashes([output], files)
    folder = Path(output).parent if output != "-" else Path()
    asked = not files and not axis
    if asked and not sys.stdin.isatty():
        raise typer.BadParameter(
            "name a control's configuration, or state axes: --axis 'X velocity=36m/min "
            "acceleration=0.4g'; questions are asked at a terminal only"
        )
    draft = draft_of(files or (), folder)
    draft.name = name or draft.name
    draft.controller = controller or draft.controller
    draft.dialect = dialect
    _state(draft, positioning, interval)
    for words in axis or ():
        stated_axis(draft, words)
    if asked:
        _ask(draft)
    for words in mode or ():
        stated_mode(draft, words)
    draft.settle(headroom)
    text = text_of(draft)
    _prove(text, output if output != "-" else str(folder / "new.yaml"), draft)
    if output != "-" or not as_json:
        with new_file(output) as file:
            file.write(text.encode())
    if as_json:
        print(json.dumps(_record(draft, text, output), indent=1, ensure_ascii=False))
    _say(draft, text, output)


def _check_output(output: str, force: bool) -> None:
    """Refuse a file that is there, unless it may be replaced."""
    from gcodejerk.errors import MachineError

    refuse((force and output == "-", "--force replaces a file: name the file with -o"))
    if output != "-" and os.path.lexists(output) and not force:
        raise MachineError(
            f"{output} is there already", "give another name, or --force to replace it"
        )


def _prove(text: str, name: str, draft: Draft) -> None:
    """What is not a machine file never leaves; where its numbers come from, messages say.

    Raises
    ------
    MachineError
        By its key and origin: lines of a file that nobody has seen lead nowhere.
    """
    from gcodejerk.errors import MachineError, Place
    from gcodejerk.machine import Machine, MachineFileError

    try:
        Machine.loads(text, name)
    except MachineFileError as error:
        lines = text.splitlines()
        source = Place(", ".join(draft.sources)) if draft.sources else None
        found = []
        for one in error.problems:
            line = one.place.line if one.place is not None else None
            said = lines[line - 1].partition("#")[2].strip() if line else ""
            found.append(
                MachineError(f"{one.problem}{f' ({said})' if said else ''}", one.remedy, source)
            )
        raise MachineFileError(found) from None


def _record(draft: Draft, text: str, output: str) -> dict[str, Any]:
    """The file with what was assumed."""
    return {
        "file": output, "kind": draft.kind, "controller": draft.controller,
        "axes": [one.name for one in draft.ordered()], "modes_known": draft.known,
        "assumed": [line.strip() for line in text.splitlines() if "ASSUMED:" in line],
        "notes": draft.notes, "text": text,
    }  # fmt: skip


def _state(draft: Draft, positioning: str | None, interval: str | None) -> None:
    """Put what the user says in place of what was read."""
    from gcodejerk.machine.sources.draft import Fact
    from gcodejerk.machine.sources.quantity import quantity

    if positioning is not None:
        draft.positioning = positioning, "as stated"
    if interval is not None:
        draft.interval = Fact(quantity(interval, "time", "interval"), f"as stated, {interval}")


def _say(draft: Draft, text: str, output: str) -> None:
    """What the user has to look at next, on standard error."""
    assumed = text.count("ASSUMED:") - 1
    shown = output if output != "-" else "the machine file"
    print(f"{shown}: {_axes(draft)}; {assumed} values ASSUMED: look at them", file=sys.stderr)
    for note in draft.notes:
        print(f"note: {note}", file=sys.stderr)
    if not draft.known:
        named = shlex.quote(output) if output != "-" else "FILE"
        print(
            "next: nobody has said how it vibrates, so every rapid is left alone; record it with\n"
            f"  gcodejerk machine test-program --machine {named} -o ring.ngc\n"
            "and write what rings as modes (the file's end shows how)",
            file=sys.stderr,
        )


def _axes(draft: Draft) -> str:
    source = f" from {', '.join(draft.sources)}" if draft.sources else ""
    return f"axes {' '.join(one.name for one in draft.ordered())}{source}"


def _ask(draft: Draft) -> None:
    """The questions; every answer has a unit, and an empty one to an optional question is no."""
    from gcodejerk.axes import AXES
    from gcodejerk.emit import load_controller
    from gcodejerk.errors import GcodejerkError, MachineError
    from gcodejerk.machine.sources import stated_axis, stated_mode

    def ask(question: str, default: str | None = None) -> str:
        # On standard error: standard output may be the file.
        answer = typer.prompt(question, default=default, show_default=bool(default), err=True)
        return str(answer).strip()

    draft.name = ask("What is the machine called", draft.name or "My machine")
    while True:
        draft.controller = ask(f"Which control ({_NAMED})", "linuxcnc")
        try:
            load_controller(draft.controller)
            break
        except GcodejerkError as error:
            print(error, file=sys.stderr)
    while not (letters := _letters(ask("Its axes", "X Y Z"))):
        print(f"name them by their letters, of {' '.join(AXES)}", file=sys.stderr)
    for letter in letters:
        turns = letter in "ABC"
        speed, rise, jump = (
            ("3600 deg/min", "200 deg/s^2", "4000 deg/s^3")
            if turns
            else ("36 m/min", "0.4 g", "50 m/s^3")
        )
        while True:
            words = [letter]
            words.append(f"velocity={_joined(ask(f'{letter}: rapid speed, as in {speed}'))}")
            words.append(f"acceleration={_joined(ask(f'{letter}: acceleration, as in {rise}'))}")
            if jerk := ask(f"{letter}: jerk limit, as in {jump} (empty: it has none)", ""):
                words.append(f"jerk={_joined(jerk)}")
            unit = "deg" if turns else "mm"
            if travel := ask(f"{letter}: travel, as in -500:50 {unit} (empty: not known)", ""):
                words.append(f"travel={_joined(travel)}")
            try:
                stated_axis(draft, " ".join(words))
                break
            except MachineError as error:
                print(error, file=sys.stderr)
        while frequency := ask(f"{letter}: a frequency at which it rings, Hz (empty: none)", ""):
            damping = ask("   its damping ratio (empty: 0.03, assumed)", "")
            extra = f" damping={damping}" if damping else ""
            try:
                stated_mode(draft, f"{letter} frequency={_joined(frequency)}{extra}")
            except MachineError as error:
                print(error, file=sys.stderr)


def _letters(answer: str) -> list[str]:
    """Axes of an answer such as ``XYZ`` or ``x, y, z``; none where anything else is in it."""
    from gcodejerk.axes import AXES

    named = re.sub(r"[\s,;.+/]", "", answer.upper())
    return list(dict.fromkeys(named)) if set(named) <= set(AXES) else []


def _joined(answer: str) -> str:
    return answer.replace(" ", "")
