"""Parameters: time constants, jerk limits and shapers of controls, tuned for a shop's own rapids.

A control that takes no points can still shake less: its own law (`motion.families`) has numbers
that can be set. This room owns what such numbers are (`settings`), the rapids that they are chosen
for (`moves`), what they leave (`judge`), the search (`search`) and the whole study (`tuning`).
Which numbers a control has stands with its emitter (`gcodejerk.emit`).
"""

from gcodejerk.parameters.moves import Moves, joined_moves, program_moves
from gcodejerk.parameters.search import GOALS, MEAN, WORST
from gcodejerk.parameters.settings import (
    ALL,
    LIVE,
    MARKS,
    PATH,
    TODAY,
    Relation,
    Scheme,
    Setting,
    proportional,
    ramp_time,
    share_of_ramp,
    share_of_today,
)
from gcodejerk.parameters.tuning import Outcome, Point, Tuning, tune

__all__ = [
    "ALL",
    "GOALS",
    "LIVE",
    "MARKS",
    "MEAN",
    "PATH",
    "TODAY",
    "WORST",
    "Moves",
    "Outcome",
    "Point",
    "Relation",
    "Scheme",
    "Setting",
    "Tuning",
    "joined_moves",
    "program_moves",
    "proportional",
    "ramp_time",
    "share_of_ramp",
    "share_of_today",
    "tune",
]
