"""Where a block of a drilling cycle ends, for the second reading."""

from __future__ import annotations

import math
import re

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import PLANES
from gcodejerk.nc.dialects.gcodes import G17, G40, G80, G90, G98, G99
from gcodejerk.verification.second_reading.coding import Codes
from gcodejerk.verification.second_reading.known import Observation
from gcodejerk.verification.second_reading.reading import NAN, Line
from gcodejerk.verification.second_reading.sorting import Sorted

_INSIDE = re.compile(rb"[ \t]*\(([^()]*)\)[ \t]*")
_PLAIN = re.compile(rb"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)")


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

    def in_contour(self, line: Line) -> None:
        """A line of a contour, which a cycle runs as it sees fit."""
        self.lose()
        self.g["motion"], self.feed = None, NAN
        codes = [number * 10 for letter, number, _ in line.words if letter == "G"]
        self.doubt = self.doubt or not all(map(math.isfinite, codes))  # G#1 is any of them
        for code in map(round, filter(math.isfinite, codes)):
            group = self.dialect.groups.get(code, "non-modal")
            if group not in ("motion", "non-modal"):
                self.says[group] = code
        ends = [n for letter, n, _ in line.words if letter == "N" and n == self.contour]
        if ends:
            self.contours += ends
            self.contour = None
            self.run_contours()

    def drill_by_name(self, line: Line) -> bool:
        """CYCLE81(..) and its kin, at once or by MCALL, or the end of MCALL; whether it is sure."""
        if not line.understood or any(letter != "N" for letter, _, _ in line.words):
            return False
        if line.relative or not line.effects:
            return False
        if line.effects == ["modal cycle"]:
            known, self.modal = self.modal is not None, None
            if known:
                self.frames["modal macro"] = False
            return known
        hole = self._hole(*line.cycle) if line.cycle is not None else None
        if line.effects == ["cycle"] and hole is not None:
            self._retract(hole)
            return True
        if line.effects == ["modal cycle", "cycle"] and hole is not None:
            self.modal = hole
            self.frames["modal macro"] = True
            return True
        return False

    def _hole(self, name: str, arguments: bytes) -> tuple[float, bool] | None:
        """RTP of a call whose numbers make a hole from above, and whether F outlives it."""
        known = self.dialect.drilling.named.get(name)
        inside = _INSIDE.fullmatch(arguments)
        if known is None or inside is None or self.turned():
            return None
        if (self.g.get("plane"), self.g.get("compensation"), self.unit) != (G17, G40, 1.0):
            return None
        said: dict[str, float] = {}
        for number, text in enumerate(inside[1].split(b",")):
            if text.strip():
                if not _PLAIN.fullmatch(text.strip()):
                    return None
                later = number >= len(known.parameters)
                said["" if later else known.parameters[number]] = float(text)
                if later and float(text):
                    return None
        rtp, rfp = said.get("RTP", NAN), said.get("RFP", NAN)
        sdis, dpr = said.get("SDIS", 0.0), said.get("DPR", 0.0)
        deep = dpr > 0.0 or (dpr == 0.0 and said.get("DP", NAN) < rfp)
        return (rtp, known.keeps_feed) if deep and sdis >= 0.0 and rtp - rfp >= sdis else None

    def _retract(self, hole: tuple[float, bool]) -> None:
        self.at[AXES.index("Z")] = hole[0]
        self.feed = self.feed if hole[1] else NAN

    def drilled_behind(self, seen: Observation) -> bool:
        """The hole behind a block that moves; whether it is sure where it leaves the tool."""
        alone = {frame for frame, on in self.frames.items() if on is not False} == {"modal macro"}
        plain = self.g.get("motion") in (0, 10) and self.g.get("compensation") == G40
        if self.modal is None or not alone or not plain:
            return False
        ways = [there - here for here, there in zip(seen.start, self.at, strict=True)]
        z = AXES.index("Z")
        if not any(way < 0.0 or way > 0.0 for way in ways) and self.at[z] != self.modal[0]:
            self.at[z], self.feed = NAN, self.feed if self.modal[1] else NAN
            return True
        self._retract(self.modal)
        return True
