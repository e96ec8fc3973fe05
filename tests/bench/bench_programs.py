r"""A folder of real programs: how many of their rapids are certain, and what keeps the others.

    python tests/bench/bench_programs.py FOLDER [--dialect NAME] [--machine M.yaml] [--lines REASON]
        [--subprograms] [--start] [--auto] [--unroll]

FOLDER holds a folder for each dialect, by its name (``haas-lathe`` and the like count by what
stands in `READ_AS`), or the programs of the one that `--dialect` names. Each is read from a start
as a shop would state it in its machine file: work offsets, tool lengths, home, the place of tool
changes, when M codes run, what the control starts with. Printed is a row for each dialect: files,
rapids, those that are certain, those that the second reading confirms or contradicts, and the main
reasons of the rest. `--lines` prints the blocks that one reason keeps, `--subprograms` follows
calls into the other files of a collection, `--start` states where the axes stand (which few shops
can), `--unroll` writes loops and calls out first (and proves it), so that there are more rapids,
one for each pass, `--auto` prints how many of the files with rapids `auto` reads as their dialect,
or as what their dialect reads alike, and how many certain rapids differ (without `--unroll`).
"""

import argparse
import io
import sys
from collections import Counter, defaultdict
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from gcodejerk import Machine
from gcodejerk.axes import AXES
from gcodejerk.errors import GcodejerkError
from gcodejerk.machine.subprograms import load_subprograms
from gcodejerk.nc import Start, read_program
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.nc.dialects.detect import detect_dialect
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.unrolling.unrolling import unroll
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm
from gcodejerk.verification.unrolling.checking import NotFollowedError, check_unrolling

READ_AS = {"haas-lathe": "fanuc-lathe-a"}
ALIKE = {
    "rs274": {"linuxcnc", "grbl", "mach", "centroid", "uccnc", "edingcnc", "planetcnc", "masso"},
    "iso-mill": {"fanuc", "haas", "mitsubishi", "mazatrol-eia", "syntec"},
}
ALIKE["any-mill"] = ALIKE["rs274"] | ALIKE["iso-mill"]
STARTUP = {
    "siemens": "G90 G71 G17 G40 G64 G94",
    "fanuc": "G90 G17 G21 G40 G49 G80 G94",
    "haas": "G90 G17 G20 G40 G49 G80 G94",
    "fanuc-lathe-a": "G99 G21 G40 G18",
    "fanuc-lathe-b": "G90 G95 G21 G40 G18",
    "haas-lathe": "G99 G20 G40 G18",
    "klartext": "",
    "heidenhain-iso": "",
}
WORK = {f"G{k}": {"X": -300.0, "Y": -200.0, "Z": -350.0} for k in range(54, 60)}
LENGTHS = {f"H{k}": 100.0 for k in range(1, 100)}
HEADS = (
    *("dialect", "files", "refused", "rapids", "that move", "certain", "of these"),
    *("confirmed", "contradicted", "reasons"),
)
NOTHING_MOVES = Reason.NO_MOTION, Reason.AFTER_END
"""Reasons that are no loss."""


def start_for(folder):
    """What the shop of a dialect would state, by the folder's name."""
    turns = "lathe" in folder
    return Start(
        offsets=WORK,
        tool_lengths={int(key[1:]): value for key, value in LENGTHS.items()},
        startup=STARTUP.get(folder, "G90 G17 G21 G40 G49 G80 G94"),
        diameter=turns,
        decimal_point="calculator",
        resume="same",
        spindle="mill",
        home={"X": 0.0, "Y": 0.0, "Z": 0.0},
        tool_change={"Z": 0.0},
        m_before=frozenset({3, 4, 6, 7, 8, 13}),
        m_after=frozenset({5, 9}),
        wraps={"A": "none", "B": "none", "C": "none"},
    )


def start_of(machine, name):
    """The same from a machine file."""
    described = Machine.load(machine)
    return replace(described, dialect=name).program_start


def lathe_start(start, data, name):
    """Machines of Siemens are lathes or mills: the program says DIAMON, or turns in G18."""
    turns = name == "siemens" and (b"DIAMON" in data.upper() or b"G96" in data.upper())
    return replace(start, diameter=True) if turns else start


def programs(folder, dialect):
    """Dialect -> files."""
    if dialect:
        return {dialect: sorted(path for path in folder.rglob("*") if path.is_file())}
    return {
        sub.name: sorted(path for path in sub.rglob("*") if path.is_file())
        for sub in sorted(folder.iterdir())
        if sub.is_dir()
    }


@cache
def files_in(folder):
    """All files of a collection."""
    return load_subprograms(str(folder)).files


def folder_of(path, given):
    """What the collection that a program belongs to holds: the first folder below its dialect's."""
    parts = path.relative_to(given.folder).parts
    above = given.folder if given.dialect else given.folder / parts[0]
    inner = parts if given.dialect else parts[1:]
    return files_in(above / inner[0]) if len(inner) > 1 else {}


def read(path, name, start, given):
    """One program: how its rapids stand, and what the second reading says."""
    data = path.read_bytes()
    start = lathe_start(start, data, name)
    if given.subprograms:
        start = replace(start, subprograms=folder_of(path, given))
    data = written_out(path, data, name, start) if given.unroll else data
    rapids = read_program(io.BytesIO(data), dialect=name, start=start).rapids
    certain = np.flatnonzero(rapids.reason == CERTAIN)
    found = Findings(9)
    confirmed = confirm(io.BytesIO(data), name, start, rapids, certain, found)
    if found.violations:
        print(f"CONTRADICTED {path}: {found.violations[0]}", file=sys.stderr)
    return data, rapids, len(certain), confirmed, len(found.violations)


def written_out(path, data, name, start):
    """A program with its loops and calls written out, as far as they can be."""
    target = io.BytesIO()
    found = unroll(io.BytesIO(data), target, name=str(path), dialect=name, start=start)
    if not found.written:
        return data
    target.seek(0)
    try:
        checked = check_unrolling(io.BytesIO(data), target, dialect=name, start=start)
    except NotFollowedError:
        return data
    if not checked.ok:
        print(f"NOT PROVEN {path}: {checked.violations[0]}", file=sys.stderr)
    return target.getvalue()


def row(folder, files, given):
    """Read all programs of a dialect."""
    name = READ_AS.get(folder, folder)
    start = start_of(given.machine, name) if given.machine else start_for(folder)
    start = replace(start, positions=dict.fromkeys(AXES, 0.0)) if given.start else start
    total = Counter()
    left, worst, detected = Counter(), defaultdict(Counter), Counter()
    for path in files:
        try:
            data, rapids, certain, confirmed, contradicted = read(path, name, start, given)
        except GcodejerkError as error:
            total["refused"] += 1
            if given.verbose:
                print(f"refused {path}: {error}", file=sys.stderr)
            continue
        reasons = [REASONS[r] for r in rapids.reason if r != CERTAIN]
        total.update(
            files=1, rapids=len(rapids.reason), certain=certain, confirmed=confirmed,
            moving=sum(r not in NOTHING_MOVES for r in reasons) + certain,
            contradicted=contradicted,
        )  # fmt: skip
        left.update(str(reason) for reason in reasons)
        for reason in reasons:
            worst[str(reason)][str(path)] += 1
        if given.lines:
            show(path, data, rapids, given.lines)
        if given.auto and reasons + [None] * certain:
            how, apart = judge(data, path.name, name, start, rapids)
            detected.update({how: 1, "certain rapids that differ": apart})
            if given.verbose:
                print(how, path, file=sys.stderr)
    share = 100.0 * total["certain"] / max(1, total["moving"])
    names = ("files", "refused", "rapids", "moving", "certain")
    main = ", ".join(f"{reason} {count}" for reason, count in left.most_common(given.most))
    cells = [*(str(total[n]) for n in names), f"{share:.0f} %"]
    cells += [str(total["confirmed"]), str(total["contradicted"]), main]
    print(f"| {folder} | {' | '.join(cells)} |", flush=True)
    if given.worst:
        for reason, count in left.most_common(given.most):
            print(f"    {reason}: {count}")
            for path, times in worst[reason].most_common(given.worst):
                print(f"        {times:6} {path}")
    if given.auto:
        print("    auto: " + ", ".join(f"{what} {count}" for what, count in detected.most_common()))


def show(path, data, rapids, reason):
    """Print the blocks that a reason keeps."""
    lines = data.split(b"\n")
    for line, why in zip(rapids.line.tolist(), rapids.reason.tolist(), strict=True):
        if why != CERTAIN and reason in str(REASONS[why]):
            text = lines[line - 1].decode("latin-1").strip()
            print(f"{path}:{line}: {text}", file=sys.stderr)


def judge(data, name, dialect, start, rapids):
    """How `auto` reads a program, and certain rapids of it that are not those of its dialect."""
    try:
        found = detect_dialect(data[: 1 << 18], name, lathe=start.diameter)[0]
    except GcodejerkError:
        return "refused", 0
    mine = read_program(io.BytesIO(data), dialect=found.name, start=start).rapids
    where = {line: i for i, line in enumerate(rapids.line.tolist())}
    apart = 0
    for i in np.flatnonzero(mine.reason == CERTAIN).tolist():
        j = where.get(int(mine.line[i]))
        axes = [k for k in range(len(AXES)) if mine.words[i] >> k & 1]
        if j is None or (rapids.reason[j] == CERTAIN and not (
            np.allclose(mine.start[i, axes], rapids.start[j, axes], atol=1e-6)
            and np.allclose(mine.target[i, axes], rapids.target[j, axes], atol=1e-6)
        )):  # fmt: skip
            apart += 1
    if found.name == dialect:
        return "right", apart
    return "alike" if dialect in ALIKE.get(found.name, ()) else f"WRONG ({found.name})", apart


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--dialect")
    parser.add_argument("--machine")
    parser.add_argument("--most", type=int, default=6, help="reasons in a row")
    parser.add_argument("--worst", type=int, default=0, help="files for each reason")
    parser.add_argument("--lines", help="print the blocks of reasons that hold this text")
    parser.add_argument("--subprograms", action="store_true", help="of each collection")
    parser.add_argument("--start", action="store_true", help="the axes stand at zero at first")
    parser.add_argument("--unroll", action="store_true", help="loops and calls are written out")
    parser.add_argument("--auto", action="store_true")
    parser.add_argument("-v", "--verbose", action="store_true")
    given = parser.parse_args()
    print(f"| {' | '.join(HEADS)} |")
    print("|---" * len(HEADS) + "|")
    for folder, files in programs(given.folder, given.dialect).items():
        try:
            find_dialect(READ_AS.get(folder, folder))
        except GcodejerkError:
            continue
        row(folder, files, given)


if __name__ == "__main__":
    main()
