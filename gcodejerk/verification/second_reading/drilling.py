"""Where a block of a drilling cycle ends, for the second reading."""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import PLANES
from gcodejerk.nc.dialects.gcodes import G17, G40, G80, G90, G98, G99
from gcodejerk.verification.second_reading.coding import Codes
from gcodejerk.verification.second_reading.reading import NAN
from gcodejerk.verification.second_reading.sorting import Sorted


class Drilling(Codes):
    """Follows drilling cycles."""

    def _cycle_of(self, block: Sorted) -> int | None:
        """Code of the canned cycle that a block belongs to."""
        dialect, code = self.dialect, block.g.get("cycle")
        if code is not None and code not in dialect.cycles:
            self.cycle, code = None, None
        if not dialect.drilling.own_group and self.g.get("motion") in dialect.cycles:
            code = self.g["motion"]
        return code or self.cycle

    def _drill(self, code: int, block: Sorted) -> None:
        """Where a block of a drilling cycle ends, if it is one that is followed."""
        values, drilling = block.values, self.dialect.drilling
        plane = self.g.get("plane")
        unsure = code in drilling.unknown_ends or (plane != G17 and code in drilling.only_in_xy)
        if self.g.get("motion") == G80 or plane not in PLANES or unsure:
            self.lose()
            self.cycle = code
            self.level = self.r = NAN
            return
        first, second, along = PLANES[plane]
        self._begin_cycle(code, block, along)
        if not block.axes:
            if drilling.own_group and "R" in values:
                self.lose(along)  # it may have made a hole
                self.r = NAN
            return
        letters = drilling.repeats + drilling.maybe_repeats
        repeats = [values[letter] for letter in letters if letter in values]
        # In G90 every repeat is a hole in the same place.
        odd = any(not (n >= 1.0 and n.is_integer()) for n in repeats)
        if self.g.get("distance") != G90 or odd or block.increments:
            self.lose()
            self.level = self.r = NAN
            return
        for axis in (first, second):
            if axis in values:
                self.at[AXES.index(axis)] = values[axis] * self.scale(axis)
        self.at[AXES.index(along)] = self._retracted()
        if self.turned() or self.g.get("compensation") != G40:
            self.lose()

    def _begin_cycle(self, code: int, block: Sorted, along: str) -> None:
        """Put a cycle in force, with the level of its series and its R."""
        if self.cycle is None:
            self.level, self.r = self.at[AXES.index(along)], NAN
        elif self.cycle != code:
            self.r = NAN
        self.cycle = code
        if "R" in block.values:
            # Beside an X that is a diameter, R may be none.
            radius = NAN if along == "X" and self.diameter is not False else 1.0
            self.r = block.values["R"] * self.scale(along) * radius

    def _retracted(self) -> float:
        """Where the tool comes back to: R (G99), or the level of the series above it (G98)."""
        retract = self.g.get("retract")
        top = max(self.level, self.r) if self.level == self.level and self.r == self.r else NAN
        return self.r if retract == G99 else top if retract == G98 else NAN
