"""Siemens 840D sl, 828D and SINUMERIK ONE, mills and lathes.

Sources: SINUMERIK ONE NC programming 12/2019, pp. 43, 52, 170, 181; 802D sl / 840D ISO Milling
p. 3-42 (G53, G153 and SUPA suppress frames for one block). Comments begin with ``;`` alone, since
parentheses hold arguments. What a name does that is not listed here is not known; a user's own
subprogram is such a name.

What an increment (G91, IC) travels behind a change of the frame, setting data say: SD42440, "G91
extension" of the programming manual. Where frames have a fine part (MD24000), ATRANS adds to it and
TRANS leaves it (NC programming p. 315), elsewhere TRANS ends it: behind both, nobody knows. A
spindle may be a C axis, which SPOS, M3, M19 and M70 turn as well. What the ISO dialect of G291
leaves behind is not known. CYCLE832 selects one of G64 to G645, and whatever machine data say where
its tolerance is 0 (general knowledge, not looked up). T may run a cycle of the builder's, which may
set R parameters. G153 suppresses the basic frames, G53 leaves them in force (840Di sl, Fundamentals
11/2006, p. 100): where either ends in the program's coordinates, only the control knows.

COMPON, COMPCURV and COMPCAD make polynomials of runs of blocks ``N.. G1 X.. Y.. Z.. F..``, which is
what a stream is (828D, Job planning 6FC5398-2BP40-0BA0, p. 249); "ideally called in CYCLE832"
(SINUMERIK, 5-axis machining, p. 67). No stream is put between COMPOF and the compressor: CTOL, OTOL
and ATOL would outlive that (p. 490), but which compressor CYCLE832 has selected depends on options
(SINUMERIK ONE NC programming, p. 1108), and G0 is smoothed beside one, too (p. 184).

G40 ends with a straight move in the plane, of which an axis that is not named goes to where it was
programmed last (808D, 6FC5398-4DP10-0BA6, p. 122). What a move along Z, or one to where the program
stands already, does of that, no page was found to say: behind both, the offset may be left.

The length of a tool lies across the plane in force (Function Manual Tool Compensation, LENTOAX, p.
2-151; NC programming p. 750), unless the setting data SD42940 says otherwise: behind another plane
the same place has other coordinates.
"""

from __future__ import annotations

from gcodejerk.nc.dialects import limits
from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import (
    ANOTHER_LANGUAGE,
    LEFT_OVER,
    Dialect,
    Drilling,
    Effect,
    NamedCycle,
    grouped,
)
from gcodejerk.nc.dialects.spelling import Text, Writing

SYSTEMS = (540, 550, 560, 570, *range(5050, 6000, 10))

_SILENT = (
    *("MSG", "LIMS", "SETMS", "STOPRE", "SOFT", "BRISK", "DRIVE", "FFWON", "FFWOF"),
    *("CFC", "CFIN", "CFTCP", "NORM", "KONT", "KONTC"),
    *("UPATH", "SPATH", "ORIWKS", "ORIMKS", "RTLION", "ADIS", "ADISPOS"),
    *("CUT2D", "CUT2DF", "WALIMON", "WALIMOF", "DYNNORM", "DYNPOS", "DYNROUGH", "DYNSEMIFIN"),
    *("FRC", "FRCM", "SF", "SCC"),
    *("DYNFINISH", "EXTERN", "DISPLOF", "SETAL", "WORKPIECE", "SAVE"),
    *("FNORM", "FIFOCTRL", "WAITM", "WAITMC", "SETM", "CLEARM"),  # F as it is; waiting for channels
)
_COMPRESSORS = ("COMPON", "COMPCAD", "COMPCURV", "COMPSURF", "COMPPATH")
_FRAMES = ("RPL", "ROT", "ROTS", "SCALE", "MIRROR")
_FURTHER = ("AROT", "AROTS", "ASCALE", "AMIRROR")
_WATCHES = ("ID", "IDS", "WHEN", "WHENEVER", "EVERY", "FROM", "DO")
"""Synchronized actions: ``ID=1 WHEN $AA_IW[X]>50 DO POS[Y]=10``."""
_TURNED = (
    *(
        "CRPL",
        "TRANSMIT",
        "TRACYL",
        "TRAANG",
        "TRAORI",
        "TRACON",
        *("TOFRAME", "TOFRAMEX", "TOFRAMEY", "TOFRAMEZ"),
        *("TOROT", "TOROTX", "TOROTY", "TOROTZ"),
        "PAROT",
        "RTLIOF",
    ),
    *("AP", "RP", "POLF", "GEOAX"),
)
_CYCLES = (
    *(f"CYCLE{n}" for n in (*range(60, 100), 801, 802, 899, *range(930, 960))),
    *("HOLES1", "HOLES2", "POCKET1", "POCKET2", "POCKET3", "POCKET4", "SLOT1", "SLOT2"),
    "LONGHOLE",
)
_FLOW = (
    *("IF", "ELSE", "ENDIF", "WHILE", "ENDWHILE", "FOR", "ENDFOR", "LOOP", "ENDLOOP", "REPEAT"),
    *("REPEATB", "UNTIL", "GOTO", "GOTOF", "GOTOB", "GOTOC", "GOTOS", "CASE", "CALL", "PCALL"),
    *("EXTCALL", "ISOCALL", "PROC", "RET", "ENDPROC", "SETINT", "INIT", "START", "WAITE"),
)
# Order of the parameters: snippets of the extension MaTka.cnc-sinumerik. Motions of CYCLE81, to RTP
# at the end with G0: helmancnc.com; "the G functions effective prior to the cycle call remain
# active beyond the cycle": 808D manual (at cncmasterpiece.blogspot.com). That 82, 83, 85 and 89 end
# in RTP, too, and that only 83 (FRF) and 85 (FFR, RFF) have an F of their own, is general knowledge
# that was not looked up, and so is that MCALL runs a cycle behind every block that moves. Later
# parameters choose planes, axes and meanings: they have to be 0 or left out.
_PLANES = ("RTP", "RFP", "SDIS", "DP", "DPR")
_NAMED = {
    "CYCLE81": NamedCycle(_PLANES, keeps_feed=True),
    "CYCLE82": NamedCycle((*_PLANES, "DTB"), keeps_feed=True),
    "CYCLE83": NamedCycle((*_PLANES, "FDEP", "FDPR", "DAM", "DTB", "DTS", "FRF", "VARI")),
    "CYCLE85": NamedCycle((*_PLANES, "DTB", "FFR", "RFF")),
    "CYCLE89": NamedCycle((*_PLANES, "DTB"), keeps_feed=True),
}
_FUNCTIONS = "ABS ACOS ASIN ATAN2 COS LN EXP POT ROUND SIN SQRT TAN TRUNC"
NAMES: dict[str, Effect] = {
    **dict.fromkeys(_SILENT, "none"),
    # "TRANS X Y Z: programmable offset, deletes old instructions for offsetting, rotation, scaling,
    # mirroring; ATRANS: additive; without values: clears" (808D, 6FC5398-4DP10-0BA1, p. 56).
    "TRANS": "shift",
    "ATRANS": "further shift",
    **dict.fromkeys(_FRAMES, "turned frame"),
    **dict.fromkeys(_FURTHER, "further turn"),
    **dict.fromkeys(("SPOS", "SPOSA"), "turn"),
    "CYCLE832": "smoothing",
    **dict.fromkeys(_COMPRESSORS, "compressor"),
    "COMPOF": "no compressor",
    # Between the block and the next that moves in the plane, G0 too; none behind four blocks that
    # do not: cncforum.net, "Rounding and Chamfer".
    **dict.fromkeys(("RND", "CHF", "CHR"), "corner"),
    "RNDM": "corners",
    **dict.fromkeys(_WATCHES, "watch"),
    "TRAFOOF": "frames",
    **dict.fromkeys(_TURNED, "transform"),
    **dict.fromkeys(_CYCLES, "cycle"),
    **dict.fromkeys(_FLOW, "flow"),
    "FGROUP": "feed group",
    "DEF": "declaration",
    "SUPA": "machine",  # for its block alone, as G153 and G53
    "CYCLE800": "swivel",
    "$": "written",  # $P_UIFR[1]=.., $TC_DP3[1,1]=.., $MC_..: offsets, tools, machine data
    "MCALL": "modal cycle",
    "DIAMON": "diameter",
    "DIAMOF": "radius",
    **dict.fromkeys(("DIAM90", "DIAMONA", "DIAMOFA", "DIAM90A", "DIACYCOFA"), "either"),
    **dict.fromkeys(("DIAMCHAN", "DIAMCHANA", "DIAMCYCOF", "DIARAD", "DIARADA"), "either"),
    "OVR": "feed override",
    **dict.fromkeys(limits.SIEMENS, "limit"),
}

SIEMENS = Dialect(
    name="siemens",
    title="Siemens 840D sl, 828D, SINUMERIK ONE",
    sources=(
        "SINUMERIK ONE NC programming 12/2019 pp. 43, 52, 170, 181",
        "SINUMERIK 802D sl / 840D ISO Milling p. 3-42",
    ),
    text=Text(
        parentheses="code",
        semicolon="comment",
        delete="numbered",
        o_word="error",
        percent="named",
        names=True,
        equals=True,
        variables="R",
        blanks="between",
        strings=True,
        line_limit=512,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30, 330, 340, 350, 630, 3310, 3320),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "units": (700, 710, 7000, 7100),
            # G96 and G97 bring a feed per revolution with them, and G94 would end them.
            "feed mode": (930, 940, 950, 960, 961, 962, 970, 971, 972, 973),
            "compensation": (400, 410, 420),
            "system": (5000, *SYSTEMS),
            "path": (600, 640, 6410, 6420, 6430, 6440, 6450),
            "exact stop": (6010, 6020, 6030),
            "corner": (4500, 4510),
            "non-modal": (40, 90, 250, 260, 530, 580, 590, 740, 750, 1530),
            "pole": (1100, 1110, 1120),
            "language": (2900, 2910),
            "approach": (1470, 1480, 2470, 2480, 3470, 3480, 1400, 1410, 1420, 1430),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 17, 30),
            "tool": (6,),
            "spindle": (3, 4, 5, 19, 70),
            "coolant": (7, 8, 9),
            "gear": (40, 41, 42, 43, 44, 45),
        }
    ),
    # Which code of a group holds after power-on is machine data (20150): not here.
    defaults={"compensation": 400},
    effects={
        40: "words",
        **dict.fromkeys(SYSTEMS, "system"),
        5000: "frames",
        **dict.fromkeys((530, 1530), "machine"),
        **dict.fromkeys((580, 590), "frames"),
        **dict.fromkeys((740, 750), "home"),
        **dict.fromkeys((250, 260), "words"),
        **dict.fromkeys((1100, 1110, 1120), "words"),
        **dict.fromkeys((1470, 1480, 2470, 2480, 3470, 3480), "home"),
    },
    names=NAMES,
    letters="FSTXYZABCUVWDHIJKR",  # CR= is the radius of an arc; R5 alone is no word
    calls="L",
    units={700: True, 710: False, 7000: True, 7100: False},
    feed_modes={930: 93, 940: 94, 950: 95},
    paths={600: 61, 640: 64, 6410: 64, 6420: 64, 6430: 64, 6440: 64, 6450: 64},
    diameter_codes=True,
    lathe="either",
    # G70 and G71 leave F in the unit of the control, G700 and G710 do not (NC programming p. 170).
    lengths_only=frozenset({700, 710}),
    path_has_to_be_stated=True,
    bars={400: (LEFT_OVER, True), 2910: (ANOTHER_LANGUAGE, True), 2900: (ANOTHER_LANGUAGE, False)},
    limits=limits.SIEMENS,
    limit_modes=limits.SIEMENS_MODES,
    tool_frame=frozenset("TD"),
    length_turns=True,
    shifts_travel=True,
    spindle_turns="ABC",
    base_frames=True,
    other_m="positions",
    redrawn=frozenset({330, 340, 350, 630, 3310, 3320}),
    drilling=Drilling(named=_NAMED),
    arithmetic=Arithmetic(
        # NC programming 12/2019 p. 444: comparisons bind least of all.
        levels=(
            ("*", "/", "DIV", "MOD"),
            ("+", "-"),
            ("AND",),
            ("XOR",),
            ("OR",),
            ("==", "<>", ">=", "<=", ">", "<"),
        ),
        functions=frozenset(_FUNCTIONS.split()),
        brackets="()",
        compared="relative",
        chained=False,
        feed=frozenset({"$"}),  # $P_F, $AC_F and more
    ),
    harmless=frozenset(
        {0, 90, 170, 180, 190, 400, 700, 710, 7000, 7100, 900, 910, 930, 940, 950, 600, 640}
        | {6410, 6420, 6430, 6440, 6450, 6010, 6020, 6030}
    ),
    # M0, M1, M2, M17 and M30 act behind the motion of their block; for all others machine data says
    # (22200; from general knowledge, not looked up).
    before_m=frozenset(),
    after_m=frozenset({0, 1, 2, 30}),
    exact_stop=90,
    writing=Writing((b"; ", b""), b"G4 F0.001"),
)
