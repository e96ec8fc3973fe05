"""What the user states of a machine: axes and modes as words of one option or one answer."""

from __future__ import annotations

import shlex

from gcodejerk.axes import AXES
from gcodejerk.errors import MachineError
from gcodejerk.machine.problems import nearest
from gcodejerk.machine.sources.draft import Draft, Fact
from gcodejerk.machine.sources.quantity import quantity

AXIS_KEYS = ("velocity", "acceleration", "jerk", "resolution", "travel", "wrap")
WRAPS = ("none", "shortest", "sign")
STATED = "as stated"
_AXIS_EXAMPLE = "for example --axis 'X velocity=36m/min acceleration=0.4g travel=-500:50'"
_MODE_EXAMPLE = "for example --mode 'Z frequency=30 damping=0.02 participation=1'"


def stated_axis(draft: Draft, text: str) -> None:
    """Put an axis as the user states it into a draft; what was read before gives way.

    Parameters
    ----------
    draft : Draft
        Is changed.
    text : str
        `X velocity=36m/min acceleration=0.4g jerk=50m/s^3 travel=-500:50 resolution=0.001`.

    Raises
    ------
    MachineError
        A word is not understood, or a unit is missing.
    """
    name, words = _words(text, "--axis", _AXIS_EXAMPLE)
    axis = draft.axis(name)
    for key, value in words.items():
        what = f"{key} of {name}"
        if key == "travel":
            ends = value.split(":")
            if len(ends) != 2:
                raise MachineError(f"{what} is {value!r}, expected LOWEST:HIGHEST", _AXIS_EXAMPLE)
            low, high = (quantity(end, "length", what, axis.rotary) for end in ends)
            if not low < high:
                raise MachineError(
                    f"{what} goes from {low:g} to {high:g}", "write the lowest position first"
                )
            axis.travel, axis.travel_origin = (low, high), STATED
        elif key == "wrap":
            if value not in WRAPS:
                raise MachineError(f"{what} is {value!r}", f"expected {', '.join(WRAPS)}")
            axis.wrap = value
        elif key in AXIS_KEYS:
            kind = "length" if key == "resolution" else key
            number = quantity(value, kind, what, axis.rotary)
            if number <= 0.0:
                raise MachineError(f"{what} is {value!r}", "expected a number above 0")
            setattr(axis, key, Fact(number, f"{STATED}, {value}"))
        else:
            raise _unknown(key, AXIS_KEYS, "--axis", _AXIS_EXAMPLE)


def stated_mode(draft: Draft, text: str) -> None:
    """Put a mode of an axis as the user states it into a draft.

    Parameters
    ----------
    draft : Draft
        Is changed; it has the axis.
    text : str
        `Z frequency=30 damping=0.02 participation=1 name=rocking`; damping 0.03 and participation 1
        are assumed where they are left out, and say so.

    Raises
    ------
    MachineError
        As for `stated_axis`; or the machine has no such axis.
    """
    name, words = _words(text, "--mode", _MODE_EXAMPLE)
    if name not in draft.axes:
        raise MachineError(
            f"--mode {text!r}: the machine has no axis {name}",
            f"it has {', '.join(axis.name for axis in draft.ordered()) or 'none yet'}",
        )
    keys = ("frequency", "damping", "participation", "name")
    for key in words:
        if key not in keys:
            raise _unknown(key, keys, "--mode", _MODE_EXAMPLE)
    if "frequency" not in words:
        raise MachineError(f"--mode {text!r} has no frequency", _MODE_EXAMPLE)
    frequency = quantity(words["frequency"], "frequency", f"frequency of the mode of {name}")
    damping = _ratio(words.get("damping", "0.03"), f"damping of the mode of {name}")
    share = _ratio(words.get("participation", "1"), f"participation of {name}")
    if frequency <= 0.0 or not 0.0 <= damping < 1.0:
        raise MachineError(
            f"--mode {text!r}: expected a frequency above 0 and a damping ratio of 0 to below 1",
            _MODE_EXAMPLE,
        )
    assumed = [key for key in ("damping", "participation") if key not in words]
    origin = STATED + (f"; ASSUMED: {' and '.join(assumed)}" if assumed else "")
    title = words.get("name", f"{frequency:g} Hz")
    draft.axis(name).modes.append((title, frequency, damping, share, origin))


def _words(text: str, option: str, example: str) -> tuple[str, dict[str, str]]:
    """The axis in front, and the pairs behind it."""
    try:
        parts = shlex.split(text)
    except ValueError as error:
        raise MachineError(f"{option} {text!r}: {error}", example) from None
    name = parts[0].rstrip(":").upper() if parts else ""
    if len(name) != 1 or name not in AXES:
        raise MachineError(
            f"{option} {text!r} does not begin with an axis, one of {', '.join(AXES)}", example
        )
    words: dict[str, str] = {}
    for part in parts[1:]:
        key, sign, value = part.partition("=")
        if not sign or not value:
            raise MachineError(f"{option} {text!r}: {part!r} is not KEY=VALUE", example)
        words[key] = value
    return name, words


def _ratio(text: str, what: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise MachineError(f"{what} is {text!r}, expected a number", _MODE_EXAMPLE) from None


def _unknown(key: str, known: tuple[str, ...], option: str, example: str) -> MachineError:
    close = nearest(key, known)
    hint = f"; did you mean {close!r}?" if close else ""
    return MachineError(f"{option} knows no {key!r}{hint}", f"it has {', '.join(known)}; {example}")
