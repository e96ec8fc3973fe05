"""RepRapFirmware (Duet) in CNC mode, that is behind M453.

Source: Duet3D/RepRapFirmware fc1cd16 (2024-10): src/GCodes/GCodeBuffer/StringParser.cpp (Put,
DecodeCommand, FindParameters, ProcessConditionalGCode), src/GCodes/GCodes.cpp (LoadFeedrate...) and
src/GCodes/GCodes2.cpp (HandleGcode, HandleMcode). What is different from Marlin:

- A line may hold several commands, each with its own parameters, which run in turn: ``G91 G0 X5``
  is one, ``G0 X5 G91`` another. Only modes in front of a last command are taken (`in_turn`).
- G0 to G3 stay in force for lines of axis words alone, but every other command in between ends
  that, a comment on a line of its own too: such lines are left alone here.
- In CNC mode G0 runs as fast as the axes can, and an F beside it is ignored; as a printer (M451) it
  runs at F like G1. A block of G0 with an F is left alone, since the mode may be another; and so
  is a rapid behind which a feed move relies on the F before, which no G0 could restore.
- ``( )`` is a comment in CNC mode alone; one that does not close ends with its line.
- ``if``, ``while``, ``var`` and their kin in small letters are commands, whose blocks are told by
  their indentation: behind one, nothing is rewritten any more. They are commands in front of a line
  alone, and so is ``echo``, which does nothing to the machine.
- ``X1E3`` is X1000 (RRFLibraries, SafeStrtof). M109 may select a tool, and run its macros.
- ``G 0`` is no command, nor is one behind a comment and a blank; a line with N whose checksum is
  wrong is thrown away (so no ``*`` is read here).
- In inches the words of every axis are converted, those of rotary ones, too (GetDistance).
- G28 and codes without a meaning run macros of the owner's; M30 deletes a file.
"""

from __future__ import annotations

from gcodejerk.nc.dialects import limits
from gcodejerk.nc.dialects.dialect import Dialect, Effect, code_names, grouped
from gcodejerk.nc.dialects.spelling import Text, Writing

SYSTEMS = (540, 550, 560, 570, 580, 590, 591, 592, 593)
SILENT = (
    *(7, 8, 9, 17, 20, 21, 22, 27, 36, 39, 42, 73, 82, 83, 104, 105, 106, 107, 110, 111, 114),
    *(115, 116, 119, 122, 140, 141, 144, 150, 190, 191, 201, 203, 204, 205, 207, 300, 302, 303),
    *(308, 400, 408, 409, 453, 500, 503, 566, 572, 593, 906, 913),
)
"""M codes that move nothing and change no frame."""
_META = (
    "IF",
    "ELIF",
    "ELSE",
    "WHILE",
    "BREAK",
    "CONTINUE",
    "ABORT",
    "VAR",
    "GLOBAL",
    "SET",
    "SKIP",
)
_EFFECTS: dict[int, Effect] = {
    40: "words",
    100: "data",
    **dict.fromkeys((110, 280, 290, 300, 310, 320, 380, 382, 383, 384, 385), "home"),
    **dict.fromkeys(SYSTEMS, "frames"),
    530: "frames",
    # SetPositions takes the words for places without the offset of the work system.
    920: "home",
}
_MODES = frozenset({170, 180, 190, 200, 210, 690, 900, 910, 930, 940})
_NAMES = frozenset(f"M{m}" for m in (0, 1, 2, 3, 4, 5, 6, *SILENT)) | code_names("G4", "G10", "G68")
"""Codes beside which letters may stand that a move has no use for."""

DUET = Dialect(
    name="duet",
    title="RepRapFirmware (Duet), CNC mode",
    sources=(
        "Duet3D/RepRapFirmware fc1cd16: src/GCodes/GCodeBuffer/StringParser.cpp",
        "Duet3D/RepRapFirmware fc1cd16: src/GCodes/GCodes.cpp, GCodes2.cpp",
    ),
    text=Text(
        parentheses="open comment",
        semicolon="comment",
        delete="none",
        o_word="error",
        percent="error",
        names=True,
        variables="none",
        blanks="between",
        exponents=True,
        adjoining=True,
        line_limit=200,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "feed mode": (930, 940),
            "units": (200, 210),
            "system": SYSTEMS,
            "rotation": (680, 690),
            "saved": (600,),
            "non-modal": tuple(sorted(set(_EFFECTS) - set(SYSTEMS))),
        }
    ),
    m_groups=grouped(
        {"stop": (0, 1, 2, 30, 99), "tool": (6,), "spindle": (3, 4, 5), "silent": SILENT}
    ),
    # No code changes these.
    defaults={"compensation": 400, "path": 640},
    effects=_EFFECTS,
    names={**dict.fromkeys(_META, "watch"), "ECHO": "none"},
    letters="FSTXYZABCUVWDEHIJKLPQR",
    # H and R make moves of another kind of G1, S is the power of a beam
    uses={
        "F": code_names("G1", "G2", "G3"),
        "E": code_names("G1", "G2", "G3", "G92"),
        **dict.fromkeys("IJK", code_names("G2", "G3")),
        "R": code_names("G2", "G3") | _NAMES,
        **dict.fromkeys("STDHLPQ", _NAMES),
    },
    feed_modes={930: 93, 940: 94},
    paths={640: 64},
    transforms={680: ("rotation", True), 690: ("rotation", False)},
    modal_motion=False,
    extrudes=True,
    one_command=True,
    feed_lost=True,
    in_turn=_MODES,
    dark_rapids=True,
    inches_turn=True,
    limits=limits.DUET,
    tool_frame=frozenset("T"),
    macro_change=True,
    unknown_lasts=True,
    harmless=frozenset({0, *_MODES}),
    before_m=frozenset(),
    after_m=frozenset(),
    # Positions are single-precision floats (GCodes.h), good for seven digits.
    writing=Writing((b"; ", b""), b"M400", digits=7),
    note="programs are read as in CNC mode (M453 in config.g), where G0 is a rapid whatever F "
    "says; as a printer the firmware runs G0 at F: choose marlin then",
)
