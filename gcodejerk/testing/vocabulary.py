"""Words of the dialects other than LinuxCNC's, for drawn programs.

Rule: what is drawn is well-formed for its dialect, and says so much that most of its rapids are
certain: modes are stated, numbers have a decimal point where it matters.
"""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import strategies as st

Draw = st.DrawFn


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """What programs of one dialect are made of."""

    head: tuple[str, ...]
    """Lines in front of everything."""
    modes: tuple[str, ...]
    """Lines that change modes, or move in another way than along a line."""
    comments: tuple[str, ...]
    end: str
    axes: str = "XYZ"
    increments: str = ""
    """Addresses of increments."""
    incremental: bool = True
    """It has G90 and G91."""
    point: bool = False
    """Every length has a decimal point."""
    stated: bool = False
    """Every line states its motion, and holds nothing besides."""
    beside: tuple[str, ...] = ("M8", "M3 S500.", "")
    """Words that may stand in the block of a rapid."""
    drills: bool = False


_ROUND = ("(a comment)", "( X99 G91 )", "")
_AFTER = ("; a comment", "; X99 G91", "")
_FANUC_MODES = (
    *(
        "G90",
        "G91",
        "G54",
        "G61",
        "G64",
        "G94",
        "G17",
        "G4 P100",
        "M9",
        "M5",
        "G20",
        "G21",
        "F120.",
    ),
    *("G28 Z5.", "G91 G28 Z0.", "G53 Z0.", "G92 X0.", "T1 M6", "G43 H1", "G49", "G40"),
    *("/G1 X3. F90.", "G2 X5. Y5. R20. F80.", "G3 X5. Y-5. I1. J2.", "#1=5", "G1 X#1", "G52 X1."),
    *("G68 X0. Y0. R30.", "G69", "G41 D1", "G51 X0. Y0.", "G50", "M98 P100", "G65 P9000"),
    *("#5221=1.", "#500=#4109", "#[1]=5.", "G10 L2 P1 X1.", "G10 L50", "M0", "M1", "M10", "H2"),
    *("G54 P3", "G92 X5.", "G91 G92 X5.", "M198 P5", "M96 P5", "#3006=1", "G90 G54 G49 G0 X1."),
    *("G63", "#3004=2", "#3004=0"),
)
_LATHE_MODES = (
    *("G98", "G99", "G54", "G61", "G64", "G18", "G4 X1.", "M9", "M5", "F.2", "G28 U0. W0."),
    *("G40", "T0101", "G2 X5. Z5. R20. F.1", "G1 U2. W-1.", "G42", "G96 S200", "G97 S900"),
    *("G50 S2000", "G53 X0.", "#100=2", "/G1 X3.", "G71 U2. R.5", "G50 U2.", "#5221=1.", "M0"),
    *("G10 P1 X5.", "M1", "G54 T0202", "G10.9 X1.", "G123"),
    *("G71 P10 Q20 U.4 W.1 F.2", "N10 G0 X5.", "N20 G1 X9.", "G73 P10 Q20 U.4", "G70 P10 Q20 F.1"),
)
_PRINTER_MODES = (
    *("G90", "G91", "M82", "M106 S20", "G92 X0", "G28 X", "G28", "G1 E5 F300", "G4 P10", "T0"),
    *(
        "M400",
        "G1 F900",
        "G20",
        "G21",
        "M204 P500",
        "M204 T3000",
        "M3 S9",
        "M5",
        "M0",
        "G92",
        "G0Y0X10",
        *("G90 F60", "G91 F900", "G0 X5 F0", "G1 F0", "T0 G91", "X5 G91", "F60 G1 X2"),
        *("G92 A5", "G2 X5 I3 F60", "M106 M400"),
    ),
)

_PC_HEAD = ("G21 G90 G17 G94 G64", "G0 X0 Y0 Z5 F200")
_PC_MODES = (
    *("G90", "G91", "G54", "G55", "G94", "G17", "G18", "G4 P1", "M9", "G20", "G21", "F90", "G64"),
    *("G28", "G53 G0 Z0", "G92 X0", "G92.1", "G43 H1", "G49", "G69", "G50", "M3 S90", "M5", "M1"),
    *("G2 X5 Y5 R20 F60", "/G1 X5 F90", "G52 X1", "G10 L2 P1 X0", "T1 M6", "G41 D1", "G40", "H2"),
    *("G0 X5 G4 P1", "G54 P2", "G4 X2"),
)
_PC_UNKNOWN = ("G68.2", "M98 P5", "#1=5", "G1 X#1", "M62 P1", "gosub part", "endif", "(expr, a=1)")
"""Behind one of these nothing is rewritten where a table is known in part."""
_LIKE_FANUC_MODES = tuple(
    line
    for line in _FANUC_MODES
    if line not in ("M10", "M198 P5", "M96 P5", "G10 L50", "#3006=1", "G68 X0. Y0. R30.")
)


def _of_a_pc(*more: str) -> Vocabulary:
    """Words of a control on a PC that is known in part."""
    return Vocabulary(
        _PC_HEAD, (*_PC_MODES, *_PC_MODES, *_PC_UNKNOWN, *more), (*_ROUND, "; X99"), "M30",
        drills=True,
    )  # fmt: skip


def _like_fanuc(*more: str) -> Vocabulary:
    """Words of a relative of Fanuc that is known in part."""
    return Vocabulary(
        ("O1234 (part)", "G21 G17 G40 G49 G80 G90 G94 G64", "G0 X0. Y0. Z5. F200."),
        (*_LIKE_FANUC_MODES, "G12.1", "M10", "G61.1", *more),
        _ROUND,
        "M30",
        point=True,
        drills=True,
    )


VOCABULARIES: dict[str, Vocabulary] = {
    "fanuc": Vocabulary(
        ("O1234 (part)", "G21 G17 G40 G49 G80 G90 G94 G64", "G0 X0. Y0. Z5. F200."),
        _FANUC_MODES,
        (*_ROUND, "(open"),
        "M30",
        point=True,
        drills=True,
    ),
    "fanuc-lathe-a": Vocabulary(
        ("O77", "G21 G18 G40 G98 G64", "G0 X40. Z5. F200."),
        _LATHE_MODES,
        _ROUND,
        "M30",
        axes="XZ",
        increments="UW",
        incremental=False,
        point=True,
    ),
    "fanuc-lathe-b": Vocabulary(
        ("O78", "G21 G18 G40 G94 G90 G64", "G0 X40. Z5. F200."),
        (
            *("G90", "G91", "G94", "G95", "G28 X0.", "T0202", "G92 X1.", "G40", "G77 X2. Z-3."),
            *("F90.", "G72 P10 Q20 W.1 F.2", "N10 G0 X5.", "N20 G1 X9.", "G4 P10", "G61"),
        ),
        _ROUND,
        "M30",
        axes="XZ",
        point=True,
    ),
    "haas": Vocabulary(
        ("O5 (haas)", "G21 G17 G40 G80 G90 G94 G64", "G0 X0. Y0. Z5. F200."),
        (
            *_FANUC_MODES,
            "G12 I5. D1",
            "G187 P1",
            "G110",
            "M97 P20",
            "G103 P1",
            "G103",
            "M31",
            "M88",
        ),
        _ROUND,
        "M30",
        point=True,
        drills=True,
    ),
    "siemens": Vocabulary(
        ("G71 G17 G40 G90 G94 G64", "G0 X0 Y0 Z5 F200"),
        (
            *("G90", "G91", "G54", "G60", "G64", "G94", "G95", "G17", "G4 F1", "M9", "G70", "G71"),
            *("TRANS X5", "R1=5", "G1 X=R1", "G1 X=IC(2)", "G2 X5 Y5 CR=20", 'MSG("X5")', "T1 D1"),
            *("CYCLE81(5,0,2,-3)", "G41", "G40", "ROT Z30", "G74 X1=0", "STOPRE", "L20", "F90"),
            *("$P_UIFR[1]=CTRANS(X,5)", "FGROUP(X,Y)", "FGROUP()", "G700", "G710", "M0", "G54 D1"),
            *(
                'T="DRILL 8" M6',
                "G0 X=3 Y = +5",
                "DEF REAL DEPTH, _WIDE=2.5",
                "DEPTH=4",
                "FNORM",
                "COMPCAD",
                "COMPOF",
                "SOFT DYNFINISH",
                "DYNNORM BRISK",
                "CYCLE832(0.05,1,1)",
            ),
            *("G0 SUPA Z9 D0", "SUPA X4", "CYCLE800()", 'CYCLE800(1,"TC",0)', "WAITM(1,1,2)"),
        ),
        _AFTER,
        "M30",
        beside=("M8", "M3 S500", ""),
    ),
    "grbl": Vocabulary(
        ("G21 G90 G17 G94", "G0 X0 Y0 Z5 F200"),
        (
            *("G90", "G91", "G54", "G55", "G93", "G94", "G17", "G4 P1", "M9", "G20", "G21", "F90"),
            *("G28", "G28 Z5", "G53 G0 Z0", "G92 X0", "G92.1", "G43.1 Z5", "G49", "G80", "G61"),
            *("G2 X5 Y5 R20 F60", "/G1 X5", "G10 L20 P1 X0", "G38.2 Z-5 F20", "M0", "M3 S90"),
            *("M4 S90", "M5", "G1 X3 S20", "G64", "G64 P0.1 G91", "T1 M6", "G43 H1", "M62 P1"),
            *("G41 D1", "G40", "G51 X2", "G50", "G7", "G8", "G98 G0 X7", "M6 G20", "G187", "%"),
            *(
                "G49 X5",
                "X3 A5",
                "T300 X3",
                "G4 X3",
                "G93 G1",
                "T1.5 Y2",
                "G80 G1 X2",
                "G80\nG92 X1",
                "G43.1",
                "G10 G91",
                "I5",
            ),
        ),
        (*_ROUND, "; X99", "(open"),
        "M2",
        beside=("M8", "M3 S500", "F77", ""),
    ),
    "rs274": Vocabulary(
        ("G21 G90 G17 G94", "G0 X0 Y0 Z5 F200"),
        (
            *("G90", "G91", "G54", "G55", "G93", "G94", "G17", "G18", "G4 P1", "M9", "G20", "G21"),
            *("G28 Z5", "G53 G0 Z0", "G92 X0", "G92.1", "G43 H1", "G49", "G80", "G61", "G64"),
            *("G64 P0.1 G91", "G2 X5 Y5 R20 F60", "/G1 X5 F90", "G10 L2 P1 X0", "T1 M6", "M3 S90"),
            *("M5", "M0", "G41 D1", "G40", "G51 X2", "G50", "G7", "G8", "G98 G0 X7", "G187", "F90"),
        ),
        (*_ROUND, "; X99"),
        "M30",
    ),
    "iso-mill": Vocabulary(
        ("O1234 (part)", "G21 G17 G40 G49 G80 G90 G94 G64", "G0 X0. Y0. Z5. F200."),
        (*_FANUC_MODES, "M31", "G103 P1", "G103", "M97 P20", "G12 I5. D1"),
        _ROUND,
        "M30",
        point=True,
        drills=True,
    ),
    "any-mill": Vocabulary(
        ("G21 G90 G17 G40 G94", "G0 X0. Y0. Z5. F200."),
        (
            *("G90", "G91", "G54", "G55", "G93", "G94", "G17", "G18", "G4 P1", "M9", "G20", "G21"),
            *("G28 Z5.", "G53 G0 Z0.", "G92 X0.", "G92.1", "G43 H1", "G49", "G80", "G61", "G64"),
            *("G91 G28 Z0.", "G18 G43 H1", "G49 G17", "G80 X9.", "X7.", "G0 X5 Y5", "G1 Z-2. F90."),
            *("G2 X5. Y5. R20. F60.", "G98 G81 X5. Y5. Z-3. R2.", "X9.", "/G1 X5. F90.", "T1 M6"),
            *("M3 S90", "M5", "M0", "G41 D1", "G40", "G68 X0. Y0. R10.", "G69", "G51 X2.", "G50"),
            *("M98 P20", "M97", "G103 P1", "G10 L2 P1 X0.", "G52 X3.", "G30 Z2.", "D1", "F90."),
        ),
        (*_ROUND, "; X99"),
        "M30",
        point=True,
    ),
    "mach": Vocabulary(
        ("G21 G90 G17 G94 G64", "G0 X0 Y0 Z5 F200"),
        (
            *("G90", "G91", "G54", "G55", "G93", "G94", "G61", "G64", "G4 P1", "M9", "G20", "G21"),
            *(
                "G28",
                "G53 G0 Z0",
                "G92 X0",
                "G92.1",
                "G43 H1",
                "G49",
                "G68 X0 Y0 R10",
                "G69",
                "F90",
            ),
            *("G51 X2", "G50", "G2 X5 Y5 R20 F60", "/G1 X5 F90", "#1=5", "G1 X#1", "M98 P5"),
            *("#5221=1", "G54 P2", "M3", "M5", "M1", "G10 L1 P1 Z5", "H2"),
        ),
        (*_ROUND, "; X99", "// X99"),
        "M30",
        drills=True,
    ),
    "centroid": Vocabulary(
        _PC_HEAD,
        (
            *_PC_MODES,
            *("G44 H2", "G43.4 H1", "G61", "G9 X5", "G29", "G30 Z1", "G22", "G10 P81 R15", "M25"),
            *("M94/3", "M1004", "G117 P5", "gosub part", "G68 X0 Y0 R30", "G51 X0 I2"),
        ),
        (*_ROUND, "; X99"),
        "M99",
        drills=True,
    ),
    "uccnc": _of_a_pc("M10 Q5"),
    "edingcnc": _of_a_pc("M54 P1", "if [#1>0]"),
    "planetcnc": _of_a_pc("(print, G0 X5)"),
    "masso": _of_a_pc("M10"),
    "mitsubishi": _like_fanuc("G5 P2"),
    "mazatrol-eia": _like_fanuc("M91"),
    "syntec": _like_fanuc("G70", "G71"),
    "duet": Vocabulary(
        ("M453", "G90 G94 G17", "G21", "G0 X0 Y0 Z5", "G1 F200"),
        (
            *("G90", "G91", "G92 X0", "G28 X", "G28", "G4 P10", "T0", "M400", "G1 F900", "G20"),
            *("G21", "M3 S900", "M5", "M0", "G92", "G54", "G59.1", "G53 G0 Z1", "G17 G21 G90"),
            *("G0 X5 G91", "X7 Y3", "G0 X4 F600", "G1 H2 X3", "G1 R1 X3", "G2 X5 Y5 R20 F60"),
            *("G10 L2 P1 X0", "G68 A0 B0 R20", "G69", "M98 P1", "G38.2 Z-5", "; M3", "G93", "G94"),
            *("if var.a > 1", "  G0 X9", 'M291 P"jog"', "M121", "G91 G1 X2 F90"),
        ),
        (*_ROUND, "; X99 G91"),
        "M0",
        stated=True,
        beside=("",),
    ),
    "marlin": Vocabulary(
        ("G21", "G90", "G0 F3000 X0 Y0 Z5"),
        _PRINTER_MODES,
        _AFTER,
        "M2",
        stated=True,
        beside=("F2000", "F900", ""),
    ),
    "klipper": Vocabulary(
        ("G21", "G90", "G0 F3000 X0 Y0 Z5"),
        (*_PRINTER_MODES, "SET_PIN PIN=a VALUE=1", "START_PRINT BED=60"),
        _AFTER,
        "M2",
        stated=True,
        beside=("F2000", "F900", ""),
    ),
}
"""By dialect."""


def draw_lines(draw: Draw, words: Vocabulary) -> list[str]:
    """Draw the lines of a program, without line numbers and ends."""
    lines = list(words.head)
    for _ in range(draw(st.integers(1, 8))):
        kind = draw(st.integers(0, 9))
        if kind <= 6:
            lines.append(_move(draw, words, draw(st.sampled_from(["G0", "G0", "G1"]))))
            for _ in range(draw(st.integers(0, 4))):
                code = draw(st.sampled_from(["G0", "G00", "G1"])) if words.stated else ""
                code = code or draw(st.sampled_from(["", "", "G0", "G1"]))
                lines.append(_move(draw, words, code))
        elif kind == 7 and words.drills:
            lines += _drill(draw, words)
        else:
            lines.append(draw(st.sampled_from(words.modes)))
    return [*lines, words.end]


def _length(draw: Draw, words: Vocabulary) -> str:
    """Draw a length."""
    places = draw(st.integers(0, 3))
    value = draw(st.integers(-80_000, 80_000)) / 1000
    text = f"{value:.{places}f}"
    if words.point and "." not in text:
        text += "."
    return text


def _move(draw: Draw, words: Vocabulary, code: str) -> str:
    """Draw a move."""
    names = draw(st.lists(st.sampled_from(words.axes), min_size=1, max_size=3, unique=True))
    if words.increments:
        pairs = dict(zip(words.axes, words.increments, strict=True))
        names = [pairs[name] if draw(st.booleans()) else name for name in names]
    parts = [name + _length(draw, words) for name in names]
    if words.incremental and not words.stated and draw(st.integers(0, 5)) == 0:
        parts.insert(0, draw(st.sampled_from(["G90", "G91"])))
    beside = draw(st.sampled_from(words.beside)) if draw(st.integers(0, 3)) == 0 else ""
    comment = draw(st.sampled_from(words.comments)) if draw(st.integers(0, 3)) == 0 else ""
    return " ".join(part for part in (code, *parts, beside, comment) if part)


def _drill(draw: Draw, words: Vocabulary) -> list[str]:
    """Draw a drilling cycle."""
    point = "." if words.point else ""
    code = draw(st.sampled_from(["G81", "G82", "G83", "G85"]))
    back = draw(st.sampled_from(["G98", "G99", "G98 G91"]))
    extra = {"G82": " P100", "G83": f" Q2{point}"}.get(code, "")
    hole = f"{back} {code} X{_length(draw, words)} Z-5{point} R2{point}{extra} F90{point}"
    holes = [f"X{_length(draw, words)}" for _ in range(draw(st.integers(0, 3)))]
    ends = ["G80", "G0 Z20" + point, "G80 G0 X1" + point]
    return [hole, *holes, draw(st.sampled_from(ends)), "G90 G0 Z30" + point]
