"""Motion: profiles, residual vibration, the design of Condition III, sampling and rounding.

Numbers in, arrays out: nothing here knows a file, a machine or a program. A move is described by
its *unit profile*, a rest-to-rest motion from 0 to 1; an axis sees it scaled by its own
displacement, so that limits divided by displacements are the limits of the profile, and one design
serves all axes of a straight line.
"""

from gcodejerk.motion.profiles.profile import Profiles, joined
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles, conventional_profiles
from gcodejerk.motion.residual import (
    grouped,
    mode_poles,
    polyline_response,
    profiles_response,
    residual_acceleration,
    residual_displacement,
    symmetric_response,
)
from gcodejerk.motion.rounding import has_step, round_positions
from gcodejerk.motion.sampling import (
    GRID_TOLERANCE,
    Grid,
    knots_response,
    knots_steps,
    sample_profiles,
    sampled_response,
    steps_response,
    whole_intervals,
)
from gcodejerk.motion.search.condition3 import design_four_segments, four_segment_range
from gcodejerk.motion.search.objective import Objective

__all__ = [
    "GRID_TOLERANCE",
    "Grid",
    "Objective",
    "Profiles",
    "SymmetricProfiles",
    "conventional_profiles",
    "design_four_segments",
    "four_segment_range",
    "grouped",
    "has_step",
    "joined",
    "knots_response",
    "knots_steps",
    "mode_poles",
    "polyline_response",
    "profiles_response",
    "residual_acceleration",
    "residual_displacement",
    "round_positions",
    "sample_profiles",
    "sampled_response",
    "steps_response",
    "symmetric_response",
    "whole_intervals",
]
