"""Limits that a program sets, against those that its streams rest on.

Rule: one that is not known to be at least what the machine file states keeps rapids as they are,
until another is set. grbl may refuse to set another: there it is so for good. One of the path
bounds all axes together: which rapids it keeps, their direction says.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import LINEAR, Dialect
from gcodejerk.nc.dialects.limits import PERCENT, SETTING, Limit
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.text.block import Name

LIMIT = "limit of "
"""How the names of these bars begin."""
Stated = Mapping[str, tuple[float, float, float]]
_QUANTITIES = ("velocity", "acceleration", "jerk")
_NUMBER = re.compile(rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_KEY = re.compile(rb"([A-Z_]+)[ \t]*=[ \t]*([^ \t;]*)", re.IGNORECASE)
_OF_AXIS = re.compile(rb"[ \t]*\[([^\]]*)\][ \t]*=[ \t]*(.*)", re.DOTALL)


def set_by_code(
    state: State, m: int, values: Mapping[str, float], dialect: Dialect, stated: Stated
) -> bool:
    """Take what an M code sets; whether that is too low, or may be."""
    table = dialect.limits.get(f"M{m}", {})
    return _put(state, ((limit, values[w]) for w, limit in table.items() if w in values), stated)


def set_by_names(state: State, names: Iterable[Name], dialect: Dialect, stated: Stated) -> bool:
    """Take what named words set (``ACC[X]=50``, ``SET_VELOCITY_LIMIT ACCEL=500``, ``SOFT``)."""
    low = False
    for name in names:
        table = dialect.limits.get(name.name, {})
        if (mode := dialect.limit_modes.get(name.name)) is not None:
            keeps = mode.keeps == "stated" or (mode.keeps == "jerk" and _has_jerk(stated))
            _bar(state, {LIMIT + mode.thing: not keeps})
            low |= not keeps
        if PERCENT in table:
            match = _OF_AXIS.fullmatch(name.arguments)
            axis = match[1].decode("latin-1").strip().upper() if match else ""
            bar = f"{LIMIT}{table[PERCENT].quantity} {axis} in percent"
            keeps = match is not None and _number(match[2]) >= 100.0
            _bar(state, {bar: not keeps})
            low |= not keeps
        elif table:
            given = [(k.decode().upper(), _number(n)) for k, n in _KEY.findall(name.arguments)]
            low |= _put(state, ((table[k], n) for k, n in given if k in table), stated)
    return low


def set_by_setting(state: State, text: bytes, dialect: Dialect, stated: Stated) -> bool:
    """Take a line that is a setting of the control (``$120=500``): it counts, or is refused."""
    table = dialect.limits.get(SETTING)
    if table is None or not text.startswith(b"$"):
        return False
    number, _, value = text[1:].upper().translate(None, b" \t").partition(b"=")
    if number == b"RST" or b"RATE" in number or b"ACCEL" in number:
        _bar(state, {LIMIT + "anything": True})
        return True
    limit = table.get(number.decode("latin-1"))
    if limit is None or limit_is_kept(limit, _number(value), stated):
        return False
    return _put(state, [(limit, NAN)], stated)


def _has_jerk(stated: Stated) -> bool:
    """Whether the machine file bounds the jerk of all axes."""
    return bool(stated) and all(jerk < np.inf for _, _, jerk in stated.values())


def _put(state: State, found: Iterable[tuple[Limit, float]], stated: Stated) -> bool:
    """Enter limits: of several for one thing, the lowest counts; whether any is too low."""
    kept: dict[str, bool] = {}
    paths: dict[str, float] = {}
    low = False
    for limit, value in found:
        if limit.axis:
            bar = f"{LIMIT}{limit.quantity} {limit.axis}"
            kept[bar] = kept.get(bar, True) and limit_is_kept(limit, value, stated)
        else:
            lowest = paths.get(limit.quantity, np.inf)
            number = value * limit.scale if stated else NAN
            paths[limit.quantity] = NAN if number != number else min(lowest, number)
    for quantity, number in paths.items():
        at = _QUANTITIES.index(quantity)
        of_all = sum(of[at] ** 2 for of in stated.values()) ** 0.5
        if LINEAR.issuperset(stated):
            of_all = min(of_all, state.along[at])
        enough = number >= of_all * _NEAR
        others = {name: lowest for name, lowest in state.path_limits.items() if name != quantity}
        state.put("path_limits", others if enough else {**others, quantity: number})
        low |= not enough
    _bar(state, {bar: not enough for bar, enough in kept.items()})
    return low or not all(kept.values())


def _bar(state: State, low: Mapping[str, bool]) -> None:
    """Begin bars, or end them as if they had never been: a macro behind them may set no other."""
    if low:
        bars = {name: on for name, on in state.bars.items() if name not in low}
        state.put("bars", {**bars, **{name: True for name, on in low.items() if on}})


def limit_is_kept(limit: Limit, value: float, stated: Stated) -> bool:
    """Whether streams certainly stay within a limit of an axis."""
    if not stated:
        return False
    at = _QUANTITIES.index(limit.quantity)
    return limit.axis not in stated or value * limit.scale >= stated[limit.axis][at] * _NEAR


def beyond_path(state: State, moved: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which straight moves may be beyond a limit of the path.

    On a line, the axis that is first at its own limit bounds all, and so does what the machine file
    says of the path; axes that run on their own may all be there at once. Of linear and rotary axes
    together nobody says what the path is.

    Parameters
    ----------
    state : State
        In force.
    moved : ndarray, shape (n, 9)
        By how much each axis moves; NaN where that does not matter. [mm] or [deg]

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    beyond = np.zeros(len(moved), dtype=np.bool_)
    way = np.abs(np.nan_to_num(moved))
    ours = np.array([axis in state.limits for axis in AXES])
    linear = np.array([axis in LINEAR for axis in AXES])
    mixed = (way[:, linear] > 0.0).any(axis=1) & (way[:, ~linear] > 0.0).any(axis=1)
    for quantity, number in state.path_limits.items():
        at = _QUANTITIES.index(quantity)
        most = np.array([state.limits[a][at] if a in state.limits else 0.0 for a in AXES])
        if state.straight:
            length = np.sqrt((way**2).sum(axis=1))[:, np.newaxis]
            with np.errstate(divide="ignore", invalid="ignore"):
                reach = np.where((way > 0.0) & ours, most * length / way, np.inf).min(axis=1)
            reach[~(way[:, ours] > 0.0).any(axis=1)] = 0.0
            slides = (way[:, linear] > 0.0).any(axis=1)
            reach = np.where(slides, np.minimum(reach, state.along[at]), reach)
        else:
            reach = np.sqrt((most**2 * (way > 0.0)).sum(axis=1))
        beyond |= mixed | ~(number >= reach * _NEAR)
    return beyond


_NEAR = 1.0 - 1e-9


def _number(text: bytes) -> float:
    """A number; NaN of what is computed, or followed by anything."""
    bare = text.split(b";")[0].strip(b" \t")
    return float(bare) if _NUMBER.fullmatch(bare) else NAN
