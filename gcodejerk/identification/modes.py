"""Modes of a machine from many decays: what agrees is identified, what does not is said.

This module owns the judgement. A mode is one that most decays show, with frequencies and damping
ratios that agree; its uncertainty is the larger of what noise explains and what the decays scatter
by. Participation needs the command: what the mode keeps of it by the planner's own formula, against
what was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.identification.commanded import Commanded
from gcodejerk.identification.decays import Decay, Search
from gcodejerk.identification.record import Record
from gcodejerk.identification.ringing import Ring
from gcodejerk.machine import Machine
from gcodejerk.motion import profiles_response
from gcodejerk.motion.residual import mode_poles
from gcodejerk.planning.conventional import conventional_limits, todays_profiles

TOGETHER = 0.05
"""Frequencies this near each other are one mode's, if they agree. [-]"""
INSTEAD = 0.10
"""Two frequencies this near each other, no decay of which shows both, are one that moves. [-]"""
MOST_SCATTER = 0.02
"""Of a frequency, beyond which the decays disagree. [-]"""
MOST_DAMPING_SCATTER = 0.6
"""Of a damping ratio. [-]"""
SHARE, OFTEN = 0.4, 3
"""Of the decays that have to show a mode; or so many, and `RARE` of them: short rapids strike what
long ones leave alone."""
RARE = 0.2
HUM = 0.5
"""Of an amplitude's logarithm, what it has to lose in a decay: else it is a fan, or the mains."""
LEAST_BAND = 0.01
"""`design.band` at least. [-]"""
WELL_STRUCK = 0.2
"""Participations are taken from moves that strike a mode at least by this part of the strongest."""


ONSET_UNSURE = 0.005
"""When a rapid began is seen so late, since a servo begins gently: the decay since then counts for
the participation. [s]"""
MOST_EARLY = 0.005
"""What a decay may begin before its rapid ends by the machine file. [s]"""


@dataclass(frozen=True, slots=True, eq=False)
class Identified:
    """One mode.

    Attributes
    ----------
    frequency, damping : float
        [Hz], [-]
    sd_frequency, sd_damping : float
        The larger of noise and scatter. [Hz], [-]
    decays : int
        In how many decays it was seen, of `of`.
    of : int
    amplitude : float
        Largest acceleration of it in any decay, all channels together. [mm/s^2]
    energy : float
        Its median share in the decays. [-]
    participation, sd_participation : float or None
        None where the command is not known. [-]
    problem : str
        Why it is not identified; empty where it is.
    """

    frequency: float
    damping: float
    sd_frequency: float
    sd_damping: float
    decays: int
    of: int
    amplitude: float
    energy: float
    participation: float | None
    sd_participation: float | None
    problem: str


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """What records tell of an axis.

    Attributes
    ----------
    axis : str
    modes : tuple of Identified
        Those that hold and those that do not, the lowest frequency first.
    searches : tuple of (Record, Search)
    band : float
        What `design.band` should be. [-]
    notes : tuple of str
    """

    axis: str
    modes: tuple[Identified, ...]
    searches: tuple[tuple[Record, Search], ...]
    band: float
    notes: tuple[str, ...]

    @property
    def held(self) -> tuple[Identified, ...]:
        """Those that are identified."""
        return tuple(mode for mode in self.modes if not mode.problem)


def identify_modes(
    searches: Sequence[tuple[Record, Search]],
    axis: str,
    channel: str | None,
    machine: Machine | None = None,
    moves: Sequence[Commanded] = (),
) -> Identification:
    """Judge what decays show.

    Parameters
    ----------
    searches : sequence of (Record, Search)
    axis : str
        That moved.
    channel : str, optional
        That feels the axis; needed for participations.
    machine : Machine, optional
        Its own rapids, for participations.
    moves : sequence of Commanded
        The program's rapids, for participations: as many as each record shows motions, or all
        records together; all of them, or those of the axis alone.

    Returns
    -------
    Identification
    """
    notes: list[str] = []
    decays = [(n, r, d) for n, (r, s) in enumerate(searches) for d in s.decays]
    told = _told(searches, axis, machine, moves, notes)
    if told is not None:
        # What another axis left is none of this one's.
        decays = [(n, r, d) for n, r, d in decays if told[n][d.motion].axis == axis]
    groups = _groups([(k, ring) for k, (_, _, d) in enumerate(decays) for ring in d.taken.rings])
    found = []
    for group in groups:
        parts = None
        if told is not None and channel is not None and machine is not None:
            parts = _participations(group, decays, told, channel, machine, axis)
        found.append(_judged([ring for _, ring in group], len(decays), parts))
    scatter = [m.sd_frequency / m.frequency for m in found if not m.problem and m.decays > 1]
    band = max([LEAST_BAND, *(2.0 * s for s in scatter)])
    if not decays:
        notes.append("no free vibration was found behind any motion")
    if len(decays) == 1:
        notes.append("one decay only: nothing says how modes scatter; record more of them")
    return Identification(axis, tuple(found), tuple(searches), float(round(band, 3)), tuple(notes))


def _groups(rings: list[tuple[int, Ring]]) -> list[list[tuple[int, Ring]]]:
    """Rings that may be one mode's, the lowest frequency first."""
    groups: list[list[tuple[int, Ring]]] = []
    for k, ring in sorted(rings, key=lambda one: one[1].frequency):
        middle = np.median([r.frequency for _, r in groups[-1]]) if groups else 0.0
        if groups and ring.frequency - middle <= TOGETHER * middle:
            groups[-1].append((k, ring))
        else:
            groups.append([(k, ring)])
    joined: list[list[tuple[int, Ring]]] = []
    for group in groups:
        near = (
            bool(joined) and group[0][1].frequency < (1.0 + INSTEAD) * joined[-1][-1][1].frequency
        )
        if near and not {k for k, _ in joined[-1]} & {k for k, _ in group}:
            joined[-1] = joined[-1] + group
        else:
            joined.append(group)
    return joined


def _judged(rings: list[Ring], of: int, parts: tuple[float, float] | None) -> Identified:
    """One group of rings as a mode, or as none."""
    f = np.array([ring.frequency for ring in rings])
    zeta = np.array([ring.damping for ring in rings])
    sure_f = np.array([ring.sd_frequency for ring in rings])
    sure_zeta = np.array([ring.sd_damping for ring in rings])
    weight = 1.0 / (sure_f**2 + (f.std() if len(f) > 1 else 0.0) ** 2 + 1e-12)
    frequency = float((weight * f).sum() / weight.sum())
    weight = 1.0 / (sure_zeta**2 + (zeta.std() if len(f) > 1 else 0.0) ** 2 + 1e-12)
    damping = float((weight * zeta).sum() / weight.sum())
    n = len(rings)
    sd_f = float(max(f.std(ddof=1) if n > 1 else 0.0, np.median(sure_f)))
    sd_zeta = float(max(zeta.std(ddof=1) if n > 1 else 0.0, np.median(sure_zeta)))
    problem = ""
    often = n >= SHARE * of or n >= max(OFTEN, RARE * of)
    fading = np.array([2.0 * np.pi * ring.damping * ring.cycles for ring in rings])
    if float(np.median(fading)) < HUM:
        problem = "it does not fade: a fan, a pump or the mains, or too short a record"
    elif not often:
        problem = f"in {n} of {of} decays only"
    elif sd_f > MOST_SCATTER * frequency:
        problem = f"the decays disagree: {f.min():.3g} to {f.max():.3g} Hz"
    elif sd_zeta > MOST_DAMPING_SCATTER * damping:
        problem = f"its damping is not known: {zeta.min():.2g} to {zeta.max():.2g}"
    participation, sd = parts or (None, None)
    return Identified(
        frequency, damping, sd_f, sd_zeta, n, of,
        max(float(np.linalg.norm(ring.amplitude)) for ring in rings),
        float(np.median([ring.energy for ring in rings])),
        participation, sd, problem,
    )  # fmt: skip


def _told(
    searches: Sequence[tuple[Record, Search]],
    axis: str,
    machine: Machine | None,
    moves: Sequence[Commanded],
    notes: list[str],
) -> list[list[Commanded]] | None:
    """The rapid of every motion of every record; None where they do not fit together."""
    if machine is None or not moves:
        return None
    own = [move for move in moves if move.axis == axis]
    motions = [search.motions for _, search in searches]
    for told in (list(moves), own):
        if told and all(count == len(told) for count in motions):
            return [told] * len(motions)
        if told and sum(motions) == len(told):
            begins = np.concatenate([[0], np.cumsum(motions)])
            return [told[a:b] for a, b in pairwise(begins.tolist())]
    notes.append(
        f"{sum(motions)} motions were seen, and axis {axis} makes {len(own)} of the program's "
        f"{len(moves)} rapids: without knowing which is which there is no participation"
    )
    return None


def _participations(
    group: list[tuple[int, Ring]],
    decays: Sequence[tuple[int, Record, Decay]],
    told: list[list[Commanded]],
    channel: str,
    machine: Machine,
    axis: str,
) -> tuple[float, float] | None:
    """Measured over what the planner's formula gives for a participation of 1; and its scatter."""
    f = float(np.median([ring.frequency for _, ring in group]))
    zeta = float(np.median([ring.damping for _, ring in group]))
    pole = mode_poles([f], [zeta])
    rows = []
    for k, ring in group:
        number, record, decay = decays[k]
        if channel not in record.channels:
            return None
        length = told[number][decay.motion].length
        if length is None:
            continue
        share = np.zeros((1, len(AXES)))
        share[0, AXES.index(axis)] = abs(length)
        limits = conventional_limits(machine, share, np.ones(1, dtype=np.bool_))
        _, profile = todays_profiles(machine, limits, share)
        response = float(np.abs(profiles_response(profile, pole))[0, 0]) * abs(length)
        model = response / float(pole.imag[0]) * (2.0 * np.pi * f) ** 2
        measured = float(np.abs(ring.amplitude[record.channels.index(channel)]))
        late = decay.begin - decay.moved - float(profile.total[0])
        if late < -MOST_EARLY:
            # Before the rapid can have ended: this is not the rapid that the program has there.
            return None
        rows.append((model, measured * float(np.exp(-pole.real[0] * late))))
    strongest = max((model for model, _ in rows), default=0.0)
    ratio = np.array([seen / model for model, seen in rows if model >= WELL_STRUCK * strongest])
    if not len(ratio) or strongest <= 0.0:
        return None
    scatter = float(ratio.std(ddof=1)) if len(ratio) > 1 else float(ratio[0])
    value = float(np.median(ratio))
    return value, float(np.hypot(scatter, value * -float(pole.real[0]) * ONSET_UNSURE))
