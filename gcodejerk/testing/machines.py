"""Drawn machines, for tests that must hold on every machine and not only on ours.

Rule: a drawn machine is written as YAML and read back, so that it is legal by construction and the
reading is tested along the way.
"""

from __future__ import annotations

from hypothesis import currently_in_test_context, note
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, FILTERS, JERK_LIMITED, LAWS, Machine


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
    filtered: bool | None = False,
    path: bool | None = None,
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
        alone say it where left out. It decides `jerk_limited`. What a planner of
        `gcodejerk.machine.LAWS` needs besides is drawn.
    filtered : bool, optional
        Whether an average or a shaper acts behind it, the same for all axes; None: drawn.
    path : bool, optional
        Whether limits of the path bound the linear axes, where rapids are straight; None: drawn.

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
        jerk_limited = planner in (JERK_LIMITED, BELL) or "jerk" in LAWS.get(planner, ())
    shared = "" if planner is None else draw(_shared(planner))
    if filtered or (filtered is None and draw(st.booleans())):
        shared += f", filter: {{{draw(_filter())}}}"
    letters = axes if axes is not None else draw(_letters)
    dt = interval if interval is not None else draw(st.sampled_from(_INTERVALS))
    goes = positioning or draw(st.sampled_from(["linear", "independent"]))
    lines = [f"interval: {dt!r}", f"positioning: {goes}"]
    slides = not set(letters) <= set("ABC")
    if goes == "linear" and slides and (path or (path is None and draw(st.integers(0, 2)) == 0)):
        lines += draw(_path())
    lines.append("axes:")
    for letter in letters:
        lines += draw(_axis(letter, modes, dt, jerk_limited, planner, shared))
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


@st.composite
def _path(draw: st.DrawFn) -> list[str]:
    """What bounds all linear axes together."""
    acceleration = draw(_number(100.0, 30000.0))
    rapid = [f"velocity: {draw(_number(5.0, 2000.0))}"] if draw(st.booleans()) else []
    if not rapid or draw(st.booleans()):
        rapid.append(f"acceleration: {acceleration}")
    lines = ["path:", f"  rapid: {{{', '.join(rapid)}}}"]
    if len(rapid) > 1 and draw(st.booleans()):
        reserve = float(draw(st.sampled_from(["1.2", "2.0", "3.0"])))
        lines.append(f"  limit: {{acceleration: {reserve * float(acceleration)!r}}}")
    return lines


_INTERVALS = [0.0005, 0.001, 0.002, 0.004]
_letters = st.lists(st.sampled_from(AXES), min_size=1, max_size=6, unique=True).map("".join)


def _number(low: float, high: float) -> st.SearchStrategy[str]:
    """Text of a number of four digits, drawn evenly over the orders of magnitude."""
    steps = st.integers(0, 1000)
    return steps.map(lambda step: f"{float(f'{low * (high / low) ** (step / 1000):.4g}')!r}")


@st.composite
def _axis(
    draw: st.DrawFn, letter: str, modes: tuple[int, int], dt: float, jerk_limited: bool | None,
    planner: str | None, shared: str,
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
        rapid += f", planner: {planner}" + draw(_law(planner, float(velocity), float(acceleration)))
    rapid += shared
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
def _law(draw: st.DrawFn, planner: str, velocity: float, acceleration: float) -> str:
    """Quantities of an axis that a law needs."""
    out = []
    for name in LAWS.get(planner, ()):
        if name in ("jerk", "overshoot", "notch"):
            continue
        if name == "changeover":
            value = velocity * float(draw(_number(0.1, 1.5)))
        elif name in ("deceleration", "upper_acceleration", "upper_deceleration"):
            value = acceleration * float(draw(_number(0.3, 1.0)))
        elif name == "first_average":
            value = min(velocity / acceleration * float(draw(_number(1.0, 3.0))), 2.0)
        else:
            value = float(draw(_number(0.002, 0.1)))
        out.append(f", {name}: {value!r}")
    return "".join(out)


@st.composite
def _shared(draw: st.DrawFn, planner: str) -> str:
    """Quantities that a law has one of."""
    ranges = {"overshoot": (1.25, 1.875), "notch": (10.0, 120.0)}
    names = [name for name in LAWS.get(planner, ()) if name in ranges]
    return "".join(f", {name}: {draw(_number(*ranges[name]))}" for name in names)


@st.composite
def _filter(draw: st.DrawFn) -> str:
    kind = draw(st.sampled_from(FILTERS))
    if kind in ("average", "triangle"):
        return f"type: {kind}, time: {draw(_number(0.001, 0.05))}"
    damping = draw(st.sampled_from(["0.0", "0.05", "0.1"]))
    return f"type: {kind}, frequency: {draw(_number(10.0, 200.0))}, damping: {damping}"


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
