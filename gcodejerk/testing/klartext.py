"""Programs in Heidenhain Klartext, drawn: their lines are statements, not words of letters.

Rule: what is drawn is well-formed, and says so much that many of its rapids are certain.
"""

from __future__ import annotations

from hypothesis import strategies as st

_STATEMENTS = (
    *("TOOL CALL 1 Z S3000 F800", 'TOOL CALL "DRILL" Z S900', "CYCL CALL", "CYCL CALL M3", "STOP"),
    *("CYCL DEF 200 DRILLING ~\n   Q200=2 ;CLEARANCE ~\n   Q201=-15", "CYCL DEF 7.0 DATUM SHIFT"),
    *("CYCL DEF 7.1 X+5", "CC X+5 Y+5", "C X+9 Y+1 DR+ F200", "LP PR+5 PA+30 F90", "RND R2"),
    *("CR X+5 Y+5 R+20 DR- RL", "APPR LT X+1 Y+1 LEN5 RL F90", "DEP LT LEN5", "LBL 3", "LBL 0"),
    *("FN 0: Q1 = +5", "Q5 = Q1 + 2", "FN 9: IF +Q1 EQU +5 GOTO LBL 3", "; L X+99", "* - ROUGH"),
    *(
        "M8",
        "M9",
        "BLK FORM 0.1 Z X-5 Y-5 Z-5",
        "L X+Q1 R0 FMAX",
        "L Z+0 FMAX M91",
        "L X+7 FMAX M99",
    ),
    *(
        "L X+3 RL F100",
        "L F500",
        "L X1,5 FMAX",
        "/ 5 L X+4 FMAX",
        "L X+5 F AUTO",
        "TOOL DEF 5 L+0 R+3",
    ),
)
_UNKNOWN = (
    *(
        "CALL LBL 3",
        "CALL LBL 3 REP 2",
        "CALL PGM SUB",
        "PLANE RESET STAY",
        "CYCL DEF 10.0 ROTATION",
    ),
    *(
        "M128",
        "L M140 MB MAX",
        "FUNCTION TCPM",
        "L X+5 FMAX M126",
        "X+5 FMAX",
        "FN 17: SYSWRITE ID1",
    ),
    *("L X+1 X+2 FMAX", "L X+4 FMAX ~"),
)
"""Behind one of these nothing is rewritten."""


@st.composite
def klartext_programs(draw: st.DrawFn) -> bytes:
    """Draw a program.

    Returns
    -------
    bytes
        From BEGIN PGM to END PGM.
    """
    unit = draw(st.sampled_from(["MM", "MM", "INCH"]))
    said = [f"BEGIN PGM PART {unit}", "L X+0 Y+0 Z+50 R0 FMAX M3", "L Z+40 F900"]
    for _ in range(draw(st.integers(1, 12))):
        kind = draw(st.integers(0, 12))
        if kind <= 8:
            said.append(_line(draw))
        else:
            said.append(draw(st.sampled_from(_STATEMENTS if kind < 12 else _UNKNOWN)))
    said.append(f"END PGM PART {unit}")
    numbered = draw(st.integers(0, 4)) > 0
    lines = [
        line if line.startswith("/") or not (numbered or k == 0) else f"{k} {line}"
        for k, line in enumerate(said)
    ]
    newline = draw(st.sampled_from(["\n", "\r\n"]))
    return newline.join("\n".join(lines).split("\n")).encode() + newline.encode()


def _line(draw: st.DrawFn) -> str:
    """Draw a straight line."""
    axes = draw(st.lists(st.sampled_from("XYZ"), min_size=1, max_size=3, unique=True))
    words = ["L"]
    for axis in axes:
        step = "I" if draw(st.integers(0, 5)) == 0 else ""
        words.append(f"{step}{axis}{draw(st.integers(-80_000, 80_000)) / 1000:+.3f}")
    radius = draw(st.sampled_from(["", "R0", "R0"]))
    feed = draw(st.sampled_from(["FMAX", "FMAX", "F MAX", "", "F300"]))
    more = draw(st.sampled_from(["", "", "", "M8", "M9", "M13 ; cool"]))
    return " ".join(word for word in (*words, radius, feed, more) if word)
