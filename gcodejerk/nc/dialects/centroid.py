"""Centroid CNC12 and CNC11, mills: Fanuc's codes in the language of a control on a PC.

Source: the help texts of dberlin/vscode-centroid-gcode (src/json/help_text.json), which are the
chapters on G and M codes of Centroid's M-series operator's manual, and its grammar
(src/CentroidGCode.g4: the modal groups A to P). What is different from Mach, as which such programs
were read before:

- G0 is no straight line where Z moves with other axes: upwards Z moves first and the others behind
  it, downwards Z comes last (G00 of the manual).
- G53 moves at rapid speed by itself, in G90 alone, and leaves the motion mode as it is.
- G92 sets the origin of the work system in force, for good; G52 shifts all of them.
- G68.1, G43.3, G43.4, G117 to G119 (turned planes of arcs) and G93.1 are its own; G65 and M98 call
  other files.
- Behind G80 the motion in front of the cycle is in force again (G81's example); where its cycles
  end was not looked at closely, so nothing is known there. G10 sets parameters: P81 makes G81 fire
  an M code. M2 moves to the home position; M6, M25, M26, M39, M91, M92 and others move, and every M
  code may be a macro of the owner's.
- ``;`` begins a comment, and so does ``:`` (not read here: a line with it is not understood). That
  ``( )`` is one, FreeCAD's and other posts write; the grammar has it for nothing.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import Dialect, Drilling, grouped
from gcodejerk.nc.dialects.rs274 import RS274
from gcodejerk.nc.dialects.spelling import Text, Writing

SYSTEMS = (540, 550, 560, 570, 580, 590)
CYCLES = frozenset({730, 740, 760, 810, 820, 830, 840, 850, 890})

CENTROID = Dialect(
    name="centroid",
    title="Centroid CNC12, CNC11 mills",
    sources=(
        "Centroid M-series operator's manual, chapters G and M codes, as in "
        "dberlin/vscode-centroid-gcode: src/json/help_text.json",
        "dberlin/vscode-centroid-gcode: src/CentroidGCode.g4",
        "FreeCAD's post centroid",
    ),
    text=Text(
        parentheses="comment",
        semicolon="comment",
        delete="first",
        o_word="error",
        percent="lone",
        names=True,
        variables="none",
        blanks="between",
        line_limit=256,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "feed mode": (930, 940),
            "units": (200, 210),
            "compensation": (400, 410, 420),
            "tool length": (430, 433, 434, 440, 490),
            "retract": (980, 990),
            "system": SYSTEMS,
            "path": (610, 640),
            "cycle": (800, *sorted(CYCLES)),
            "scaling": (500, 510),
            "rotation": (680, 681, 690),
            "stroke limit": (220, 230),
            "harmless dwell": (40,),
            "non-modal": (90, 100, 280, 290, 300, 520, 530, 920),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30, 99),
            "tool": (6,),
            "spindle": (3, 4, 5),
            "coolant": (7, 8, 9),
            # files and outputs; M94/16 and M95/16 have a slash that is not read here
            "clamp": (10, 11),
            "user": (25,),  # Z goes home
            "silent": (107, 108, 109, 127, *range(1000, 1016)),
        }
    ),
    # "G17 is the default plane", G98 the default; G93 lasts until G94 cancels it.
    defaults={"plane": 170, "feed mode": 940, "compensation": 400, "retract": 980},
    effects={
        **dict.fromkeys((280, 290, 300), "home"),
        **dict.fromkeys(SYSTEMS, "system"),
        **dict.fromkeys((430, 433, 434, 440, 490), "length"),
        220: "words",
        100: "data",
        **dict.fromkeys((520, 530, 920), "frames"),
    },
    letters="FSTXYZABCUVWDEHIJKLPQR",
    length_word="H",
    p_selects=frozenset(SYSTEMS),
    transforms={
        **{510: ("scaling", True), 500: ("scaling", False)},
        **{680: ("rotation", True), 681: ("rotation", True), 690: ("rotation", False)},
        **dict.fromkeys((433, 434), ("tool centre point", True)),
        490: ("tool centre point", False),
    },
    bars={100: ("parameters written", True)},  # G10 P
    drilling=Drilling(CYCLES, CYCLES, own_group=True, repeats="KL", missing="unknown"),
    harmless=frozenset(
        {0, 40, 90, 170, 180, 190, 200, 210, 400, 610, 640, 800, 900, 910, 930, 940, 980, 990}
        | {500, 690}
    ),
    dark_rapids=True,
    unknown_lasts=True,
    macro_change=True,
    apart=frozenset("Z"),
    left_at_start=RS274.left_at_start,
    # Every M code may be a macro; which act behind the motion was not found.
    before_m=frozenset(),
    after_m=frozenset({0, 1, 2, 30}),
    writing=Writing((b"; ", b""), b"G4 P0.01", line_limit=79, digits=8),
)
