"""What `identify` gives to other programs: JSON records, and the block for a machine file.

Rule: what was not identified is null, or a comment; never a number.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gcodejerk.identification import Identification, Identified, Peaks

Json = dict[str, Any]
SHAPES_ONLY = (
    "# participation: ?   # not identified: without the key planning takes 1, and um are not true"
)


def identification_record(found: Identification) -> Json:
    """Modes from records as JSON has them.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    dict
    """
    return {
        "axis": found.axis,
        "modes": [_mode(mode) for mode in found.modes],
        "band": found.band if found.held else None,
        "notes": list(found.notes),
        "records": [
            {
                "name": record.name,
                "rate": record.rate,
                "duration": record.duration,
                "channels": list(record.channels),
                "noise": [float(x) for x in search.noise],
                "motions": search.motions,
                "notes": [*record.notes, *search.notes],
                "decays": [
                    {
                        "moved": decay.moved,
                        "begin": decay.begin,
                        "end": decay.end,
                        "unexplained": decay.taken.unexplained,
                        "modes": [
                            {
                                "frequency": ring.frequency,
                                "sd_frequency": ring.sd_frequency,
                                "damping": ring.damping,
                                "sd_damping": ring.sd_damping,
                                "amplitude": [abs(complex(x)) for x in ring.amplitude],
                                "energy": ring.energy,
                                "cycles": ring.cycles,
                                "orders": [ring.orders[0], ring.orders[-1]],
                            }
                            for ring in decay.taken.rings
                        ],
                    }
                    for decay in search.decays
                ],
            }
            for record, search in found.searches
        ],
    }


def _mode(mode: Identified) -> Json:
    return {
        "identified": not mode.problem,
        "problem": mode.problem or None,
        "frequency": mode.frequency,
        "sd_frequency": mode.sd_frequency,
        "damping": mode.damping,
        "sd_damping": mode.sd_damping,
        "participation": mode.participation,
        "sd_participation": mode.sd_participation,
        "decays": mode.decays,
        "of": mode.of,
        "largest_acceleration": mode.amplitude,
        "energy": mode.energy,
    }


def peaks_record(found: Sequence[Peaks], axis: str) -> Json:
    """Peaks of spectra as JSON has them.

    Parameters
    ----------
    found : sequence of Peaks
    axis : str

    Returns
    -------
    dict
    """
    return {
        "axis": axis,
        "spectra": [
            {
                "name": one.spectrum.name,
                "notes": list(one.spectrum.notes),
                "peaks": [
                    {
                        "frequency": peak.frequency,
                        "uncertain": peak.uncertain,
                        "share": peak.share,
                        "damping": None,
                        "damping_at_most": peak.most_damping,
                        "damping_without_window": peak.without_window,
                    }
                    for peak in one.peaks
                ],
            }
            for one in found
        ],
    }


def modes_block(found: Identification) -> str:
    """The block for the axis in a machine file, commented.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    str
        YAML; comments only where nothing was identified.
    """
    names = ", ".join(record.name for record, _ in found.searches)
    lines = [f"# identified from {names}".replace("\n", " ")]
    for mode in found.modes:
        if mode.problem:
            lines.append(f"# not identified: {mode.frequency:.4g} Hz, {mode.problem}")
    if not found.held:
        return "\n".join([*lines, "# no mode was identified: nothing to write here", ""])
    lines += ["axes:", f"  {found.axis}:", "    modes:"]
    for mode in found.held:
        lines.append(
            f"      - frequency: {mode.frequency:.5g}".ljust(34)
            + f"# Hz; +- {_small(mode.sd_frequency)}, from {mode.decays} of {mode.of} decays"
        )
        lines.append(
            f"        damping: {mode.damping:.3g}".ljust(34) + f"# +- {_small(mode.sd_damping)}"
        )
        if mode.participation is None or mode.sd_participation is None:
            lines.append(f"        {SHAPES_ONLY}")
        else:
            lines.append(
                f"        participation: {mode.participation:.3g}".ljust(34)
                + f"# +- {_small(mode.sd_participation)}; its size, no sign"
            )
    lines += ["design:", f"  band: {found.band:g}".ljust(34) + "# twice what frequencies scatter"]
    return "\n".join([*lines, ""])


def spectrum_block(found: Sequence[Peaks], axis: str) -> str:
    """What to write into a machine file for a measured spectrum, and its peaks as comments.

    Parameters
    ----------
    found : sequence of Peaks
    axis : str

    Returns
    -------
    str
        YAML.
    """
    first = found[0]
    lines = []
    for one in found:
        for peak in one.peaks:
            lines.append(
                f"# {one.spectrum.name}: {peak.frequency:.1f} Hz +- {peak.uncertain:.1f}, damping "
                f"{at_most(peak.most_damping)}"
            )
    lines += ["axes:", f"  {axis}:", f"    spectrum: {first.spectrum.name}"]
    lines += [f"    # or: {one.spectrum.name}" for one in found[1:]]
    return "\n".join([*lines, ""])


def at_most(damping: float | None) -> str:
    """What a width says of a damping ratio."""
    return "not known" if damping is None else f"at most {damping:.2g}"


def _small(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"
