"""Why a rapid was left alone: the fixed list that reports, `inspect` and the README share.

The text of each member is what the user and the JSON report see; `EXPLAINED` says what each means
and what helps, README.md lists them all, and a test keeps the two together. Readers of programs
(`nc`) and the planner both assign reasons, so the list stands below both.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass


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
    NOT_FOLLOWED = "behind a call, jump or loop that is not followed"
    CUTTER_COMPENSATION = "cutter compensation active"
    ROTATION = "rotation, scaling, mirroring or polar active"
    SYSTEM_WRITTEN = "offsets or parameters written by the program"
    LOOK_AHEAD = "look-ahead limited by the program"
    COMPRESSED = "a compressor joins the blocks of a stream"
    FEED_GROUP = "F is the speed of some axes only"
    FEED_SCALED = "adaptive or programmed override of the feed"
    LINES_READ = "the program reads the numbers of its lines"
    OVERRIDES_OFF = "overrides or feed hold switched off by the program"
    LIMIT_SET = "limit of speed, acceleration or jerk set by the program"
    NO_MOTION = "no axis moves"
    DISTANCE_MODE_UNKNOWN = "distance mode unknown"
    UNITS_UNKNOWN = "units unknown"
    FEED_UNIT = "unit of F unknown, or not that of lengths"
    PATH_UNKNOWN = "path mode unknown"
    START_UNKNOWN = "start unknown"
    ROTARY_WAY = "a rotary axis may turn another way"
    MIXED_AXES = "linear and rotary axes move together"
    APART = "axes of the rapid move one after another"
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
    LATER = "gains little and would settle later"
    CONTROL_SET = "kept, the control is set instead"


REASONS = tuple(Reason)
"""The reasons by index, as columns of reasons hold them."""
CERTAIN = 255
"""In a column of reasons: none, the rapid can be rewritten."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """What a reason means, and what helps; words in backquotes are written so in files."""

    means: str
    remedy: str


EXPLAINED: dict[Reason, Explanation] = {
    Reason.AFTER_END: Explanation(
        "the block stands behind M2, M30 or the closing %",
        "nothing: it never runs; if it should, take the end in front of it out",
    ),
    Reason.BLOCK_DELETE: Explanation(
        "the block begins with `/`: whether it runs is decided at the machine",
        "where it always runs, take the `/` out",
    ),
    Reason.SUBPROGRAM: Explanation(
        "it is not the same rapid on every pass, never runs, or not every pass could be followed",
        "`--unroll` writes loops, branches and calls out, every pass by itself; or post the moves "
        "in full; where a call of another file is in the way, give its text (`--subprograms`)",
    ),
    Reason.NOT_UNDERSTOOD: Explanation(
        "the control would refuse it, or it holds a code that the dialect's table does not know; "
        "or such a block stands in front of it, and since then nobody has said G40",
        "the notes name the line: correct it, say how the program is written (`--dialect`), "
        "declare a harmless code (`program.harmless`), or state G40 and the other modes behind it",
    ),
    Reason.EXPRESSION: Explanation(
        "an axis word is a variable or an expression; where it ends is known if every variable is",
        "let the program set its variables; on controls other than LinuxCNC, to whole increments, "
        "which a third is not",
    ),
    Reason.DECIMAL_POINT: Explanation(
        "X100 is 100 mm or 0.1 mm, as a parameter of the control decides",
        "state `program.decimal_point` in the machine file, or write X100.",
    ),
    Reason.CANNED_CYCLE: Explanation(
        "the moves of a drilling cycle, of a modal macro, or of a turning contour",
        "drilling cycles: `--expand-cycles` writes them out; others: post them as single moves; "
        "behind a call on a Siemens, where one may have been left in force: MCALL alone ends it",
    ),
    Reason.FRAME_CHANGE: Explanation(
        "G53, G28, G30, G92, G52, G10, or G43/G49/G54.. with axis words",
        "with `program.offsets` and `program.home`, G54.. may stand beside a rapid, and what "
        "follows the others is certain; let a plain G0 go most of the way, in front of G28, G30 "
        "and G53, and behind a G43 that ends high up (LinuxCNC, Mach: give G43 a block of its "
        "own; elsewhere that may move the machine)",
    ),
    Reason.NOT_FOLLOWED: Explanation(
        "what runs there may have changed every mode, and since then nobody has said G40; or it is "
        "a synchronized action of Siemens, which may act at any time",
        "the notes name the line: give the text of what is called (`--subprograms DIR`), or state "
        "G40 and the other modes (G90, G21, the work system) behind it; take synchronized actions "
        "out",
    ),
    Reason.CUTTER_COMPENSATION: Explanation(
        "G41 or G42 is, or may be, in force, or (Fanuc and kin) ends with the next move in its "
        "plane: the real path differs from the programmed one",
        "put G40 (in Klartext R0) in front of the rapid, on a Fanuc beside a feed move in the "
        "plane",
    ),
    Reason.ROTATION: Explanation(
        "an axis word is not the motion of that axis",
        "cancel the rotation, scaling or mirroring in front of the rapid (G69, G50 and their kin)",
    ),
    Reason.SYSTEM_WRITTEN: Explanation(
        "`#5221=`, `G10`, `$P_UIFR[1]=` and the like: until a work system and a tool length are "
        "selected again; for good behind a G10 that writes parameters",
        "select the work system (G54) and the tool length (G43 H1) again behind it, or enter "
        "offsets at the control",
    ),
    Reason.LOOK_AHEAD: Explanation(
        "Haas's G103 P1: no stream would be blended",
        "end it in front of the rapids (G103), or take it out",
    ),
    Reason.COMPRESSED: Explanation(
        "behind Siemens's `COMPCAD`, `COMPON` and their kin, or `CYCLE832`, which selects one, and "
        "behind Fanuc's `G5.1 Q2` and `Q3`: of the blocks of a stream the control would make "
        "curves of its own, at speeds of its own",
        "put `COMPOF` (behind `CYCLE832` `COMPOF DYNNORM`; `G5.1 Q1` or `G5.1 Q0`) in front of the "
        "rapids, and the compressor behind them",
    ),
    Reason.FEED_GROUP: Explanation(
        "Siemens, behind `FGROUP(X,Y)`: F is the speed of these axes alone",
        "put `FGROUP()` in front of the rapids",
    ),
    Reason.FEED_SCALED: Explanation(
        "M52 of LinuxCNC, OVR of Siemens: they act on streams, not on G0; M220 of Marlin and its "
        "kin: by what share, is not known",
        "LinuxCNC: end it in front of the rapids (M52 P0), Marlin too (M220 S100); Siemens: take "
        "OVR out",
    ),
    Reason.LINES_READ: Explanation(
        "LinuxCNC: `#<_line>` stands in the program, and lines that are put in front of it change "
        "what it says",
        "take it out of the program",
    ),
    Reason.OVERRIDES_OFF: Explanation(
        "Fanuc and its kin, behind G63 (tapping) or `#3004` set to anything but 0: feed override "
        "or feed hold do nothing, and a stream, which no rapid override slows, could not be slowed "
        "or stopped",
        "put `G64` (`#3004=0`) in front of the rapids",
    ),
    Reason.LIMIT_SET: Explanation(
        "`M204`, `M201`, `M203`, `SET_VELOCITY_LIMIT`, `$120=`, `ACC[X]=` and the like: below what "
        "the machine file states, so that neither the rapid nor its stream would run as planned; "
        "until it is set higher again, on grbl for good; Siemens: `DYNFINISH` and its kin, which "
        "`CYCLE832` selects, `DRIVE`, and `SOFT` where the machine file has no jerk. `M204` and "
        "`SET_VELOCITY_LIMIT` bound the path: of axes that go together at their own limits that is "
        "up to 1.42 times one axis's, of three 1.74 times",
        "state that limit in the machine file (`rapid` of the axis, and `limit` where it stands "
        "there), or take it out of the program; a limit of the path: set it so much higher, or "
        "move the axes in blocks of their own; Siemens: end it (`ACC[X]=100`, `DYNNORM`, "
        "`BRISK`)",
    ),
    Reason.NO_MOTION: Explanation(
        "the block's end is its start",
        "nothing: what does not move shakes nothing",
    ),
    Reason.DISTANCE_MODE_UNKNOWN: Explanation(
        "neither G90 nor G91 has been stated where the dialect assumes none, or a subprogram or a "
        "block that is not understood may have changed it",
        "put G90 into the program, behind calls once more, or into `program.startup`",
    ),
    Reason.UNITS_UNKNOWN: Explanation(
        "nobody says whether lengths are mm or inches, or a subprogram or a block that is not "
        "understood may have changed it",
        "put the code for mm or inches (G21, G20) in front, or into `program.startup`",
    ),
    Reason.FEED_UNIT: Explanation(
        "Siemens: G70 and G71 leave F in the control's own unit",
        "state the control's own unit in `program.startup` (G71 or G70), or use G710 and G700",
    ),
    Reason.PATH_UNKNOWN: Explanation(
        "exact stop would stop a stream at every point: usual on Siemens (G60), and what is not "
        "followed (a call, a jump, a block that may be skipped) may have left it on other controls "
        "(G61)",
        "state G64 in the program, behind what is not followed, or in `program.startup`",
    ),
    Reason.START_UNKNOWN: Explanation(
        "no absolute word has yet said where an axis stands, or something may have moved it: tool "
        "change, offset, homing, probing, somebody who jogs at M0 or M1; A, B or C in inches, "
        "on controls that may convert degrees (grbl, Duet)",
        "usual for the first move of each axis, and behind T0101 of a lathe; `program.start` says "
        "where the axes stand, `program.offsets` work offsets and tool lengths, `program.home` "
        "where G28 leads, `program.tool_change` M6, `program.resume_after_stop` what M0 "
        "does; write programs that turn axes in mm",
    ),
    Reason.ROTARY_WAY: Explanation(
        "an absolute rapid of A, B or C, which may go the short way round, or by the sign of its "
        "number",
        "state `wrap` of the axis in the machine file; where the axis counts turns, keep within "
        "one turn",
    ),
    Reason.MIXED_AXES: Explanation(
        "what F means then is not known for this dialect",
        "move linear and rotary axes in blocks of their own",
    ),
    Reason.APART: Explanation(
        "Centroid's G0 moves Z upwards before the other axes, and downwards behind them; of some "
        "controls nobody could say",
        "move Z in a block of its own; where `auto` read the program, state its control's dialect",
    ),
    Reason.OTHER_WORDS: Explanation(
        "a word of which the dialect's table does not know whether the control runs it before the "
        "motion or behind it: M5 on Fanuc, Haas and Siemens, where the builder chooses",
        "say when the M code runs (`program.m_before`, `program.m_after`), or give it a block of "
        "its own",
    ),
    Reason.FEED_UNKNOWN: Explanation(
        "a later feed move relies on an F, or on G94 or G95, that is not known here",
        "state G94 and F in front of the rapid, or F in the first feed move behind it",
    ),
    Reason.BEAM: Explanation(
        "grbl, Mach and Marlin also drive lasers and torches, which burn in G1",
        "where there is no beam, state `spindle: mill` in the machine file",
    ),
    Reason.AXIS_UNKNOWN: Explanation(
        "the block moves an axis that the machine file does not describe",
        "describe the axis under `axes` in the machine file",
    ),
    Reason.NO_MODE: Explanation(
        "nothing is known to vibrate, so nothing can be gained (profiles `shortest` and "
        "`conventional` go on)",
        "measure what vibrates (`gcodejerk machine test-program` writes a program for that), and "
        "state it as `modes` or `spectrum` in the machine file",
    ),
    Reason.NO_BLENDING: Explanation(
        "LinuxCNC stops after every block in which A, B, C, U, V or W moves",
        "move X, Y and Z in a block of their own; the rapids of other axes stay as they are",
    ),
    Reason.TOO_SHORT: Explanation(
        "such moves hardly shake anything (`design.minimum_length`)",
        "where they matter, lower `design.minimum_length` in the machine file",
    ),
    Reason.TOO_LONG: Explanation(
        "it takes more than 100,000 command intervals (100 s at 1 ms)",
        "see whether a decimal point is missing; otherwise write it as several rapids",
    ),
    Reason.BEYOND_TRAVEL: Explanation(
        "an end lies outside of `travel`, where the work offset is known; or farther away than "
        "100 km",
        "correct the number, `program.offsets`, or `travel` of the axis",
    ),
    Reason.LINE_LIMIT: Explanation(
        "a line of the stream would pass the control's longest line, or a point its digits",
        "give other words and comments a block of their own, or the axis a coarser `resolution`",
    ),
    Reason.LIMITS: Explanation(
        "no profile keeps the limits within `design.max_extension`",
        "raise `limit.acceleration` or `limit.jerk` to what the drives can do, or "
        "`design.max_extension`",
    ),
    Reason.NOT_PLAYED: Explanation(
        "LinuxCNC: several axes under `positioning: independent`, an acceleration above "
        "MAX_ACCELERATION/1.05, a look-ahead that is too short, or speeds that no blocks on its "
        "servo periods give within 0.01 mm; others: an axis that moves between two steps of its "
        "`resolution`, and reaches none; motion controllers: ticks or counts too coarse",
        "LinuxCNC: say `positioning: linear`, raise MAX_ACCELERATION and the look-ahead and state "
        "them in `controller_options`, or take `--controller linuxcnc-hal`; others: state the "
        "finer `resolution` that the control has; motion controllers: finer ticks or counts",
    ),
    Reason.NOT_BETTER: Explanation(
        "the controller's own rapid shakes no more than anything that can be written, over the "
        "whole `design.band`; or its axes excite no mode",
        "nothing needs to be done; where the drives can do more, a higher `limit.acceleration` "
        "may gain",
    ),
    Reason.LATER: Explanation(
        "at worst over `design.band` it would leave less than today, but by less than a tenth; and "
        "as a mean over the band it would be later, by a larger share, until no mode keeps more "
        "than `design.tolerance`",
        "nothing needs to be done; a coarser `design.tolerance`, where that is settled enough, may "
        "have it rewritten",
    ),
    Reason.CONTROL_SET: Explanation(
        "`--as parameters`: lines of the program set the control's own law for this rapid",
        "nothing: the control's settings serve it",
    ),
}
"""Each reason with its meaning and its remedy: pages, reports and documents are made of this."""
