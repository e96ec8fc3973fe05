"""What LinuxCNC makes of streams, as a table: positions, time and residuals, played.

    .venv/bin/python tests/bench/bench_playback.py [--figure docs/linuxcnc-played.png]

Twelve rapids of a fast mill with modes at 30, 50, 90 and 110 Hz are played as they are, and as
streams under several settings of the INI file, and compared with what was reported. A rapid passes
at a mode where it keeps what was reported, within 10 % of that or 3 % of what today's rapid keeps.
It takes two minutes and needs LinuxCNC (Debian: linuxcnc-uspace).
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "clients"))
from playing import MODES, mill, rapids, record, settings_of, streams

from gcodejerk.machine import Machine
from gcodejerk.motion import sample_profiles
from gcodejerk.rewrite.pipeline import process

MOVES = ("Z0.5", "Z1.5", "Z3.5", "Z8.5", "Z18.5", "Z38.5", "Z88.5", "Z-11.5")
MOVES += ("X10", "X13 Y4 Z-6.5", "X43 Y24 Z3.5", "X103 Y104 Z43.5")
SETTINGS = (
    ("as it is recommended", 1.05, 0.001, {}),
    ("MAX_ACCELERATION 2 times the limit", 2.0, 0.001, {}),
    ("MAX_ACCELERATION 4 times", 4.0, 0.001, {}),
    ("ARC_BLEND_OPTIMIZATION_DEPTH = 100", 1.05, 0.001, {"ARC_BLEND_OPTIMIZATION_DEPTH": 100}),
    ("ARC_BLEND_OPTIMIZATION_DEPTH = 20", 1.05, 0.001, {"ARC_BLEND_OPTIMIZATION_DEPTH": 20}),
    ("ARC_BLEND_ENABLE = 0", 1.05, 0.001, {"ARC_BLEND_ENABLE": 0}),
    ("servo period 0.5 ms", 1.05, 0.0005, {}),
)


def program():
    """The rapids, each between two feeds of an axis that has nothing to do with it."""
    lines = ["G21 G90 G17 G40 G94 G64", "G0 X0 Y0 Z0", "G4 P0.2", "G1 Y0.5 F600"]
    for k, move in enumerate(MOVES):
        lines += [f"G0 {move}", f"G1 Y{1 + 0.5 * (k % 2):g} F600"]
    return ("\n".join([*lines, "M2"]) + "\n").encode()


def played(period, factor, trajectory, folder, plain=False):
    """A result and its rapids as they were played."""
    machine = Machine.loads(mill(period), "mill")
    data = program()
    result = process(data, machine, controller="linuxcnc")
    settings = settings_of(machine, factor)
    settings["TRAJ"].update(trajectory)
    rows = record(data if plain else result.output, folder, settings, period)
    return result, (rapids if plain else streams)(result, rows, period)


def line_of(name, result, each):
    """One row of the table."""
    error = np.zeros((len(each), len(MODES)))
    for i, rapid in enumerate(each):
        plan, today = result.residual[rapid.row], result.conventional_residual[rapid.row]
        tolerance = np.maximum(0.10 * plan, 0.03 * today)
        off = np.abs(rapid.residual - plan) / np.where(tolerance > 0.0, tolerance, np.inf)
        error[i] = off.reshape(-1, len(MODES)).max(axis=0)
    off = max(rapid.deviation for rapid in each)
    micro = "" if np.isnan(off) else f"{1e3 * off:.2g}"
    late = f"{min(r.late for r in each)}..{max(r.late for r in each)}"
    errors = "/".join(f"{e:.2g}" for e in error.max(axis=0))
    passing = int((error.max(axis=1) <= 1.0).sum())
    return f"| {name} | {micro} | {late} | {errors} | {passing} of {len(each)} |"


def draw(path, folder):
    """One rapid as planned and as played, and the vibration of the 30 Hz mode behind it."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    result, each = played(0.001, 1.05, {}, folder)
    _, plain = played(0.001, 1.0, {}, folder, plain=True)
    fig, axes = plt.subplots(2, 1, figsize=(7.5, 5.2), sharex=True, layout="constrained")
    row = each[2].row
    length = float(np.linalg.norm(result.plans.displacement[row, :3]))
    count = int(result.plans.counts[row])
    profile = result.plans.profiles.take([result.plans.profiles_of(row).start])
    fine = np.linspace(0, count, 20 * count + 1)
    speed = sample_profiles(profile, fine[np.newaxis], 0.001)[1][0] * length
    axes[0].plot(fine, np.gradient(speed, fine * 1e-3), color="0.6", lw=3, label="planned")
    pole = result.plans.modes.poles[8]
    for label, colour, found in (("stream", "C0", each), ("plain G0", "C3", plain)):
        rapid = next(r for r in found if r.row == row)
        way = np.concatenate([rapid.way, np.full(140, length)])
        begin = rapid.begin
        t = np.arange(len(way)) - begin
        kicks = np.diff(np.diff(way, prepend=0.0, append=length)) * 1e3
        axes[0].plot(
            t[:-1],
            np.diff(np.diff(way), prepend=0.0)[: len(t) - 1] * 1e6,
            colour,
            lw=1.2,
            label=label,
        )
        response = np.zeros(len(way))
        state = 0j
        for k, kick in enumerate(kicks[: len(way)]):
            state = state * np.exp(pole * 1e-3) + kick
            response[k] = (state / pole.imag).imag
        axes[1].plot(t, 1e3 * response, colour, lw=1.2, label=label)
    axes[0].set_ylabel("acceleration [mm/s$^2$]")
    axes[1].set_ylabel("30 Hz mode [um]")
    axes[1].set_xlabel("time since the start of the rapid [ms]")
    axes[0].set_xlim(-10, count + 100)
    axes[0].axvline(count, color="0.8", lw=0.8, zorder=0)
    axes[1].axvline(count, color="0.8", lw=0.8, zorder=0)
    axes[0].legend(frameon=False, loc="upper right")
    axes[0].set_title(f"A rapid of {length:g} mm in {count} ms on LinuxCNC 2.9", loc="left")
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    fig.savefig(path, dpi=130)


def main():
    """Print the table, or draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figure", metavar="FILE", help="draw one rapid instead of the table")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir="/tmp") as name:
        folder = Path(name)
        if given.figure:
            draw(given.figure, folder)
            return
        print("| played | position um | lag ms | err at 30/50/90/110 Hz | rapids passing all |")
        print("|---|---|---|---|---|")
        result, each = played(0.001, 1.05, {}, folder, plain=True)
        print(line_of("G0 itself", result, each))
        for label, factor, period, trajectory in SETTINGS:
            result, each = played(period, factor, trajectory, folder)
            print(line_of(label, result, each), flush=True)


if __name__ == "__main__":
    main()
