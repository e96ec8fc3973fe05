"""Every remedy helps: a rapid that has the reason, and the same one once its remedy is taken.

Reasons are promises to whoever reads a report at the machine: what stands there as what helps has
to. Each case is a program and what of the machine file matters, and the same once more.
"""

from dataclasses import dataclass, field
from typing import Any

import pytest
import yaml

from gcodejerk.machine import Machine
from gcodejerk.reasons import EXPLAINED, Reason
from gcodejerk.rewrite.pipeline import process

RAPID = {"velocity": 300, "acceleration": 2500, "jerk": 6.0e4}
AXES = {
    "X": {"rapid": RAPID, "modes": [{"frequency": 27, "damping": 0.02}]},
    "Y": {"rapid": RAPID},
    "Z": {"rapid": RAPID, "modes": [{"frequency": 41, "damping": 0.02}]},
}
LINUXCNC, FANUC, HAAS, SIEMENS, GRBL = "linuxcnc", "fanuc", "haas", "siemens", "grbl"


@dataclass(frozen=True)
class Case:
    """A program before and after, and what is said beside it.

    Attributes
    ----------
    reason : Reason
        What is said of the rapid, which is the one with `77`.
    name : str
        What of the remedy is taken.
    dialect : str
        Of the program.
    before, after : str
        The program; the same where a machine file or an option helps.
    machine, then : dict
        What stands in the machine file, besides axes; and what is written there then.
    call : dict
        Options of `process`, then.
    files : dict
        Files beside the machine file.
    """

    reason: Reason
    name: str
    dialect: str
    before: str
    after: str = ""
    machine: dict[str, Any] = field(default_factory=dict)
    then: dict[str, Any] = field(default_factory=dict)
    call: dict[str, Any] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)


def program(**entries):
    """The section of that name."""
    return {"program": entries}


def axis(**changed):
    """All axes, with other entries of X."""
    return {"axes": AXES | {"X": AXES["X"] | changed}}


def stepping(resolution):
    """All axes, with another resolution of Y."""
    return {"axes": AXES | {"Y": AXES["Y"] | {"resolution": resolution}}}


def options(**entries):
    """The section of that name."""
    return {"controller_options": entries}


CONTROLLERS = (FANUC, HAAS, SIEMENS, GRBL)
ROTARY = {"rapid": {"velocity": 90, "acceleration": 500, "jerk": 5.0e3}}
MODE = [{"frequency": 13, "damping": 0.02, "participation": {"A": 0.01}}]
HALF = {"acceleration": 600, "jerk": 9.0e3}
TURNS = {"axes": AXES | {"A": ROTARY}, "modes": MODE}
WRAPS = {"axes": AXES | {"A": ROTARY | {"wrap": "shortest"}}, "modes": MODE}
PLACES = {
    "offsets": {"G54": {"X": 5, "Y": 5, "Z": 5}, "H1": 80},
    "home": {"X": 0, "Y": 0, "Z": 0},
}
START = "G17 G21 G40 G49 G54 G80 G90 G94\n"
KNOWN = START + "F500.\nG0 X3. Y3. Z3.\n"
FRAMED = "G17 G710 G40 G54 G90 G94\nF500.\nG0 X3. Y3. Z3.\n"
KLARTEXT = "BEGIN PGM P MM\nL X+3 Y+3 Z+3 R0 F900\nL X+9 RL\nL X+12{}\nL X+77 FMAX\nEND PGM P MM\n"
MILL = KNOWN.replace("G49 ", "")
BOTH = KNOWN + "G0 A10.\n"
AT = "G0 X77.\nM2\n"
LOOP = "o1 repeat [2]\nG91 G0 X77.\nG1 X-3.\nG90\no1 endrepeat\nM2\n"
CALLS = "O1\n" + KNOWN + "M98 P2\nG0 X9.\nM98 P2\nM30\nO2\nG91\nG0 X77.\nG90\nM99\n"
CYCLE = "G98 G81 X77. Y5. R1. Z-5.\nX80.\nG80\nM2\n"
PRINTER = {"controller": "marlin", "spindle": "mill"}
SLOWED = "M204 S2000\nG21\nG90\nG0 X3 Y3 Z3 F9000\nG0 X77\n"
DIAGONAL = "M204 T2500\nG21\nG90\nG1 X3 Y3 Z3 F9000\nG0 X77 Z77\n"
BEAM = MILL + "M3 S100\nG1 Z1.\n"

CASES = [
    Case(Reason.AFTER_END, "the end is taken out", LINUXCNC, KNOWN + "M2\n" + AT, KNOWN + AT),
    Case(Reason.BLOCK_DELETE, "the slash is taken out", LINUXCNC, KNOWN + "/" + AT, KNOWN + AT),
    Case(Reason.SUBPROGRAM, "unroll a loop", LINUXCNC, KNOWN + LOOP, call={"unroll": True}),
    Case(Reason.SUBPROGRAM, "unroll calls", FANUC, CALLS, call={"unroll": True}),
    Case(
        Reason.SUBPROGRAM, "posted in full", LINUXCNC, KNOWN + LOOP,
        KNOWN + "G91 G0 X77.\nG1 X-3.\nG0 X77.\nG1 X-3.\nM2\n",
    ),
    Case(
        Reason.NOT_UNDERSTOOD, "the block is corrected", LINUXCNC,
        KNOWN + "G0 X77. X2.\nM2\n", KNOWN + "G0 X77. Y2.\nM2\n",
    ),
    Case(
        Reason.NOT_UNDERSTOOD, "the dialect is stated", LINUXCNC, KNOWN + "G187 P3\n" + AT,
        call={"dialect": HAAS},
    ),
    Case(
        Reason.NOT_UNDERSTOOD, "harmless", FANUC, KNOWN + "G131\n" + AT,
        then=program(harmless=["G131"]),
    ),
    Case(
        Reason.NOT_UNDERSTOOD, "G40 and the other modes", FANUC, KNOWN + "G131\n" + AT,
        KNOWN + "G131\n" + KNOWN + AT,
    ),
    Case(
        Reason.EXPRESSION, "variables are set", LINUXCNC,
        KNOWN + "G0 X[#3000 + 77]\nM2\n", KNOWN + "#3000 = 1\nG0 X[#3000 + 77]\nM2\n",
    ),
    Case(
        Reason.EXPRESSION, "to any number", LINUXCNC,
        KNOWN + "G0 X[#3000 + 77 / 3]\nM2\n", KNOWN + "#3000 = 1\nG0 X[#3000 + 77 / 3]\nM2\n",
    ),
    Case(
        Reason.EXPRESSION, "whole increments", FANUC,
        KNOWN + "G0 X[#100+77.]\nM30\n", KNOWN + "#100=1.5\nG0 X[#100+77.]\nM30\n",
    ),
    Case(
        Reason.EXPRESSION, "variables of Siemens are set", SIEMENS,
        FRAMED + "G64\nG0 X=R1+77\nM30\n", FRAMED + "G64\nR1=2\nG0 X=R1+77\nM30\n",
    ),
    Case(Reason.DECIMAL_POINT, "a point", FANUC, KNOWN + "G0 X77\nM2\n", KNOWN + AT),
    Case(
        Reason.DECIMAL_POINT, "decimal_point", FANUC, KNOWN + "G0 X77\nM2\n",
        then=program(decimal_point="calculator"),
    ),
    Case(
        Reason.CANNED_CYCLE, "expand-cycles", LINUXCNC, KNOWN + CYCLE, call={"expand_cycles": True}
    ),
    Case(
        Reason.CANNED_CYCLE, "single moves", LINUXCNC, KNOWN + CYCLE,
        KNOWN + "G0 X77. Y5.\nG0 Z1.\nG1 Z-5.\nG0 Z3.\nX80.\nM2\n",
    ),
    Case(
        Reason.FRAME_CHANGE, "offsets for a work system", FANUC,
        KNOWN + "G55 G0 X77. Y1. Z1.\nM2\n",
        machine=program(startup="G69"),
        then=program(offsets={"G54": {"X": 5, "Y": 5, "Z": 5}, "G55": {"X": 1, "Y": 1, "Z": 1}}),
    ),
    Case(
        Reason.FRAME_CHANGE, "a plain G0", LINUXCNC,
        KNOWN + "G53 G0 Z0. (77)\nM2\n", KNOWN + "G0 Z77.\nM2\n",
    ),
    Case(
        Reason.FRAME_CHANGE, "a plain G0 in front of G53", HAAS,
        KNOWN + "G53 G0 Z0. M9 (77)\nM2\n", KNOWN + "G0 Z77.\nG53 G0 Z0. M9\nM2\n",
    ),
    Case(
        Reason.FRAME_CHANGE, "a plain G0 in front of G28", FANUC,
        KNOWN + "G91 G28 Z0. (77)\nM2\n", KNOWN + "G0 Z77.\nG91 G28 Z0.\nM2\n",
    ),
    Case(
        Reason.FRAME_CHANGE, "a plain G0 behind G43", HAAS,
        KNOWN + "G0 G43 H1 Z77. M8\nM2\n", KNOWN + "G0 G43 H1 Z99. M8\nG0 Z77.\nM2\n",
    ),
    Case(
        Reason.FRAME_CHANGE, "G43 in a block of its own", LINUXCNC,
        KNOWN + "G43 H1 G0 Z77.\nM2\n", KNOWN + "G43 H1\nG0 X9. Y9. Z9.\nG0 Z77.\nM2\n",
    ),
    Case(
        Reason.NOT_FOLLOWED, "the text of what is called", FANUC, KNOWN + "M98 P7\n" + AT,
        files={"O0007.nc": "O7\nG4 P100\nM99\n"}, then=program(subprograms="."),
    ),
    Case(
        Reason.NOT_FOLLOWED, "the modes behind it", FANUC, KNOWN + "M98 P7\n" + AT,
        KNOWN + "M98 P7\n" + KNOWN + "G64\n" + AT,
    ),
    Case(
        Reason.LINES_READ, "without it", LINUXCNC,
        KNOWN + AT + "G1 Y#<_line> F100\n", KNOWN + AT + "G1 Y7 F100\n",
    ),
    Case(
        Reason.PATH_UNKNOWN, "G64 behind what may be skipped", LINUXCNC,
        KNOWN + "/G61\n" + AT, KNOWN + "/G61\nG64\n" + AT,
    ),
    Case(
        Reason.NOT_FOLLOWED, "synchronized actions", SIEMENS,
        FRAMED + "G64\nIDS=1 WHENEVER $A_IN[1]==1 DO $A_OUT[1]=1\n" + AT, FRAMED + "G64\n" + AT,
    ),
    Case(
        Reason.CUTTER_COMPENSATION, "G40", LINUXCNC,
        KNOWN + "G41 D1\nG1 X9.\n" + AT, KNOWN + "G41 D1\nG1 X9.\nG40\nG1 X12.\n" + AT,
    ),
    Case(
        Reason.CUTTER_COMPENSATION, "G40 with a move", FANUC,
        KNOWN + "G41 D1 G1 X9. F100.\nX11.\nG40\nG0 Z77.\n",
        KNOWN + "G41 D1 G1 X9. F100.\nX11.\nG40 X12. Y5.\nG0 Z77.\n",
    ),
    Case(
        Reason.CUTTER_COMPENSATION, "R0", "klartext", KLARTEXT.format(""), KLARTEXT.format(" R0"),
        machine={"controller": "csv"},
    ),
    Case(
        Reason.ROTATION, "G69", FANUC, KNOWN + "G68 X0. Y0. R30.\n" + AT,
        KNOWN + "G68 X0. Y0. R30.\nG69\nG0 X1. Y1. Z1.\n" + AT,
    ),
    Case(
        Reason.ROTATION, "G50", HAAS, KNOWN + "G51 X0. Y0. Z0. P2.\n" + AT,
        KNOWN + "G51 X0. Y0. Z0. P2.\nG50\nG0 X1. Y1. Z1.\n" + AT,
    ),
    Case(
        Reason.SYSTEM_WRITTEN, "the work system again", FANUC, KNOWN + "#5221=4.\n" + AT,
        KNOWN + "#5221=4.\nG55\nG54\nG43 H1\nG0 X1. Y1. Z1.\n" + AT,
    ),
    Case(
        Reason.LOOK_AHEAD, "G103", HAAS, KNOWN + "G103 P1\n" + AT, KNOWN + "G103 P1\nG103\n" + AT
    ),
    Case(
        Reason.COMPRESSED, "COMPOF", SIEMENS, FRAMED + "G64\nCOMPCAD\n" + AT,
        FRAMED + "G64\nCOMPCAD\nCOMPOF\n" + AT + "COMPCAD\n",
    ),
    Case(
        Reason.FEED_GROUP, "FGROUP()", SIEMENS, FRAMED + "G64\nFGROUP(X,Y)\n" + AT,
        FRAMED + "G64\nFGROUP(X,Y)\nFGROUP()\n" + AT,
    ),
    Case(
        Reason.FEED_SCALED, "M52 P0", LINUXCNC, KNOWN + "M52 P1\n" + AT,
        KNOWN + "M52 P1\nM52 P0\n" + AT,
    ),
    Case(
        Reason.FEED_SCALED, "OVR taken out", SIEMENS, FRAMED + "G64\nOVR=50\n" + AT,
        FRAMED + "G64\n" + AT,
    ),
    Case(
        Reason.DISTANCE_MODE_UNKNOWN, "G90 in the program", SIEMENS,
        (FRAMED + "G64\n" + AT).replace("G90 ", ""), FRAMED + "G64\n" + AT,
    ),
    Case(
        Reason.DISTANCE_MODE_UNKNOWN, "startup", FANUC, (KNOWN + AT).replace("G90 ", ""),
        then=program(startup="G90"),
    ),
    Case(
        Reason.UNITS_UNKNOWN, "G21 in the program", FANUC,
        (KNOWN + AT).replace("G21 ", ""), KNOWN + AT,
    ),
    Case(
        Reason.UNITS_UNKNOWN, "startup", FANUC, (KNOWN + AT).replace("G21 ", ""),
        then=program(startup="G21"),
    ),
    Case(
        Reason.FEED_UNIT, "startup", SIEMENS, (FRAMED + "G64\n" + AT).replace("G710", "G71"),
        then=program(startup="G71"),
    ),
    Case(
        Reason.FEED_UNIT, "G710", SIEMENS, (FRAMED + "G64\n" + AT).replace("G710", "G71"),
        (FRAMED + "G64\n" + AT),
    ),
    Case(Reason.PATH_UNKNOWN, "G64", SIEMENS, FRAMED + AT, FRAMED + "G64\n" + AT),
    Case(Reason.PATH_UNKNOWN, "startup", SIEMENS, FRAMED + AT, then=program(startup="G64")),
    Case(
        Reason.START_UNKNOWN, "start", LINUXCNC, START + "F500\n" + AT,
        then=program(start={"X": 0, "Y": 0, "Z": 0}),
    ),
    Case(
        Reason.START_UNKNOWN, "offsets", FANUC, KNOWN + "G55\n" + AT,
        then=program(offsets={"G54": {"X": 5, "Y": 5, "Z": 5}, "G55": {"X": 1, "Y": 1, "Z": 1}}),
    ),
    Case(
        Reason.START_UNKNOWN, "a tool length", LINUXCNC, KNOWN + "G43 H1\nG0 Z77.\nM2\n",
        then=program(offsets={"H1": 80}),
    ),
    Case(
        Reason.START_UNKNOWN, "home", FANUC, KNOWN + "G91 G28 X0.\nG90\n" + AT,
        then=program(**PLACES),
    ),
    Case(
        Reason.START_UNKNOWN, "tool_change", FANUC, KNOWN + "T2 M6\n" + AT,
        then=program(tool_change={}),
    ),
    Case(
        Reason.START_UNKNOWN, "resume_after_stop", FANUC, KNOWN + "M0\n" + AT,
        then=program(resume_after_stop="same"),
    ),
    Case(
        Reason.ROTARY_WAY, "wrap", FANUC, BOTH + "G0 A77.\nM2\n", machine=TURNS,
        then=WRAPS,
    ),
    Case(
        Reason.MIXED_AXES, "blocks of their own", FANUC,
        BOTH + "G0 X77. A20.\nM2\n", BOTH + "G0 X77.\nG0 A20.\nM2\n", machine=WRAPS,
    ),
    Case(
        Reason.LIMIT_SET, "the limit in the machine file", "marlin", SLOWED,
        machine=PRINTER, then=PRINTER | {
            "axes": {name: one | {"rapid": RAPID | {"acceleration": 2000}}
                     for name, one in AXES.items()},
        },
    ),
    Case(
        Reason.LIMIT_SET, "the line is taken out", "marlin", SLOWED,
        SLOWED.replace("M204 S2000\n", ""), machine=PRINTER,
    ),
    Case(
        Reason.OVERRIDES_OFF, "G64", FANUC, KNOWN + "G63\n" + AT, KNOWN + "G63\nG64\n" + AT,
    ),
    Case(
        Reason.LIMIT_SET, "DYNNORM", SIEMENS, FRAMED + "G64\nDYNFINISH\n" + AT,
        FRAMED + "G64\nDYNFINISH\nDYNNORM\n" + AT,
    ),
    Case(
        Reason.LIMIT_SET, "BRISK", SIEMENS, FRAMED + "G64\nDRIVE\n" + AT,
        FRAMED + "G64\nDRIVE\nBRISK\n" + AT,
    ),
    Case(
        Reason.COMPRESSED, "COMPOF DYNNORM", SIEMENS, FRAMED + "G64\nCYCLE832(0.05,1,1)\n" + AT,
        FRAMED + "G64\nCYCLE832(0.05,1,1)\nCOMPOF DYNNORM\n" + AT,
    ),
    Case(
        Reason.LIMIT_SET, "so much higher", "marlin", DIAGONAL,
        DIAGONAL.replace("T2500", "T3536"), machine=PRINTER,
    ),
    Case(
        Reason.LIMIT_SET, "blocks of their own", "marlin", DIAGONAL,
        DIAGONAL.replace("G0 X77 Z77", "G0 X77\nG0 Z77"), machine=PRINTER,
    ),
    Case(
        Reason.LIMIT_SET, "ACC in percent", SIEMENS, FRAMED + "G64\nACC[X]=50\n" + AT,
        FRAMED + "G64\nACC[X]=50\nACC[X]=100\n" + AT,
    ),
    Case(
        Reason.APART, "Z in a block of its own", "centroid",
        KNOWN + "G0 X77. Z9.\nM2\n", KNOWN + "G0 X77.\nG0 Z9.\nM2\n",
    ),
    Case(
        Reason.OTHER_WORDS, "m_after", FANUC, KNOWN + "G0 X77. M5\nM2\n",
        then=program(m_after=["M5"]),
    ),
    Case(
        Reason.OTHER_WORDS, "m_before", FANUC, KNOWN + "G0 X77. M5\nM2\n",
        then=program(m_before=["M5"]),
    ),
    Case(
        Reason.OTHER_WORDS, "a block of its own", FANUC, KNOWN + "G0 X77. M5\nM2\n",
        KNOWN + "G0 X77.\nM5\nM2\n",
    ),
    Case(
        Reason.FEED_UNKNOWN, "F in front", LINUXCNC,
        (KNOWN + "G0 X77.\nG1 X80.\nM2\n").replace("F500.\n", ""),
        KNOWN + "G0 X77.\nG1 X80.\nM2\n",
    ),
    Case(
        Reason.FEED_UNKNOWN, "F in the feed move", LINUXCNC,
        (KNOWN + "G0 X77.\nG1 X80.\nM2\n").replace("F500.\n", ""),
        (KNOWN + "G0 X77.\nG1 X80. F500.\nM2\n").replace("F500.\n", "", 1),
    ),
    Case(Reason.BEAM, "spindle", GRBL, BEAM + AT, then={"spindle": "mill"}),
    Case(
        Reason.AXIS_UNKNOWN, "axes", LINUXCNC, KNOWN + "G0 B3.\nG0 X77. B9.\nM2\n",
        machine={"controller": "csv"},
        then={"axes": AXES | {"B": ROTARY | {"wrap": "none"}}, "controller": "csv"},
    ),
    Case(
        Reason.NO_MODE, "modes", LINUXCNC, KNOWN + AT,
        machine={"axes": {name: {"rapid": RAPID} for name in "XYZ"}}, then={"axes": AXES},
    ),
    Case(
        Reason.NO_BLENDING, "X, Y and Z in a block of their own", LINUXCNC,
        BOTH + "G0 X77. A20.\nM2\n", BOTH + "G0 X77.\nG0 A20.\nM2\n", machine=WRAPS,
    ),
    Case(
        Reason.TOO_SHORT, "minimum_length", LINUXCNC, KNOWN + AT,
        machine={"design": {"minimum_length": 100}}, then={"design": {"minimum_length": 1}},
    ),
    Case(
        Reason.BEYOND_TRAVEL, "the number", LINUXCNC,
        KNOWN + "G0 X7700.\nM2\n", KNOWN + AT,
        machine=axis(travel=[0, 500]) | program(offsets={"G54": {"X": 0, "Y": 0, "Z": 0}}),
    ),
    Case(
        Reason.BEYOND_TRAVEL, "travel", LINUXCNC, KNOWN + AT,
        machine=axis(travel=[0, 50]) | program(offsets={"G54": {"X": 0, "Y": 0, "Z": 0}}),
        then=axis(travel=[0, 500]),
    ),
    Case(
        Reason.BEYOND_TRAVEL, "offsets", LINUXCNC, KNOWN + AT,
        machine=axis(travel=[0, 500]) | program(offsets={"G54": {"X": 1000, "Y": 0, "Z": 0}}),
        then=program(offsets={"G54": {"X": 10, "Y": 0, "Z": 0}}),
    ),
    Case(
        Reason.LINE_LIMIT, "the comment in a block of its own", GRBL,
        MILL + f"G0 X77. M8 ({'c' * 75})\nM2\n", MILL + f"({'c' * 75})\nM8\nG0 X77.\nM2\n",
        machine={"spindle": "mill"}, then={"spindle": "mill"},
    ),
    Case(
        Reason.LINE_LIMIT, "resolution", FANUC, KNOWN + AT,
        machine=axis(resolution=1e-8), then=axis(resolution=1e-4),
    ),
    Case(
        Reason.LIMITS, "max_extension", LINUXCNC, KNOWN + AT,
        machine=axis(limit=HALF) | {"design": {"max_extension": 0.0}},
        then=axis(limit=HALF) | {"design": {"max_extension": 4.0}},
    ),
    Case(
        Reason.LIMITS, "limit.acceleration", LINUXCNC, KNOWN + AT,
        machine=axis(limit=HALF), then=axis(limit={"acceleration": 2500, "jerk": 1.2e5}),
    ),
    Case(
        Reason.NOT_PLAYED, "positioning", LINUXCNC, KNOWN + "G0 X77. Y30.\nM2\n",
        machine={"positioning": "independent"}, then={"positioning": "linear"},
    ),
    Case(
        Reason.NOT_PLAYED, "max_acceleration", LINUXCNC, KNOWN + AT,
        machine=options(max_acceleration={"X": 500}), then=options(max_acceleration={"X": 4000}),
    ),
    Case(
        Reason.NOT_PLAYED, "linuxcnc-hal", LINUXCNC, KNOWN + AT,
        machine=options(max_acceleration={"X": 500}), then={"controller": "linuxcnc-hal"},
    ),
    Case(
        Reason.NOT_PLAYED, "resolution", FANUC, KNOWN + "G0 Y3.004\nG0 X77. Y3.006\nM2\n",
        machine=stepping(0.01), then=stepping(1e-3),
    ),
]  # fmt: skip


def machine(dialect, entries, folder):
    """The machine of a case."""
    head = {"interval": 0.001, "positioning": "linear", "axes": AXES, "dialect": dialect}
    if dialect in CONTROLLERS:
        head["controller"] = dialect
    (folder / "machine.yaml").write_text(yaml.safe_dump(head | entries))
    return Machine.load(folder / "machine.yaml")


def reasons(text, own, **options):
    """Why each rapid with 77 was left alone; None of one that was rewritten."""
    lines = text.splitlines()
    found = process(text.encode(), own, **options)
    return [r.reason for r in found.rapids if "77" in lines[r.line - 1]]


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c.reason.name}-{c.name}")
def test_what_helps_helps(case, tmp_path):
    for name, text in case.files.items():
        (tmp_path / name).write_text(text)
    before = machine(case.dialect, case.machine, tmp_path)
    assert case.reason in reasons(case.before, before)
    then = machine(case.dialect, case.machine | case.then, tmp_path)
    assert set(reasons(case.after or case.before, then, **case.call)) == {None}


def test_a_move_that_is_too_long_helps_as_several(monkeypatch, tmp_path):
    # The real bound, 100 s, makes streams of as many points.
    monkeypatch.setattr("gcodejerk.planning.plan.MOST_INTERVALS", 800)
    own = machine(LINUXCNC, {}, tmp_path)
    assert reasons(KNOWN + "G0 X300. (77)\nM2\n", own) == [Reason.TOO_LONG]
    several = "G0 X150. (77)\nG1 X151.\nG0 X300. (77)\nM2\n"
    assert reasons(KNOWN + several, own) == [None, None]


def test_every_reason_that_can_be_helped_is_helped_here():
    helped = {case.reason for case in CASES} | {Reason.TOO_LONG}
    assert {reason for reason in Reason if not EXPLAINED[reason].remedy.startswith("nothing")} == (
        helped - {Reason.AFTER_END}
    )
