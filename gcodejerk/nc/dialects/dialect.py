"""What a dialect is: the questions that the reader asks of every controller's language.

This module owns the questions and the words of the answers; the answers stand in
`gcodejerk.nc.dialects`, one file per dialect, each with its source, so that two dialects can be
read side by side. Code asks the table and never the name of a dialect.

Rule 1: a G code is written as ten times its number (G92.1 is 921), so that codes are integers and
compare exactly.

Rule 2: what a table does not name is not known: a block that holds it is left alone, and what it
might have changed is unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.limits import Limit, Mode
from gcodejerk.nc.dialects.refusals import Refusals
from gcodejerk.nc.dialects.spelling import Text, Writing
from gcodejerk.start import Start

LINEAR = frozenset("XYZUVW")

PLANES: dict[int, tuple[str, str, str]] = {
    # G code: first and second axis of the plane, and the axis across it along which cycles drill
    170: ("X", "Y", "Z"),
    180: ("Z", "X", "Y"),
    190: ("Y", "Z", "X"),
    171: ("U", "V", "W"),
    181: ("W", "U", "V"),
    191: ("V", "W", "U"),
}

COMPENSATION = "cutter compensation"
"""Name, among the transforms, of one that most controls of the dialect do not have."""
MACHINE_WORDS = "machine words"
"""Group of the M codes that make the axis words of their block machine coordinates."""
ANOTHER_LANGUAGE = "another language"
"""Name, among the bars, of one that the table does not have."""
LEFT_OVER = "compensation that ends"
"""Name, among the bars, of what G40 leaves of the offset, which goes with the next move."""
OVERRIDES, OVERRIDES_SET = "overrides off", "overrides off by a variable"
"""The same of overrides and feed hold that are off in a mode, or by what a variable was set to."""
CYCLE_CALL = "cycle call"
"""Group of the M codes that run a cycle behind the motion of their block."""
HARMLESS = "harmless"
"""Group of the M codes, and first word of the groups of the G codes, that the machine file says
move nothing and change nothing."""

_SWITCHES = frozenset(("spindle", "coolant", "auxiliary", HARMLESS))
"""Groups of the M codes whose place in their block a machine file may state."""

ARC_CENTRES: dict[int, tuple[str, str]] = {170: ("I", "J"), 180: ("I", "K"), 190: ("J", "K")}
"""The centre words that an arc may carry in each plane; the remaining one is an error."""

Effect = Literal[
    "none",  # nothing that moves an axis or a frame
    "words",  # takes the words of the block for something else than a move: a dwell, a blank
    "store",  # stores where the axes stand
    "return",  # to a stored point, by way of the point that the words give
    "machine",  # the words are machine coordinates
    "system",  # selects a work coordinate system
    "numbered system",  # selects the one whose number P gives
    "length",  # tool length
    "set",  # the axis words rename where the axes stand
    "clear",  # takes such names back
    "restore",  # puts them in force again
    "local",  # a further offset
    "table",  # writes data of tools or systems
    "data",  # the same, and where L or P says so, parameters of the control
    "frames",  # changes a frame in a way that is not followed
    "cycle",  # moves, and leaves the modes as they were but for motion and F
    "modal cycle",  # every position that follows is one of a cycle, until called without
    "shift",  # the axis words shift the frame, and nothing else turns it; none: it is as selected
    "further shift",  # the axis words shift it by so much more
    "turned frame",  # turns, scales or mirrors the frame that "shift" ends; bare, it ends it too
    "further turn",  # the same on top of what is in force; bare, nobody knows
    "corner",  # the corner behind its block is cut, so that the next one begins elsewhere
    "corners",  # so are all that follow, until it is 0
    "smoothing",  # a continuous path, unknown where its first argument is 0 or none; a compressor
    "compressor",  # makes polynomials of G1 blocks, with speeds of its own
    "no compressor",  # no longer
    "turn",  # positions a spindle, which may be a rotary axis as well
    "watch",  # what is said here may act at any time from here on
    "transform",  # turns, scales or mirrors what follows, for good
    "home",  # moves the axes that it names, or all, to a place that is not known
    "measure",  # does that, and writes what it has measured: an offset, a tool's length
    "label",  # may be come to from elsewhere: nothing is known behind it but the unit of lengths
    "flow",  # a jump, a loop, a branch or a call: nothing is certain behind it
    "diameter",  # X is a diameter from here on
    "radius",  # it is none
    "either",  # it is one or the other, depending on the word
    "declaration",  # the rest of the line names variables, which hold numbers or text and no more
    "swivel",  # turns the plane, and moves; without arguments turns it back
    "written",  # writes offsets, tool data or parameters of the control
    "feed group",  # F means the speed of the axes that it names; of all, where it names none
    "feed override",  # scales F, and not G0
    "limit",  # sets a limit, by `Dialect.limits`
]
"""What a code, or a name such as ``TRANS``, does besides changing its modal group."""


@dataclass(frozen=True, slots=True)
class NamedCycle:
    """A drilling cycle with a name, which comes back to its RTP."""

    parameters: tuple[str, ...]
    """Those whose meaning is known, in their order."""
    keeps_feed: bool = False
    """It drills with the F in force, and leaves it alone."""


@dataclass(frozen=True, slots=True)
class Drilling:
    """How canned cycles of the drilling kind behave."""

    codes: frozenset[int] = frozenset()
    unknown_ends: frozenset[int] = frozenset()
    """Those of which it is not known where they leave the tool."""
    only_in_xy: frozenset[int] = frozenset()
    """Those of which it is known in G17 alone."""
    own_group: bool = False
    """They do not replace G0 or G1, which are in force again after G80."""
    repeats: str = "L"
    """Letters of the number of repeats."""
    maybe_repeats: str = ""
    """Letters that are such a number on some of the controls, and something else on others."""
    named: Mapping[str, NamedCycle] = field(default_factory=dict)
    """By their names: ``CYCLE81(RTP, RFP, SDIS, DP, DPR)``."""
    missing: Literal["error", "unknown"] = "error"
    """What follows where no R or depth was ever given: the block is refused, or nobody knows."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """One way of writing and reading programs."""

    name: str
    title: str
    """For people."""
    sources: tuple[str, ...]
    text: Text
    groups: Mapping[int, str]
    """G code -> modal group."""
    m_groups: Mapping[int, str]
    """M code -> group."""
    defaults: Mapping[str, int] = field(default_factory=dict)
    """Modal group -> code in force when a program starts; a group not named is unknown."""
    effects: Mapping[int, Effect] = field(default_factory=dict)
    """G code -> what it does besides."""
    names: Mapping[str, Effect] = field(default_factory=dict)
    """Named word -> what it does; one that is not listed may do anything."""
    letters: str = "FSTXYZABCUVWDEHIJKLPQR"
    """Addresses that a block may hold, N, G and M left out."""
    calls: str = ""
    """Addresses that call a subprogram by themselves."""
    uses: Mapping[str, frozenset[str]] = field(default_factory=dict)
    """Letter -> codes ("G43", "M66") one of which has to stand in the block or be in force; where
    the table is empty, every letter may stand everywhere."""
    shifts_travel: bool = False
    """By a setting, the first increment behind a change of the frame travels that change, too."""
    base_frames: bool = False
    """Between machine and work systems lie frames that the program does not name, and that G53 may
    leave in force."""
    spindle_turns: str = ""
    """Rotary axes that what M3 turns may be as well."""
    distance_first: bool = False
    """G90 and G91 may count for the words behind them alone."""
    polar: str = ""
    """Letters that say where a straight move leads, by angle and radius; an arc may have the last
    of them, too, where axis words stand beside it, and a cycle has its words for itself."""
    strict: bool = False
    """Only one code may use the axis words, and a code that needs some has to have them."""
    centres_of_plane: bool = False
    """A centre word of an arc that does not lie in its plane is an error."""
    modal_motion: bool = True
    """G0 to G3 stay in force; otherwise every block states its own."""
    one_command: bool = False
    """The first word is the command, and all others are its parameters."""
    units: Mapping[int, bool] = field(default_factory=lambda: {200: True, 210: False})
    """G code -> whether lengths are inches."""
    feed_modes: Mapping[int, int] = field(default_factory=lambda: {930: 93, 940: 94, 950: 95})
    """G code -> 93 inverse time, 94 per minute, 95 per revolution."""
    paths: Mapping[int, int] = field(default_factory=lambda: {610: 61, 640: 64})
    """G code -> 61 exact stop, 62 exact path, 64 continuous."""
    transforms: Mapping[int, tuple[str, bool]] = field(default_factory=dict)
    """G code -> name of a rotation, scaling, mirroring or polar frame, and whether it begins."""
    increments: Mapping[str, str] = field(default_factory=dict)
    """Address of increments -> its axis, for example U -> X."""
    whole_numbers: Literal["units", "machine"] = "units"
    """Is X100 100 mm? It is; or a parameter of the machine decides."""
    calculator: bool = False
    """And the owner of the machine says that it is (`set_up`)."""
    diameter_codes: bool = False
    """A program may state whether X is a diameter."""
    diameter_fixed: bool = False
    """It is one for good, or for good none: no code that is not in the table changes that."""
    refused: frozenset[str] = frozenset()
    """Codes ("G64", "M6") that some of its controls refuse, and others run. Where one is refused,
    its whole block changes nothing, and the sender waits for somebody, who may move the axes."""
    refuses: Refusals = field(default_factory=Refusals)
    """What some refuse besides."""
    feed_of_mixed: bool = False
    """Where linear and rotary axes move together, F is certainly the speed of the linear ones."""
    feed_on_rapids: bool = False
    """G0 runs at F, like G1."""
    feed_of_moves: bool = False
    """F counts beside G0 to G3 alone; anywhere else it belongs to another command. One that is not
    greater than 0 is refused or passed over."""
    tool_frame: frozenset[str] = frozenset()
    """Addresses that change a tool's offset, and with it the frame: T on a lathe, D."""
    length_axes: str = AXES
    """Axes that a tool length may shift."""
    length_moves: bool = False
    """A change of the tool length may move the machine by itself, by a parameter."""
    length_turns: bool = False
    """Another plane lays the length of a tool along other axes, and so renames where they stand."""
    length_word: str = ""
    """Address that chooses another tool length by itself while one is in force."""
    p_selects: frozenset[int] = frozenset()
    """Systems that a P may turn into another one: G54 P3 for G54.1 P3."""
    bare_set: Literal["nothing", "zero", "unknown"] = "unknown"
    """G92 without axis words: changes nothing; makes the position of every axis that it may name
    zero; nobody knows."""
    set_letters: str = ""
    """Letters that G92 takes; beside others, it may be one without axis words. Empty: all, where
    `bare_set` is not "zero"."""
    shift_may_end: bool = False
    """By a setting of the control, selecting a work system ends what G92 has shifted."""
    incremental_set: bool = False
    """G92 means the same in G91."""
    units_once: bool = False
    """Another unit in the midst of a program leaves no position and no offset certain."""
    inches_turn: bool = False
    """In inches nobody knows how far a rotary axis turns: some controls convert degrees, too."""
    feed_before_units: bool = False
    """F counts in the unit in force in front of a block that also states one."""
    lengths_only: frozenset[int] = frozenset()
    """Codes for inch or mm that leave the unit of F as it was."""
    bars: Mapping[int, tuple[str, bool | Literal["P", "Q"]]] = field(default_factory=dict)
    """G code -> a name in `eligibility.BARS`, and whether it begins or ends; "P": it begins where
    P is given and not 0; "Q": it ends where Q is given and 0 or 1."""
    m_bars: Mapping[int, str] = field(default_factory=dict)
    """M code -> a name in `eligibility.BARS`, which begins unless P is 0."""
    m_scales: frozenset[int] = frozenset()
    """M codes that scale F, and with it rapids that run at F, to so many percent as S says."""
    limits: Mapping[str, Mapping[str, Limit]] = field(default_factory=dict)
    """M code, name or `limits.SETTING` -> its word -> what that limits of streams and rapids."""
    limit_modes: Mapping[str, Mode] = field(default_factory=dict)
    """Name -> what limits it selects by itself."""
    tool_word_moves: bool = False
    """T may call a program of the builder's."""
    dark_rapids: bool = False
    """The control also drives beams, which are dark in G0 and on in G1."""
    beam_codes: frozenset[int] = frozenset()
    """M codes that hardly any mill uses on these controls, and every laser does."""
    left_at_start: frozenset[str] = frozenset()
    """Codes ("G80") that some of its controls start with and others do not have, and on which no
    rapid hangs: see `gcodejerk.nc.dialects.at_start`."""
    same_after_stop: bool = False
    """Nobody can move an axis while M0 or M1 waits, or the control takes that back."""
    path_has_to_be_stated: bool = False
    """Controls usually start in exact stop, by their machine data."""
    lathe: Literal["no", "yes", "either"] = "no"
    """Whether programs of lathes are written so, in which X is a diameter."""
    tool_cancelled_by_return: Literal["no", "named", "all"] = "no"
    """G28, G30 and G53 cancel the tool length of the axes that they name; or G28 that of all."""
    bare_return: bool = False
    """G28 without axis words moves all axes; otherwise nobody knows."""
    packed_repeats: bool = False
    """M98 P31000 runs O1000 three times."""
    other_m: Literal["unknown", "positions"] = "unknown"
    """An M code that is not listed: not understood, or a program of the builder's that may move,
    and that may end in G90 and with the tool length cancelled, as those for tool changes do."""
    contours: frozenset[int] = frozenset()
    """Codes whose P and Q name a contour's first and last block: those blocks do not run."""
    finishing: frozenset[int] = frozenset()
    """Codes that run such blocks once more, wherever they stand."""
    redrawn: frozenset[int] = frozenset()
    """Motions whose end is not what their words say."""
    drilling: Drilling = field(default_factory=Drilling)
    arithmetic: Arithmetic = field(default_factory=Arithmetic)
    rapid: int = 0
    arcs: frozenset[int] = frozenset({20, 30})
    arcs_refused: bool = False
    """An arc that misses its end may be refused, and whoever sends the program go on."""
    feed_needed: bool = False
    """So may a feed move before any F."""
    harmless: frozenset[int] = frozenset({0})
    """G codes whose effect does not depend on when, within its block, a rapid runs."""
    before_m: frozenset[int] = frozenset()
    """M codes that the control runs before the motion of their block: they stay in front of a
    stream. One that stands neither here nor in `after_m` runs when the builder, or nobody, says."""
    after_m: frozenset[int] = frozenset({0, 1, 2, 30})
    """M codes that it runs when the motion has ended: they go behind a stream."""
    exact_stop: int | None = None
    """G code that lets the motion of its own block alone end in a standstill."""
    stops_after_rapid: bool = False
    """Every G0 ends in a standstill, checked before the next block begins."""
    quick: bool = True
    """Plain lines are made of letters with numbers, so that they can be read as arrays."""
    extrudes: bool = False
    """E feeds what is printed with, and moves no axis that a machine file knows."""
    writing: Writing | None = None
    """None where no form of a stream is known."""
    note: str = ""
    """What whoever has a program read so has to know."""
    unknown_lasts: bool = False
    """What the table does not name may turn or scale for good: behind it nothing is rewritten."""
    macro_change: bool = False
    """M6 runs a program of the owner's, as `other_m` "positions" says of others."""
    apart: frozenset[str] = frozenset()
    """Axes that a rapid may move before the others, or behind them."""
    feed_lost: bool = False
    """An F beside G0 is ignored, so that a stream has nothing to restore F with."""
    in_turn: frozenset[int] = frozenset()
    """G codes behind which another command may stand, where `one_command` holds."""

    @property
    def cycles(self) -> frozenset[int]:
        """Codes of the drilling cycles."""
        return self.drilling.codes

    def effect(self, code: int | None) -> Effect:
        """What a G code does besides changing its group."""
        return "none" if code is None else self.effects.get(code, "none")

    def set_up(self, start: Start) -> Dialect:
        """The dialect as the owner of a machine says that his control runs it.

        Parameters
        ----------
        start : Start
            Codes that are harmless, M codes that run before the motion of their block, or behind
            it, the axes that there are, whether F matters to a rapid, and what a number without a
            decimal point is. Of M codes that do more than switch a spindle, coolant or auxiliaries,
            nothing is believed.
        """
        dialect = self.with_harmless(start.harmless)
        if self.whole_numbers == "machine" and start.decimal_point == "calculator":
            dialect = replace(dialect, calculator=True)
        if lacking := self.refuses.axes - start.limits.keys():
            dialect = replace(dialect, letters="".join(a for a in self.letters if a not in lacking))
        if not start.restores and start.rapid_feed is None:
            dialect = replace(dialect, lengths_only=frozenset(), feed_of_mixed=True)
        before, after = (
            frozenset(m for m in codes if dialect.m_groups.get(m) in _SWITCHES)
            for codes in (start.m_before, start.m_after)
        )
        if not before and not after:
            return dialect
        return replace(
            dialect,
            before_m=dialect.before_m - after | before,
            after_m=dialect.after_m - before | after,
        )

    def with_harmless(self, codes: frozenset[str]) -> Dialect:
        """The dialect of a machine whose owner says of some codes that they are harmless.

        Parameters
        ----------
        codes : frozenset of str
            For example ``G187``, ``M150``. One that the table knows means what it says there.

        Returns
        -------
        Dialect
            In which the others move no axis, and change no mode and no frame.
        """
        g = {round(float(name[1:]) * 10.0): name for name in codes if name[0] == "G"}
        m = {int(name[1:]): name for name in codes if name[0] == "M"}
        g = {code: name for code, name in g.items() if code not in self.groups}
        m = {code: name for code, name in m.items() if code not in self.m_groups}
        if not g and not m:
            return self
        names = frozenset((*g.values(), *m.values()))
        return replace(
            self,
            groups={**self.groups, **{code: f"{HARMLESS} {name}" for code, name in g.items()}},
            m_groups={**self.m_groups, **dict.fromkeys(m, HARMLESS)},
            uses={letter: users | names for letter, users in self.uses.items()},
        )

    def feed_code(self, mode: int) -> int | None:
        """G code of a feed mode."""
        return next((code for code, m in self.feed_modes.items() if m == mode), None)

    def path_code(self, mode: int) -> int | None:
        """G code of a path mode."""
        return next((code for code, m in self.paths.items() if m == mode), None)


def grouped(table: Mapping[str, tuple[int, ...]]) -> dict[int, str]:
    """Turn a table round: code -> group."""
    return {code: group for group, codes in table.items() for code in codes}


def code_names(*names: str) -> frozenset[str]:
    """Names of codes as `Dialect.uses` holds them."""
    return frozenset(names)


def code_name(code: int) -> bytes:
    """Spell a G code: 921 is ``G92.1``."""
    return b"G%d" % (code // 10) + (b".%d" % (code % 10) if code % 10 else b"")
