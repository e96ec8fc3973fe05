"""Contours that cycles run by themselves (G71 to G73, and G70 once more): what their blocks leave.

Rule: a block of a contour does not run where it stands, but when its cycle does, and G70 runs it
again. Whether its modes hold behind the cycle, no source tells: so those are known that are the
same either way.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

from gcodejerk.nc.interpreter.modal import FIELDS, NAN, State, alike, join
from gcodejerk.nc.text.block import Block
from gcodejerk.reasons import Reason


class Contours:
    """The contours of a program, as far as it was read."""

    def __init__(self) -> None:
        self.end: float | None = None
        """N of the last block of the one that is being read."""
        self._before: State | None = None
        """What was in force in front of it."""
        self._seen: dict[float, list[tuple[State, State]]] = defaultdict(list)
        """By the N of its last block: what was in force in front of a contour, and at its end."""

    def begin(self, values: Mapping[str, float]) -> None:
        """Begin one, where a block names its ends; within another, nothing begins."""
        if self.end is None:
            self.end = values.get("Q")

    def take(self, state: State, block: Block) -> State:
        """Take a block of a contour, or the one that begins it.

        Parameters
        ----------
        state : State
            What the modes would be if blocks of contours ran where they stand; changed.
        block : Block
            The last one ends the contour.

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
        end = self.end
        if end is None or not any(w.letter == "N" and w.value == end for w in block.words):
            return state
        both = self._before, state
        self._seen[end].append(both)
        self.end = self._before = None
        return join(*both)

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
