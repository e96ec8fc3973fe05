"""Drawn machines, for tests that must hold on every machine and not only on ours.

Rule: a drawn machine is written as YAML and read back, so that it is legal by construction and the
reading is tested along the way.
"""

from __future__ import annotations

from hypothesis import currently_in_test_context, note
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, JERK_LIMITED, Machine


@st.composite
def machines(
    draw: st.DrawFn,
    *,
    axes: str | None = None,
    modes: tuple[int, int] = (0, 4),
    positioning: str | None = None,
    jerk_limited: bool | None = None,
    interval: float | None = None,
    planner: str | None = None,
) -> Machine:
    """Strategy for machines over the range that is found in workshops.

    Parameters
    ----------
    axes : str, optional
        Letters of the axes, for example ``"XYZ"``. Drawn: one to six of them.
    modes : tuple of int
        Least and largest number of modes per axis; structure modes come on top where the machine
        has two axes or more and this allows more than none.
    positioning : str, optional
        ``linear`` or ``independent``. Drawn where left out.
    jerk_limited : bool, optional
        Whether `rapid` has a jerk, or moves with trapezoidal velocity. Drawn for each axis.
    interval : float, optional
        Control command interval. Drawn between 0.0005 and 0.004. [s]
    planner : str, optional
        The profile of the control's own rapids, one of `gcodejerk.machine.PLANNERS`; the limits
        alone say it where left out. It decides `jerk_limited`.

    Returns
    -------
    SearchStrategy of Machine
        Limits, modes, damping ratios (0 to 0.2) and resolutions (1e-5 to 1e-2 mm) are drawn too;
        every mode is below 0.45 times the sampling rate.

    Examples
    --------
    >>> from hypothesis import given
    >>> @given(machine=machines(axes="XZ", modes=(1, 2)))
    ... def check(machine):
    ...     assert machine.axis_names == ("X", "Z")
    >>> check()
    """
    if planner is not None:
        jerk_limited = planner in (JERK_LIMITED, BELL)
    letters = axes if axes is not None else draw(_letters)
    dt = interval if interval is not None else draw(st.sampled_from(_INTERVALS))
    lines = [
        f"interval: {dt!r}",
        f"positioning: {positioning or draw(st.sampled_from(['linear', 'independent']))}",
        "axes:",
    ]
    for letter in letters:
        lines += draw(_axis(letter, modes, dt, jerk_limited, planner))
    if len(letters) > 1 and modes[1] > 0:
        lines += ["modes:", *draw(_structure_modes(letters, dt))]
    lines += [
        "design:",
        f"  band: {draw(st.sampled_from([0.0, 0.02, 0.05, 0.1]))}",
        f"  guard: {draw(st.sampled_from([0.0, 0.0, 0.0, 1.0]))}",
        f"  tolerance: {draw(_number(1e-4, 0.1))}",
        f"  minimum_length: {draw(_number(0.001, 0.5))}",
        f"  max_extension: {draw(st.sampled_from([0.0, 0.1, 0.5]))}",
    ]
    text = "\n".join(lines) + "\n"
    if currently_in_test_context():
        note(f"drawn.yaml:\n{text}")
    return Machine.loads(text, name="drawn.yaml")


_INTERVALS = [0.0005, 0.001, 0.002, 0.004]
_letters = st.lists(st.sampled_from(AXES), min_size=1, max_size=6, unique=True).map("".join)


def _number(low: float, high: float) -> st.SearchStrategy[str]:
    """Text of a number of four digits, drawn evenly over the orders of magnitude."""
    steps = st.integers(0, 1000)
    return steps.map(lambda step: f"{float(f'{low * (high / low) ** (step / 1000):.4g}')!r}")


@st.composite
def _axis(
    draw: st.DrawFn, letter: str, modes: tuple[int, int], dt: float, jerk_limited: bool | None,
    planner: str | None,
) -> list[str]:  # fmt: skip
    velocity = draw(_number(5.0, 2000.0))
    acceleration = draw(_number(100.0, 30000.0))
    rapid = f"velocity: {velocity}, acceleration: {acceleration}"
    jerk = None
    if jerk_limited or (jerk_limited is None and draw(st.booleans())):
        # Full acceleration after 2 to 100 ms.
        jerk = float(acceleration) / float(draw(_number(0.002, 0.1)))
        rapid += f", jerk: {jerk:.4e}"
    if planner is not None:
        rapid += f", planner: {planner}"
    reserve = float(draw(st.sampled_from(["1.0", "1.2", "2.0", "3.0"])))
    limit = f"acceleration: {reserve * float(acceleration)!r}"
    if draw(st.booleans()):
        # Never below what rapids have, or T_SUM could not be kept.
        least = jerk or reserve * float(acceleration) / 0.02
        limit += f", jerk: {least * draw(st.sampled_from([1.001, 3.0, 10.0, 30.0])):.4e}"
    lines = [
        f"  {letter}:",
        f"    resolution: {draw(st.sampled_from(['1.0e-5', '1.0e-4', '0.001', '0.002', '0.01']))}",
        f"    rapid: {{{rapid}}}",
        f"    limit: {{{limit}}}",
    ]
    if draw(st.booleans()):
        lines.append(f"    travel: [-{draw(_number(10.0, 3000.0))}, {draw(_number(1.0, 3000.0))}]")
    count = draw(st.integers(*modes))
    if count:
        lines.append("    modes:")
        lines += [f"      - {{{draw(_mode(dt))}}}" for _ in range(count)]
    return lines


@st.composite
def _structure_modes(draw: st.DrawFn, letters: str, dt: float) -> list[str]:
    lines = []
    for _ in range(draw(st.integers(0, 2))):
        shared = draw(st.lists(st.sampled_from(letters), min_size=2, unique=True))
        amounts = ", ".join(
            f"{axis}: {draw(st.sampled_from(['', '-']))}{draw(_number(0.05, 2.0))}"
            for axis in shared
        )
        mode = draw(_mode(dt, f"{{{amounts}}}"))
        lines.append(f"  - {{{mode}}}")
    return lines or ["  []"]


@st.composite
def _mode(draw: st.DrawFn, dt: float, participation: str | None = None) -> str:
    damping = draw(st.one_of(st.just("0.0"), _number(0.001, 0.2)))
    return (
        f"frequency: {draw(_number(4.0, min(400.0, 0.45 / dt)))}, damping: {damping}, "
        f"participation: {participation or draw(_number(0.05, 2.0))}"
    )
