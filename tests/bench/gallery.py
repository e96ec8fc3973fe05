"""The pictures of docs/gallery.md and of the documentation's first page.

    python tests/bench/gallery.py

writes docs/pictures/*.png anew. Each is what a command of gcodejerk draws, but for the first, which
shows one rapid before and after in the plainest way.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
from PIL import Image
from scipy.signal import lsim

mpl.use("Agg")
import matplotlib.pyplot as plt

from gcodejerk import Machine, find_machine, plan_move

ROOT = Path(__file__).parents[2]
OUT = ROOT / "docs" / "pictures"
COMMANDS = {
    "plan.png": "plan --machine vmc Z=12.5 --plot",
    "map.png": "map --machine paper --axis Z --length 1 -o",
    "conditions.png": "map --machine centre --axis Z --length 1 --conditions -o",
    "compare.png": "compare --machine centre Z=1 --plot",
    "simulate.png": "simulate --machine vmc33 Z=1 --time 0.040 --T1 0.001 --plot",
    "parameters.png": "parameters samples/plate.ngc --machine centre --controller grblhal --plot",
}
BEFORE, AFTER = "#c1440e", "#1f6f8b"
LENGTH, HERTZ, DAMPING, BEHIND = 12.5, 30.0, 0.02, 0.2


def vibration(t, acceleration):
    """Displacement of the mode that is driven by an acceleration, by scipy [mm]."""
    omega = 2.0 * np.pi * HERTZ
    system = ([-1.0], [1.0, 2.0 * DAMPING * omega, omega**2])
    return lsim(system, acceleration, t)[1]


def one_rapid():
    """A retract of Z, as LinuxCNC does it today and as it is written."""
    plan = plan_move({"Z": LENGTH}, Machine.load(find_machine("vmc")))
    T = plan.time
    t = np.arange(0.0, T + BEHIND, 1e-5)
    figure, (above, below) = plt.subplots(
        2, 1, sharex=True, figsize=(8.0, 4.4), height_ratios=(1, 1.3), layout="constrained"
    )
    for profile, colour, words in (
        (plan.plans.conventional, BEFORE, "today"),
        (plan.plans.profiles, AFTER, "rewritten, in the same time"),
    ):
        begin = profile.begin
        k = np.clip(np.searchsorted(begin, t, side="right") - 1, 0, len(begin) - 1)
        unit = profile.acceleration[k] + profile.jerk[k] * (t - begin[k])
        a = LENGTH * np.where(t < profile.total[0], unit, 0.0)
        above.plot(1e3 * t, a / 1000.0, color=colour, lw=1.8, label=words)
        below.plot(1e3 * t, 1e3 * vibration(t, a), color=colour, lw=1.6)
    above.set_ylabel("acceleration\n[m/s²]")
    below.set_ylabel("30 Hz mode of\nthe machine [µm]")
    below.set_xlabel("time [ms]")
    below.axvspan(1e3 * T, 1e3 * t[-1], color="0.5", alpha=0.08, lw=0)
    below.annotate(
        "arrived: what is left", (1e3 * T + 2.0, below.get_ylim()[1]), va="top", fontsize=10
    )
    above.legend(frameon=False, loc="upper right", fontsize=11)
    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
        axes.axhline(0.0, color="0.7", lw=0.8, zorder=0)
        axes.margins(x=0.0)
    figure.savefig(OUT / "rapid.png", dpi=130)
    small(OUT / "rapid.png", OUT / "rapid.png")


def small(drawn, picture):
    """A picture for a page: as wide as one, and of few colours."""
    image = Image.open(drawn).convert("RGB")
    image.thumbnail((1400, 1400), Image.Resampling.LANCZOS)
    image.quantize(96, dither=Image.Dither.NONE).save(picture, optimize=True)


def main():
    """Draw all of them."""
    OUT.mkdir(exist_ok=True)
    one_rapid()
    command = Path(sys.executable).with_name("gcodejerk")
    for name, words in COMMANDS.items():
        with tempfile.TemporaryDirectory() as folder:
            drawn = Path(folder) / name
            subprocess.run([command, *words.split(), drawn], cwd=ROOT, check=True)
            small(drawn, OUT / name)
        print(f"docs/pictures/{name}: {words}")


if __name__ == "__main__":
    main()
