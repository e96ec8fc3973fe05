"""Why a rapid was left alone: the fixed list that reports, `inspect` and the README share.

The text of each member is what the user and the JSON report see; README.md explains each of them,
and a test keeps the two together. Readers of programs (`nc`) and the planner both assign reasons,
so the list stands below both.
"""

from __future__ import annotations

import enum


class Reason(enum.StrEnum):
    """Why a rapid passes through unchanged. The order is the order of precedence."""

    AFTER_END = "after the end of the program"
    BLOCK_DELETE = "block delete"
    SUBPROGRAM = "inside a subprogram, loop or conditional block"
    NOT_UNDERSTOOD = "block not understood"
    EXPRESSION = "expression or variable"
    DECIMAL_POINT = "number without a decimal point"
    CANNED_CYCLE = "rapid inside a canned cycle"
    FRAME_CHANGE = "coordinate frame changes in the block"
    CUTTER_COMPENSATION = "cutter compensation active"
    ROTATION = "rotation, scaling, mirroring or polar active"
    SYSTEM_WRITTEN = "offsets or parameters written by the program"
    LOOK_AHEAD = "look-ahead limited by the program"
    FEED_GROUP = "F is the speed of some axes only"
    FEED_SCALED = "adaptive or programmed override of the feed"
    NO_MOTION = "no axis moves"
    DISTANCE_MODE_UNKNOWN = "distance mode unknown"
    UNITS_UNKNOWN = "units unknown"
    FEED_UNIT = "unit of F unknown, or not that of lengths"
    PATH_UNKNOWN = "path mode unknown"
    START_UNKNOWN = "start unknown"
    ROTARY_WAY = "a rotary axis may turn another way"
    MIXED_AXES = "linear and rotary axes move together"
    OTHER_WORDS = "other words of the block cannot keep their order"
    FEED_UNKNOWN = "feed to restore unknown"
    BEAM = "a beam may be on, which G0 darkens"
    AXIS_UNKNOWN = "axis not in the machine file"
    NO_MODE = "no modes in the machine file"
    NO_BLENDING = "the control does not blend blocks of this axis"
    TOO_SHORT = "shorter than minimum_length"
    TOO_LONG = "too long for a stream"
    BEYOND_TRAVEL = "beyond travel"
    LINE_LIMIT = "line or number too long for the control"
    LIMITS = "limits cannot be met"
    NOT_PLAYED = "the control would not play it as planned"
    NOT_BETTER = "no profile within the limits is better"
    CONTROL_SET = "kept, the control is set instead"


REASONS = tuple(Reason)
"""The reasons by index, as columns of reasons hold them."""
CERTAIN = 255
"""In a column of reasons: none, the rapid can be rewritten."""
