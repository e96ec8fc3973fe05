"""The HAL file of each form, filled in for one configuration.

The files beside this module are HAL commands with a few places to fill: `@SCRIPT@`, the M code;
`@DEPTH@`, of the FIFO; `@RATE@`, periods per second; `@each TEXT@`, TEXT once for each joint, its
number in the place of N; and for the form `position` the order of the functions and the joints'
own part, which depend on where the configuration's HAL has its drives. The override guard has a
file of its own: `@FEED@` and `@RAPID@` are the signals of the overrides.

Rule: stock components only, and each once: HAL loads a component a single time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
SCRIPT = "M152"
FORMS = ("adaptive-feed", "position")
GUARD = "guard"
"""No form of streams: what tells programs with `override_guard` where the overrides stand."""
DEPTH = 60_000
"""Lines of the FIFO; the longest rapid has to fit."""
_BOTH = ("motion.analog-out-03", "motion.digital-in-03", "motion.feed-inhibit")
TAKEN = {
    "adaptive-feed": (*_BOTH, "motion.adaptive-feed"),
    "position": (*_BOTH, "motion.enable"),
    GUARD: ("motion.analog-in-03",),
}
"""Pins that each needs for itself."""
OVERRIDES = {"@FEED@": "halui.feed-override.value", "@RAPID@": "halui.rapid-override.value"}
"""Pins of halui that the guard reads."""
SAME = 1e-6
"""Two positions this close are one [machine units]."""
_EACH = re.compile(r"@each ([^@]*)@")
_LOADED = re.compile(r"^loadrt (\w+)", re.MULTILINE)
_JOINTS_OWN = """\
# joint {n}: axis {letter}
setp gcodejerk-same-{n}.difference {same:g}
setp gcodejerk-there-{n}.difference {same:g}
setp gcodejerk-off-{n}.gain1 -1
unlinkp joint.{n}.motor-pos-cmd
unlinkp joint.{n}.motor-pos-fb
net gcodejerk-own-{n} joint.{n}.motor-pos-cmd => gcodejerk-start-{n}.in0 gcodejerk-drive-{n}.in0
net gcodejerk-own-{n} => gcodejerk-same-{n}.in1 gcodejerk-there-{n}.in1 gcodejerk-off-{n}.in0
net gcodejerk-keep => gcodejerk-start-{n}.sel
net gcodejerk-from-{n} gcodejerk-start-{n}.out => gcodejerk-start-{n}.in1
net gcodejerk-from-{n} => gcodejerk-played-{n}.in0 gcodejerk-goal-{n}.in0
net gcodejerk-way-{n} streamer.0.pin.{pin} => gcodejerk-part-{n}.in1 gcodejerk-goal-{n}.in1
net gcodejerk-moved-{n} gcodejerk-part-{n}.out => gcodejerk-played-{n}.in1
net gcodejerk-to-{n} gcodejerk-goal-{n}.out => gcodejerk-there-{n}.in2
net gcodejerk-at-{n} gcodejerk-played-{n}.out => gcodejerk-drive-{n}.in1 gcodejerk-same-{n}.in2
net gcodejerk-keep => gcodejerk-drive-{n}.sel
net {command} gcodejerk-drive-{n}.out => gcodejerk-off-{n}.in1
net {feedback} => gcodejerk-seen-{n}.in0 gcodejerk-honest-{n}.in0
net gcodejerk-offset-{n} gcodejerk-off-{n}.out => gcodejerk-seen-{n}.in1
net gcodejerk-corrected-{n} gcodejerk-seen-{n}.out => gcodejerk-honest-{n}.in1
net gcodejerk-enabled => gcodejerk-honest-{n}.sel
net gcodejerk-feedback-{n} gcodejerk-honest-{n}.out => joint.{n}.motor-pos-fb
net gcodejerk-same-{n} gcodejerk-same-{n}.out => gcodejerk-equal.in-{k}
net gcodejerk-there-{n} gcodejerk-there-{n}.out => gcodejerk-arrived.in-{k}
"""
_ORDER = """
next done depth full type on waits runs start play advance streamer.0 blocked finished idle left
late stopped brake hold @start-N @goal-N @there-N arrived way speed clear share rest
@part-N @played-N @same-N equal release fault lost good @drive-N @off-N @seen-N @honest-N
"""


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint whose drive gets the samples of an axis."""

    number: int
    letter: str
    """X, Y or Z."""
    command: str
    """Signal that has the joint's command."""
    feedback: str
    """Signal that the joint's feedback comes from."""


def template(form: str) -> str:
    """The HAL file of a form with its places unfilled."""
    return (HERE / f"{form}.hal").read_text()


def components(form: str) -> list[str]:
    """Realtime components that the HAL file of a form loads."""
    return _LOADED.findall(template(form))


def adaptive_feed(script: str) -> str:
    """The HAL file of the form `adaptive-feed`.

    Parameters
    ----------
    script : str
        Path of the M code.

    Returns
    -------
    str
    """
    return template("adaptive-feed").replace("@DEPTH@", str(DEPTH)).replace("@SCRIPT@", script)


def guard(signals: dict[str, str]) -> str:
    """The HAL file of the override guard.

    Parameters
    ----------
    signals : dict
        Pin of halui -> the signal that it is linked to already, where it is.

    Returns
    -------
    str
    """
    text = template(GUARD)
    for mark, pin in OVERRIDES.items():
        own = f"gcodejerk-{mark.strip('@').lower()}-override"
        text = text.replace(mark, signals.get(pin, own))
    return text


def position(script: str, joints: list[Joint], interval: float, behind: int) -> str:
    """The HAL file of the form `position`.

    Parameters
    ----------
    script : str
        Path of the M code.
    joints : list of Joint
        Two or three; X, Y and Z.
    interval : float
        Of the servo thread [s].
    behind : int
        Place of motion-controller among the functions of the servo thread, counted from 1.

    Returns
    -------
    str
    """
    numbers = [joint.number for joint in joints]

    def each(match: re.Match[str]) -> str:
        separator = " " if match[1].startswith("=>") else ","
        return separator.join(match[1].replace("N", str(n)) for n in numbers)

    functions: list[str] = []
    for name in _ORDER.split():
        if name.startswith("@"):
            functions += [f"gcodejerk-{name[1:].replace('N', str(n))}" for n in numbers]
        else:
            functions.append(name if "." in name else f"gcodejerk-{name}")
    order = "".join(
        f"addf {name} servo-thread {behind + 1 + k}\n" for k, name in enumerate(functions)
    )
    axes = "".join(
        _JOINTS_OWN.format(
            n=joint.number,
            letter=joint.letter,
            pin=3 + "XYZ".index(joint.letter),
            k=k,
            same=SAME,
            command=joint.command,
            feedback=joint.feedback,
        )
        for k, joint in enumerate(joints)
    )
    every = 1 << ((1 << len(joints)) - 1)  # all inputs of a lut5
    axes += (
        f"setp gcodejerk-equal.function {every:#x}\nsetp gcodejerk-arrived.function {every:#x}\n"
    )
    axes += (
        "net gcodejerk-is-equal gcodejerk-equal.out\nnet gcodejerk-is-there gcodejerk-arrived.out\n"
    )
    text = _EACH.sub(each, template("position"))
    for mark, value in (
        ("@DEPTH@", str(DEPTH)),
        ("@SCRIPT@", script),
        ("@RATE@", repr(1.0 / interval)),
        ("@functions@\n", order),
        ("@axes@\n", axes),
    ):
        text = text.replace(mark, value)
    return text
