"""What the profiles are worth: how much they leave when the frequencies are not those of the file.

    python tests/bench/bench_designs.py [--moves 50] [--machines vmc router drill]
        [--profiles condition3 symmetric cascade optimal/0 optimal]

For moves of one to three axes of the shipped machines, drawn by length and direction: the largest
displacement that any mode keeps, at the modes' own frequencies and at the worst within 5 and 10 %;
the last beside today's rapid; how many moves are left alone because nothing is better, how many are
worse than today at 10 %; and what a mode that the machine file does not name, at 2.7 times each of
the file's, keeps beside today's rapid. `optimal/0` is the optimum without its
guard. The residual is computed here, from the jerk's steps.
"""

import argparse
from dataclasses import replace

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, find_machine
from gcodejerk.planning.plan import plan_moves
from gcodejerk.reasons import CERTAIN

HIDDEN = 2.7
BAND = 0.1


def drawn(machine, count):
    """Displacements, shape (count, 9): lengths from 0.1 to 300 mm, each axis in three of five."""
    random = np.random.default_rng(11)
    out = np.zeros((3 * count, len(AXES)))
    for axis in machine.axes:
        if not axis.rotary:
            size = np.exp(random.uniform(np.log(0.1), np.log(300.0), len(out))).round(3)
            sign = random.choice([-1.0, 1.0], len(out)) * (random.random(len(out)) < 0.6)
            out[:, AXES.index(axis.name)] = size * sign
    return out[(out != 0.0).any(axis=1)][:count]


def steps(profiles, k):
    """Moments [s] and steps of acceleration [1/s^2] and jerk [1/s^3] of one unit profile."""
    part = slice(profiles.first[k], profiles.first[k + 1])
    begin, a, j = profiles.begin[part], profiles.acceleration[part], profiles.jerk[part]
    d = profiles.duration[part]
    end = a + j * d
    moments = np.append(begin, begin[-1] + d[-1])
    jumps = np.append(a, 0.0) - np.insert(end, 0, 0.0)
    return moments, jumps, np.diff(j, prepend=0.0, append=0.0)


def left(profiles, k, share, modes, relative):
    """Displacement of each mode [mm] at frequencies relative to its own, shape (m, r)."""
    moments, jumps, jerks = steps(profiles, k)
    out = np.zeros((len(modes.poles), len(relative)))
    for m, pole in enumerate(modes.poles):
        weight = abs(share @ modes.participation[m])
        if weight == 0.0:
            continue
        poles = pole * np.asarray(relative)[:, np.newaxis]
        ringing = (jumps / poles + jerks / poles**2) * np.exp(poles * (moments[-1] - moments))
        out[m] = weight * np.abs(ringing.sum(axis=1)) / poles[:, 0].imag
    return out


def row_of(machine, displacement, profile):
    """Figures of one profile over all moves, each of shape (n, ...)."""
    name, *guard = profile.split("/")
    if guard:
        machine = replace(machine, design=replace(machine.design, guard=float(guard[0])))
    plans = plan_moves(displacement, machine, name, as_today=True)
    place = {int(move): k for k, move in enumerate(plans.move)}
    today = plan_moves(displacement, machine, "conventional", as_today=True)
    figures, hidden = [], []
    around = np.linspace(1.0 - BAND, 1.0 + BAND, 401)
    half = np.abs(around - 1.0) <= 0.5 * BAND + 1e-12
    for move, share in enumerate(displacement):
        k = place.get(move)
        own = (plans.profiles, k) if k is not None else (today.profiles, move)
        both = [left(*which, share, plans.modes, around) for which in (own, (today.profiles, move))]
        figures.append([(d[:, 200].max(), d[:, half].max(), d.max()) for d in both])
        unknown = [
            left(*which, share, plans.modes, [HIDDEN]).max()
            for which in (own, (today.profiles, move))
        ]
        hidden.append(unknown[0] / unknown[1] if unknown[1] else 1.0)
    return np.array(figures), np.array(hidden), int(np.count_nonzero(plans.reason != CERTAIN))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moves", type=int, default=50)
    parser.add_argument("--machines", nargs="+", default=["vmc", "router", "drill"])
    parser.add_argument(
        "--profiles",
        nargs="+",
        default=["condition3", "symmetric", "cascade", "optimal/0", "optimal"],
    )
    given = parser.parse_args()
    machines = [Machine.load(find_machine(name)) for name in given.machines]
    machines = [replace(m, design=replace(m.design, band=BAND)) for m in machines]
    print(
        "| profile | own frequencies | +-5 % | +-10 % median / max | of today's at +-10 % | ",
        end="",
    )
    print("worse than today | left alone | hidden mode at 2.7 f: median / 90 % |")
    print("|---|---|---|---|---|---|---|---|")
    for profile in given.profiles:
        parts = [row_of(m, drawn(m, given.moves), profile) for m in machines]
        figures = 1e3 * np.concatenate([part[0] for part in parts])
        hidden = np.concatenate([part[1] for part in parts])
        own, today = figures[:, 0], figures[:, 1]
        if profile == given.profiles[0]:
            median = np.median(today, axis=0)
            print(
                f"| today's rapid | {median[0]:.3g} | {median[1]:.3g} | {median[2]:.3g} / "
                f"{today[:, 2].max():.4g} | 1 | - | - | 1 / 1 |"
            )
        median = np.median(own, axis=0)
        share = np.median(own[:, 2] / today[:, 2])
        worse = int(np.count_nonzero(own[:, 2] > 1.001 * today[:, 2]))
        print(
            f"| {profile} | {median[0]:.3g} | {median[1]:.3g} | {median[2]:.3g} / "
            f"{own[:, 2].max():.4g} | {share:.2g} | {worse} of {len(own)} | "
            f"{sum(part[2] for part in parts)} | {np.median(hidden):.2g} / "
            f"{np.percentile(hidden, 90):.2g} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
