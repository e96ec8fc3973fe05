"""What Fanuc and its relatives, and Mach, do beside the words of a block; each was once overlooked.

Behind it the rapids were called certain, and began, or went, elsewhere.
"""

import pytest

from gcodejerk.reasons import Reason
from tests.unit.test_nc_looks_certain import also_noticed, read

MODES = "G21 G90 G94 G17 G40 G49 G80 G54 G64 F100.\n"
START, ROTATION = Reason.START_UNKNOWN, Reason.ROTATION
COMPENSATION, CHANGE = Reason.CUTTER_COMPENSATION, Reason.FRAME_CHANGE
PLACES = {"G54": {"X": 0.0, "Y": 0.0, "Z": -200.0}}
C = {"C": "none"}
HOME = {"X": 0.0, "Y": 0.0, "Z": 0.0}
MIRRORED = "G51.1 X0. Y0.\nG1 X5. Y5.\n"
DRILLED = "G98 G81 X1. Z-5. R2. F9.\n"
COMPENSATED = "G41 D1 G1 X5. Y5.\nX9.\n"
KIN = ("mitsubishi", "syntec", "mazatrol-eia", "iso-mill")

FINISHED = "G71 P10 Q20 U.2 W.1 F.2\nN10 {}G0 X30.\nG1 Z-9.\nN20 X52.\n"

# What stands in front of the last rapid, the reason for which that one is left alone, and facts.
NOT_CERTAIN = {
    "behind a contour with a dwell": (
        "fanuc-lathe-a",
        "G71 P10 Q20 U.2 W.1 F.2\nN10 G0 X30. F.1\nG4 P1000\nG1 Z-9.\nN20 X52.\nG0 X60. Z5.\n",
        START,
        {},
    ),
    "in a contour with a dwell": (
        "fanuc-lathe-a",
        "G73 P10 Q20 U.2 W.1 F.2\nN10 G0 X30. F.1\nG4 P1000\nG0 X31. Z5.\nX33.\n",
        Reason.CANNED_CYCLE,
        {},
    ),
    "the unit that a contour has said": (
        "fanuc-lathe-a",
        "G71 P10 Q20 U.2 W.1 F.2\nN10 G0 X3.\nG20\nG1 Z-9.\nN20 X52.\nG0 X60. Z5.\n",
        Reason.UNITS_UNKNOWN,
        {},
    ),
    "compensation that a contour begins, once more": (
        "fanuc-lathe-a",
        FINISHED.format("G42 ") + "G40 G1 X60. F.1\nG70 P10 Q20\nG0 X60. Z5.\nX70. Z9.\n",
        COMPENSATION,
        {},
    ),
    "any code in a contour": (
        "fanuc-lathe-a",
        "G71 P10 Q20 U.2 W.1 F.2\nN10 G0 X30.\nG#1 X5.\nN20 X52.\nG0 X60. Z5.\nX70. Z9.\n",
        Reason.NOT_UNDERSTOOD,
        {},
    ),
    "a cycle within an open contour": (
        "fanuc-lathe-a",
        "G71 P10 Q20 U.2 W.1 F.2\nN10 G0 X30. F.1\nG70 P10 Q20\nG0 X60. Z5.\nX70. Z9.\n",
        Reason.CANNED_CYCLE,
        {},
    ),
    "a contour that nobody has seen": (
        "fanuc-lathe-a",
        "G70 P10 Q20\nG0 X60. Z5.\nX70. Z9.\n",
        Reason.NOT_FOLLOWED,
        {},
    ),
    "a cycle that may come back to R": ("fanuc", "G81 X1. Z-5. R2.\nG80\nG0 Z9.\n", START, {}),
    "the axes of a mirror are no move": ("fanuc", MIRRORED + "G50.1 X0. Y0.\nG0 X5.\n", START, {}),
    "nor those of Haas": ("haas", "G101 X0.\nG100 X0.\nG0 X5.\n", START, {}),
    "nor without a mirror": ("fanuc", "G50.1 X7.\nG0 X5.\n", START, {}),
    "one mirror of two": ("fanuc", MIRRORED + "G50.1 X0.\nG0 X5. Y5.\nX6.\n", ROTATION, {}),
    "so of Haas": ("haas", "G101 X0. Y0.\nG100 X0.\nG0 X5. Y5.\nX6.\n", ROTATION, {}),
    "so of the kin": ("mitsubishi", MIRRORED + "G50.1 X0.\nG0 X5. Y5.\nX6.\n", ROTATION, {}),
    "M6 behind the move": ("fanuc", "G0 X5. M6\nX9.\n", START, {}),
    "M6 of Haas": ("haas", "G0 X5. M6\nX9.\n", START, {}),
    "M6 of Siemens": ("siemens", "G0 X5 M6\nX9\n", START, {}),
    "a program of the builder's": ("fanuc", "G0 X5. M100\nX9.\n", START, {}),
    "M100 of Mach": ("mach", "G0 X5. M100\nX9.\n", START, {}),
    "T that may call O9000": ("fanuc", "T5 G0 X5.\nX9.\n", START, {}),
    "home, and M6": (
        "fanuc", "G91 G28 Z0. M6\nG90 G0 Z9.\n", START, {"offsets": PLACES, "home": HOME}
    ),
    "home, or where tools are changed": (
        "haas", "G28 M6\nG90 G0 Z9.\n", START,
        {"offsets": PLACES, "home": HOME, "tool_change": {"Z": -5.0}},
    ),
    "where tools are changed, or the move": (
        "fanuc", "G0 Z50. M6\nZ9.\n", START, {"offsets": PLACES, "tool_change": {"Z": 0.0}}
    ),
    "G40 without a move": ("fanuc", COMPENSATED + "G40\nG0 Z9.\n", COMPENSATION, {}),
    "G40 beside Z": ("haas", COMPENSATED + "G0 G40 Z9.\n", COMPENSATION, {}),
    "of a lathe": ("fanuc-lathe-a", "G41 G1 X5.\nZ9.\nG40\nG0 C5.\n", COMPENSATION, {}),
    "of the kin": ("syntec", COMPENSATED + "G40\nG0 Z9.\n", COMPENSATION, {}),
    "home does not end it for certain": (
        "fanuc", COMPENSATED + "G28 X0. Y0.\nG40\nG0 Z9.\n", COMPENSATION, {}
    ),
    "many lines without a move in the plane": (
        "fanuc", COMPENSATED + "G40\n" + "G0 Z9.\nZ8.\n" * 40, COMPENSATION, {}
    ),
    "compensation in space": ("haas", "G141 D1\nG49\nG0 X1. Y1. Z1.\nX5.\n", COMPENSATION, {}),
    "the same of Fanuc": ("fanuc", "G41.2 D1\nG49\nG0 X1. Y1. Z1.\nX5.\n", COMPENSATION, {}),
    "drilled along Y, or along Z": (
        "fanuc", "G18\nG99 G81 X9. Y-5. Z2. R2. F9.\nG80\nG0 Y5.\n", START, {}
    ),
    "so on Mach": ("mach", "G18\nG99 G81 X9. Y-5. Z2. R2. F9.\nG80\nG0 Y5.\n", START, {}),
    "a tilted plane": ("fanuc", f"G68.3 X0. Y0. Z0.\n{MODES}G0 X1. Y1. Z1.\nX5.\n", ROTATION, {}),
    "offsets that follow a table": (
        "fanuc", f"G54.2 P1\n{MODES}G0 X1. Y1. Z1.\nX5.\n", ROTATION, {}
    ),
    "an axis that follows the path": (
        "fanuc", f"G41.1\n{MODES}G0 X1. Y1. Z1.\nX5.\n", ROTATION, {}
    ),
    "an axis that only seems to move": (
        "fanuc", f"G7 X0.\n{MODES}G0 X1. Y1. Z1.\nX5.\n", ROTATION, {}
    ),
    "a length along an axis that turns": (
        "fanuc", "G43.1 H1\nG0 X1. Y1. Z1.\nX5.\n", ROTATION, {}
    ),
    "no move behind G80 of Mach": ("mach", "G80\nX5.\nG0 X9.\n", START, {}),
    "G53 cancels the length": (
        "fanuc", "G43 H1 Z50.\nG53 Z0.\nZ9.\n", START,
        {"offsets": PLACES, "tool_lengths": {1: 100.0}},
    ),
    "so does G28": (
        "fanuc", "G43 H1 Z50.\nG28 Z0.\nZ9.\n", START,
        {"offsets": PLACES, "tool_lengths": {1: 100.0}, "home": HOME},
    ),
    "another unit in the midst": ("fanuc", "G20\nG0 X2.\n", START, {}),
    "so of a lathe": ("fanuc-lathe-a", "G20\nG0 X2.\n", START, {}),
    "of Mitsubishi": ("mitsubishi", "G20\nG0 X2.\n", START, {}),
    "G98 behind another length": ("fanuc", DRILLED + "G43 H1 X5.\nG80\nG0 Z9.\n", START, {}),
    "behind another system": ("fanuc", DRILLED + "G55 X5.\nG80\nG0 Z9.\n", START, {}),
    "behind G52": ("haas", DRILLED + "G52 Z5.\nX5.\nG80\nG0 Z9.\n", START, {}),
    "behind G92": ("haas", DRILLED + "G92 Z5.\nX5.\nG80\nG0 Z9.\n", START, {}),
    "behind G43 of Mach": ("mach", DRILLED + "G43 H1\nX5.\nG80\nG0 Z9.\n", START, {}),
    "behind G28": ("fanuc", DRILLED + "G28 Z9.\nX5.\nG80\nG0 Z9.\n", START, {}),
    "T within a cycle": ("fanuc", DRILLED + "T2 X5.\nG80\nG0 Z9.\n", START, {}),
    "Y beside a dwell": ("fanuc", "G0 Y5. G4 P1.\nY9.\n", START, {}),
    "X beside a dwell": ("haas", "G0 X5. G4 P1.\nX9.\n", START, {}),
    "Z beside a dwell of a lathe": ("fanuc-lathe-a", "G0 Z5. G4 P1.\nZ9.\n", START, {}),
    "parameters of Centroid": (
        "centroid", f"G10 P81 R5.\n{MODES}G0 X1. Y1. Z1.\nX2.\n", Reason.SYSTEM_WRITTEN, {}
    ),
    "a spindle that is the C axis": ("fanuc", "G0 C5.\nM3 S9\nC9.\n", START, {"wraps": C}),
    "of a lathe's": ("fanuc-lathe-a", "G0 C5.\nM19\nC9.\n", START, {"wraps": C}),
    "of a Haas": ("haas", "G0 C5.\nM4 S9\nC9.\n", START, {"wraps": C}),
    "a mirror by an M code": (
        "fanuc", f"M21\n{MODES}G0 X1. Y1. Z1.\nX5.\n", ROTATION, {}
    ),
    "so of the kin's": ("syntec", f"M22\n{MODES}G0 X1. Y1. Z1.\nX5.\n", Reason.NOT_UNDERSTOOD, {}),
    "axis words beside G50": ("fanuc", "G0 G50 X7.\nX9.\n", START, {}),
    "so of Mach": ("mach", "G50 X7.\nG0 X9.\n", START, {}),
    "a code that may last": (
        "fanuc", f"G51.2 P1 Q2\n{MODES}G0 X1. Y1. Z1.\nX5.\n", ROTATION, {}
    ),
    "the same of Haas": (
        "haas", f"G43.7 H2\n{MODES}G0 X1. Y1. Z1.\nX5.\n", ROTATION, {}
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", NOT_CERTAIN)
def test_what_only_looks_certain_is_left_alone(name):
    dialect, text, reason, facts = NOT_CERTAIN[name]
    assert read(text.encode(), dialect, **facts)[-1] == reason
    assert also_noticed(text.encode(), dialect, **facts)


STILL_CERTAIN = {
    "both mirrors end": ("fanuc", MIRRORED + "G50.1 X0. Y0.\nG0 X5. Y5.\nX6.\n", {}),
    "one behind the other": (
        "haas", "G101 X0. Y0.\nG100 X0.\nG100 Y0.\nG0 X5. Y5. Z5.\nX6.\n", {}
    ),
    "no mirror": ("fanuc", "G50.1\nG0 X5.\n", {}),
    "M6 alone": ("haas", "T1 M6\nG0 X5. Y5.\nX9.\n", {}),
    "M6 in front of the move": ("linuxcnc", "T1 M6 G0 X5 Y5\nX9\n", {}),
    "M6 that leaves X alone": ("fanuc", "M6\nG0 X9.\n", {"tool_change": {"Z": 0.0}}),
    "a switch": ("fanuc", "G0 X5. M8\nX9.\n", {}),
    "G40 with a move": ("fanuc", COMPENSATED + "G40 X7. Y5.\nG0 Z9.\n", {}),
    "G40, then a move": ("fanuc", COMPENSATED + "G40\nG0 X7. Y5.\nZ9.\n", {}),
    "many lines behind the move": (
        "fanuc", COMPENSATED + "G40\nG1 X7. Y5.\n" + "G0 Z9.\nG1 Z3.\n" * 40 + "G0 Z5.\n", {}
    ),
    "G40 again": ("fanuc", "G40\nG0 Z9.\n", {}),
    "compensation in space ends": (
        "haas", "G141 D1\nG40 G49\nG1 X1. Y1. Z1.\nG0 X5.\n", {}
    ),
    "a tilted plane ends": ("fanuc", "G68.3 X0. Y0. Z0.\nG69\nG0 G54 X1. Y1.\nX5.\n", {}),
    "the same unit again": ("fanuc", "G21\nG0 X2.\n", {}),
    "two places in the other": ("fanuc", "G20\nG0 X2.\nX3.\n", {}),
    "G53 without a length": ("fanuc", "G53 Z0.\nG0 Z9.\n", {"offsets": PLACES}),
    "drilled in one system": ("fanuc", DRILLED + "G54 X5.\nG80\nG0 Z9.\n", {}),
    "a dwell within a cycle": ("fanuc", DRILLED + "G4 X1.\nX5.\nG80\nG0 Z9.\n", {}),
    "a dwell of X": ("fanuc", "G4 X1.\nG0 X9.\n", {}),
    "behind a contour that ends what it began": (
        "fanuc-lathe-a",
        "G72 P10 Q20 U.2 W.1 F.2\nN10 G42 G0 X30.\nG1 Z-9.\nN20 G40 X52.\nG0 X60. Z5.\nX70. Z9.\n",
        {},
    ),
    "a contour once more": (
        "fanuc-lathe-a",
        FINISHED.format("") + "G1 X60. F.1\nG70 P10 Q20\nG0 X60. Z5.\nX70. Z9.\n",
        {},
    ),
    "compensation that ends behind it": (
        "fanuc-lathe-a",
        FINISHED.format("G42 ") + "G70 P10 Q20\nG40 G1 X60. F.1\nG0 X60. Z5.\nX70. Z9.\n",
        {},
    ),
    "a dwell of U": ("fanuc-lathe-a", "G4 U1.\nG0 X9.\n", {}),
    "G99 in another system": (
        "fanuc", "G99 " + DRILLED[4:] + "G55 X5.\nG80\nG0 Z9.\n", {}
    ),
    "drilled in G17": ("fanuc", "G99 G81 X9. Y-5. Z2. R3. F9.\nG80\nG0 Z5.\n", {}),
    "an axis that no spindle turns": ("fanuc", "G0 A5.\nM3 S9\nA9.\n", {"wraps": {"A": "none"}}),
    "G50 alone": ("fanuc", "G50\nG0 X9.\n", {}),
    "a relay of Haas": ("haas", f"M21\n{MODES}G0 X1. Y1. Z1.\nX5.\n", {}),
}  # fmt: skip


@pytest.mark.parametrize("name", STILL_CERTAIN)
def test_what_is_certain_is_still_rewritten(name):
    dialect, text, facts = STILL_CERTAIN[name]
    assert read(text.encode(), dialect, **facts)[-1] is None


def test_the_motion_may_follow_g60_or_not():
    """5431#0 makes it modal: then `X9.` is another such positioning."""
    assert read(b"G60 X5.\nX9.\nX7.\nG0 X1.\nX2.\n", "fanuc") == [START, None]


def test_a_program_that_is_not_followed_may_have_measured_a_tool():
    text = f"M98 P9000\n{MODES}G0 X1. Y1. Z5.\nG43 H1\nG0 Z9.\n".encode()
    assert read(text, "mach", tool_lengths={1: 100.0}, spindle="mill")[-1] == START


@pytest.mark.parametrize("dialect", ["fanuc", "haas", *KIN])
def test_a_mirror_without_axes_is_ended_by_nobody_for_certain(dialect):
    text = MIRRORED + "G50.1\nG0 X5. Y5.\nX6.\n"
    assert read(text.encode(), dialect)[-1] == ROTATION


@pytest.mark.parametrize("beside", ["G51.1 X0.", "G50.1 X0.", "G22 X9."])
def test_whether_f_beside_it_is_a_feed_nobody_says(beside):
    """A stream puts the F back that is in force behind it."""
    text = f"{beside} F90.\nG50.1 X0.\nG0 X5. Y5.\nX6.\nG1 Y6.\n"
    assert read(text.encode(), "fanuc")[-1] == Reason.FEED_UNKNOWN


# What replaces a rapid is a feed move: where overrides and feed hold are off, nobody can slow it.
OFF = {
    "tapping mode": ("fanuc", "G63\nG0 X5.\n"),
    "tapping mode of Haas": ("haas", "G63\nG0 X5.\n"),
    "tapping mode of a lathe": ("fanuc-lathe-a", "G63\nG0 X5.\n"),
    "all of them": ("fanuc", "#3004=7\nG90 G54 G49 G0 X1. Y1. Z1.\nX5.\n"),
    "feed hold": ("fanuc", "#3004 = 1\nG90 G54 G49 G0 X1. Y1. Z1.\nX5.\n"),
    "by a variable": ("fanuc", "#3004=#500\nG90 G54 G49 G0 X1. Y1. Z1.\nX5.\n"),
    "of Haas": ("haas", "#3004=2\nG90 G54 G49 G0 X1. Y1. Z1.\nX5.\n"),
}
ON = {
    "cutting mode again": ("fanuc", "G63\nG64\nG0 X5.\n"),
    "exact stop": ("fanuc", "G63\nG61\nG0 X5.\n"),
    "corners": ("fanuc", "G62\nG0 X5.\n"),
    "a lathe's": ("fanuc-lathe-a", "G63\nG64\nG0 X5.\n"),
    "on again": ("fanuc", "#3004=7\n#3004=0\nG90 G54 G49 G0 X1. Y1. Z1.\nX5.\n"),
    "computed": ("fanuc", "#1=0\n#3004=7\n#3004=#1\nG90 G54 G49 G0 X1. Y1. Z1.\nX5.\n"),
    "single block": ("fanuc", "#3003=1\nG90 G54 G49 G0 X1. Y1. Z1.\nX5.\n"),
}


@pytest.mark.parametrize(("dialect", "text"), OFF.values(), ids=OFF)
def test_where_overrides_or_feed_hold_are_off_rapids_stay_as_they_are(dialect, text):
    facts = {"decimal_point": "calculator"}
    assert read(text.encode(), dialect, **facts)[-1] == Reason.OVERRIDES_OFF
    assert also_noticed(text.encode(), dialect, **facts)


@pytest.mark.parametrize(("dialect", "text"), ON.values(), ids=ON)
def test_where_they_are_on_again_rapids_are_certain(dialect, text):
    assert read(text.encode(), dialect, decimal_point="calculator")[-1] is None


def test_a_program_that_never_switches_them_off_has_them_on_behind_a_call():
    text = "M98 P9\nG21 G90 G40 G94 G49 G54 F9.\nG0 X1. Y1. Z1.\nX5.\n"
    facts = {"decimal_point": "calculator"}
    assert read(text.encode(), "fanuc", **facts)[-1] != Reason.OVERRIDES_OFF
    again = "G63\nG64\n" + text
    assert read(again.encode(), "fanuc", **facts)[-1] == Reason.OVERRIDES_OFF
