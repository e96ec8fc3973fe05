"""Contours that cycles run by themselves (G71 to G73, and G70 once more): what their blocks leave.

Rule: a block of a contour does not run where it stands, but when its cycle does, and G70 runs it
again. Whether its modes hold behind the cycle, no source tells: so those are known that are the
same either way.
"""

from __future__ import annotations

from collections import defaultdict

from gcodejerk.nc.interpreter.modal import FIELDS, NAN, State, alike, join
from gcodejerk.reasons import Reason


class Contours:
    """The contours of a program, as far as it was read."""

    def __init__(self) -> None:
        self._before: State | None = None
        """What was in force in front of the one that is being read."""
        self._seen: dict[float, list[tuple[State, State]]] = defaultdict(list)
        """By the N of its last block: what was in force in front of a contour, and at its end."""

    @property
    def open(self) -> bool:
        """Whether one has begun, and not ended."""
        return self._before is not None

    def take(self, state: State, end: float | None) -> State:
        """Take a block of a contour, and the state that it would leave.

        Parameters
        ----------
        state : State
            What the modes would be if blocks of contours ran where they stand; changed.
        end : float or None
            N of the last block, if this is that one; else None.

        Returns
        -------
        State
            The same, or what is known behind the contour.
        """
        state.forget_positions()
        state.put("motion", None)
        state.put("feed", NAN)
        if self._before is None:
            self._before = state.copy()
        if end is None:
            return state
        before, self._before = self._before, None
        self._seen[end].append((before, state))
        return join(before, state)

    def finish(self, state: State, end: float) -> State:
        """Run a contour once more (G70); one that was not seen may leave any mode."""
        contours = self._seen.get(end, []) if end == end else []
        if not contours:
            state.forget(Reason.NOT_FOLLOWED)
        for before, after in contours:
            state = join(state, _changed(state, before, after))
        return state


def _changed(state: State, before: State, after: State) -> State:
    """A state with what has become of two others whatever they differ in."""
    other = state.copy()
    for field in FIELDS:
        a, b = getattr(before, field.name), getattr(after, field.name)
        if field.kind not in ("constant", "note") and not alike(field, a, b):
            setattr(other, field.name, b)
    return other
