"""Which dialect a program is written in, from its text (``dialect: auto``).

Rule 1: evidence is what only one dialect has, or what a program says of itself: the name of a
post-processor in a comment counts most. What several dialects share is no evidence.

Rule 2: when the evidence is not for one dialect alone, or there is none, nothing is chosen. A wrong
dialect moves the tool elsewhere: ``X100`` is 100 mm here and 0.1 mm there.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from gcodejerk.errors import Place, ProgramError
from gcodejerk.nc.dialects import AUTO, DIALECTS
from gcodejerk.nc.dialects.dialect import Dialect

HEAD = 64 * 1024
"""Bytes at the top of a program that are looked at."""
LOOKED_AT = 256
"""Bytes of a line: what is further behind tells nothing, and could take patterns very long."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Text that speaks for a dialect, and why."""

    dialect: str
    pattern: re.Pattern[bytes]
    why: str
    sure: bool = True
    """It settles the matter unless another dialect's evidence does too; else it only hints."""


def _code(dialect: str, pattern: bytes, why: str, sure: bool = True) -> Evidence:
    """Evidence in code, comments left out."""
    return Evidence(dialect, _in_line(pattern, re.IGNORECASE), why, sure)


def _in_line(pattern: bytes, flags: int = 0) -> re.Pattern[bytes]:
    r"""Compile a pattern whose ``\s`` stays within the line: over line ends it is quadratic."""
    return re.compile(pattern.replace(rb"\s", rb"[ \t]"), flags | re.MULTILINE)


_IN_COMMENTS = (
    ("linuxcnc", rb"\blinuxcnc|\bemc2\b|\baxis\.ngc"),
    ("fanuc", rb"\bfanuc"),
    ("haas", rb"\bhaas\b"),
    ("siemens", rb"\bsinumerik|\bsiemens\b|\b840d|\b828d"),
    ("grbl", rb"\bgrbl"),
    ("mach", rb"\bmach ?[34]"),
    ("uccnc", rb"\buccnc\b|\buccnc_post\b|\buc-cnc\b"),
    # a centroid is also one of an area, and MITSUBISHI a maker of tools
    ("centroid", rb"\bcentroid_post\b|\bcentroid (?:cnc|acorn|mill)|\bcnc1[12] centroid"),
    ("edingcnc", rb"\beding ?cnc\b|\busbcnc\b"),
    ("planetcnc", rb"\bplanet-?cnc\b"),
    ("masso", rb"\bmasso(?:_|[ -](?:cnc|g[23]|touch|controller)\b)"),
    ("mitsubishi", rb"\bmeldas\b|\bmitsubishi (?:cnc|control|m[678][0-9])"),
    ("mazatrol-eia", rb"\bmazatrol\b|\bmazak\b"),
    ("syntec", rb"\bsyntec\b"),
    ("okuma", rb"\bokuma\b|\bosp-?[eptu]?[0-9]"),
    ("fagor", rb"\bfagor\b"),
    ("marlin", rb"\bmarlin"),
    ("klipper", rb"\bklipper\b"),
)
COMMENTS = tuple(
    Evidence(name, re.compile(pattern, re.IGNORECASE), f"a comment names {name}")
    for name, pattern in _IN_COMMENTS
)
CODE = (
    _code("siemens", rb"^%_N_", "a program name %_N_"),
    _code("siemens", rb"(?<![A-Z_$])(MSG|MCALL|CYCLE\d+|HOLES[12]|POCKET\d)\b(?!\s*=)",
          "a Siemens cycle or MSG"),
    _code("siemens", rb"(?<![A-Z_])(DIAMON|DIAMOF|DIAM90|A?TRANS|AROT|GOTOF|GOTOB|SUPA|LIMS)\b",
          "a Siemens word"),
    _code("siemens", rb"^\s*DEF\s+(REAL|INT|BOOL|STRING)", "a Siemens declaration"),
    # Programming manual 12/2019 (6FC5398-2EP40-0BA0), p. 192
    _code("siemens", rb"(?<![A-Z_])[CA]R\s*=\s*[-+.\d]", "the radius CR= of an arc", sure=False),
    _code("siemens", rb"(?<![A-Z_])[A-Z]\d*\s*=\s*(AC|IC|DC|ACP|ACN)\b", "a place X=IC( )",
          sure=False),  # its brackets look like a comment, and are out of the code
    _code("siemens", rb"(?<![A-Z_])G(64[1-5]|50[5-9]|5[1-9]\d)\b", "a Siemens G code", sure=False),
    _code("heidenhain-iso", rb"^\s*%\S+\s+G7[01]\s*\*", "a program head %NAME G71 *"),
    _code("heidenhain-iso", rb"^\s*N?\d*\s*G[0-9].*\*\s*$", "blocks that end with *", sure=False),
    _code("linuxcnc", rb"^\s*(N\d+\s*)?o\s*(<[^>]+>|\d+|\[[^\]]*\])\s*"
          rb"(sub|endsub|call|if|else|endif|while|endwhile|do|repeat|endrepeat|return)\b",
          "O-words of LinuxCNC"),
    _code("linuxcnc", rb"#<[^>]+>", "a variable with a name"),
    _code("linuxcnc", rb"(?<![A-Z_])G(5\.2|5\.3|33\.1)(?!\d)", "a LinuxCNC G code"),
    _code("fanuc", rb"(?<![A-Z_])G(5\.1\s*Q|68\.2|43\.[45]|10\.6)(?!\.)", "a Fanuc G code"),
    *(_code(name, rb"(?<![A-Z_])G54\.1(?!\d)", "G54.1", sure=False) for name in ("fanuc", "mach")),
    *(_code(name, rb"(?<![A-Z_])(IF|WHILE)\s*\[.*\]\s*(GOTO|THEN|DO)", "flow of macro B",
            sure=False) for name in ("fanuc", "haas")),
    _code("haas", rb"(?<![A-Z_])G(187|154)\s*P", "a Haas G code"),
    # increments U and W, which system A alone has, in a block that no mill has
    _code("fanuc-lathe-a", rb"(?<![A-Z_])G28\s*U\s*[-+.\d]+\s*W", "G28 U W of lathes"),
    _code("okuma", rb"^[^*\n]*(?<![A-Z_])G1[56]\s*H\d[^*\n]*$", "G15 H, a work system of Okuma's"),
    _code("duet", rb"^\s*M453\b", "M453, CNC mode of RepRapFirmware"),
    _code("grbl", rb"^\s*\$([$#GINXHC]\s*$|N\d*=|J=|\d+=)", "a $ command of grbl"),
    *(_code(name, rb"^\s*M(82|83|104|109|140|190|106|107|205)\b", "printer codes", sure=False)
      for name in ("marlin", "klipper")),
    _code("klipper", rb"^\s*(SET_VELOCITY_LIMIT|SET_PRESSURE_ADVANCE|SET_INPUT_SHAPER|BED_MESH_\w+"
          rb"|SAVE_GCODE_STATE|RESTORE_GCODE_STATE|EXCLUDE_OBJECT\w*)\b", "a Klipper command"),
)  # fmt: skip
_LIKE_FANUC = frozenset({"fanuc", "haas", "mitsubishi", "mazatrol-eia", "syntec", "okuma", "fagor"})
_ON_A_PC = frozenset(
    {"linuxcnc", "grbl", "mach", "rs274", "uccnc", "edingcnc", "planetcnc", "masso"}
    | {"marlin", "klipper", "duet"}
)
"""Dialects in which X100 is 100 mm, and none of which has a tape with a program number."""
_INCREMENTS = _in_line(rb"(?<![A-Z_#\[])[UW]\s*[-+]?[.\d]")
LATHE = (
    (_in_line(rb"(?<![A-Z_])T\d{4}(?!\d)"), "a tool with its offset, T0101"),
    (_in_line(rb"(?<![A-Z_])G(50|92)\s*S\d"), "a limit of the spindle's speed, G50 S"),
    (_in_line(rb"(?<![A-Z_])G96(?!\d)"), "constant surface speed, G96"),
    (_INCREMENTS, "increments U and W"),
)
"""What programs of lathes hold, and hardly any program of a mill that reads Fanuc's language."""
_TURNING_CYCLE = _in_line(rb"(?<![A-Z_])G7[1-6](?!\d)")
"""In a program without any Y; with one, it is peck drilling, boring or a pocket of a mill."""
_SPEED_LIMITS = tuple(
    (dialect, _in_line(rb"(?<![A-Z_])G%d\s*S\s*\d" % code, re.IGNORECASE), f"G{code} S")
    for dialect, code in (("fanuc-lathe-a", 50), ("fanuc-lathe-b", 92))
)
_TOOL_OF_LATHE = _in_line(rb"(?<![A-Z_])T\d{4}(?!\d)", re.IGNORECASE)
_SURFACE = _in_line(rb"(?<![A-Z_])G9[67](?!\d)", re.IGNORECASE)
_Y = _in_line(rb"(?<![A-Z_])Y\s*[-+.\d]", re.IGNORECASE)
_TURNING = re.compile(rb"\b(LATHE|TURNING|TURN POST)\b")
_TURN = re.compile(rb"\bTURN\b")
"""The same without any Y; spindles and coolant are turned on in comments of mills, too."""
_POINT = _in_line(rb"(?<![A-Z_])[XYZ]\s*[-+]?\d*\.", re.IGNORECASE)
_O_PROGRAM = _in_line(rb"^\s*[O:]\d+")
_TAPE = re.compile(rb"\s*%[^\n]*\n(?:\s*\n)*\s*[O:]\d+", re.IGNORECASE)
"""How a program begins that is read as a tape."""
_NUMBERED_TAPE = re.compile(_TAPE.pattern + rb"[ \t]*(?:\r?\n|\(|$)", re.IGNORECASE)
_BLOCK = _in_line(rb"(?<![A-Z_])G0*[0-3](?!\d|\.)", re.IGNORECASE)
_PC_CONTROL = (
    (_in_line(rb"(?<![A-Za-z_])[XYZxyz]\s*[-+]?\d*\.\d{5}"), "a length with five decimals"),
    (
        _in_line(rb"(?<![A-Z_])G(9[01]\.1|64\s*P|61\.1|43\.1)", re.IGNORECASE),
        "G91.1, G64 P or G61.1",
    ),
    (_in_line(rb"^\s*(N\d+\s*)?G2[01]\s*\r?$", re.IGNORECASE), "G20 or G21 in a block of its own"),
    (_in_line(rb"^\s*(n\d+\s*)?[gxyz]\d*(?:\.\d*)?\s*[xyz\s]"), "words in small letters"),
)
"""What tells a control that runs on a PC, or on a small board, from those of machining centres."""
_SMALL_LETTERS = re.compile(rb"\([^)\n]*[a-z]{3}|;[ \t]*[^\n]*[a-z]{3}")
_FOREIGN = _in_line(rb"[A-Z_]{2,}\d*\s*[=(]|[A-Z]=|[A-Z]{4,}|(?<![A-Z_])G65(?!\d)")
"""Words with a name, which none of LinuxCNC, grbl and Mach has."""
_KLARTEXT = _in_line(rb"^\s*(?:\d+\s+)?BEGIN\s+PGM\b", re.IGNORECASE)
_COMMENT = re.compile(rb"\([^)\n]*(?:\)|$)|;[^\n]*", re.MULTILINE)


def refuse_klartext(head: bytes, dialect: Dialect, name: str) -> None:
    """Refuse Heidenhain's own language where another is stated, or another where it is.

    Parameters
    ----------
    head : bytes
        The beginning of a program.
    dialect : Dialect
        The one that is stated.
    name : str
        For messages.
    """
    match = _KLARTEXT.search(head[:HEAD])
    if match and not dialect.text.klartext:
        raise ProgramError(
            f"this is Heidenhain Klartext, and no program of the dialect {dialect.name}",
            "choose the dialect klartext",
            Place(name, 1 + head.count(b"\n", 0, match.start())),
        )
    if dialect.text.klartext and not match:
        raise ProgramError(
            "no line BEGIN PGM: this is no program in Heidenhain Klartext",
            "choose its dialect, or auto; of DIN/ISO: heidenhain-iso",
            Place(name),
        )


def detect_dialect(
    head: bytes, name: str, lathe: bool = False, control: str = ""
) -> tuple[Dialect, str]:
    r"""Find the dialect of a program.

    Parameters
    ----------
    head : bytes
        The beginning of the program.
    name : str
        For messages.
    lathe : bool
        The machine file is one of a lathe.
    control : str
        Dialect of the control that will run it; empty: nobody says.

    Returns
    -------
    dialect : Dialect
        The only one that the text speaks for.
    why : str
        What was found.

    Raises
    ------
    ProgramError
        Nothing speaks for one dialect, or several do.

    Examples
    --------
    >>> detect_dialect(b"o100 sub\nG0 X1\no100 endsub\n", "part.ngc")[0].name
    'linuxcnc'
    """
    head = b"".join(map(_beginning, head[:HEAD].splitlines(keepends=True)))
    if match := _KLARTEXT.search(head):
        line = 1 + head.count(b"\n", 0, match.start())
        return DIALECTS["klartext"], f"BEGIN PGM of Heidenhain Klartext (line {line})"
    comments = b"\n".join(_COMMENT.findall(head))
    code = _COMMENT.sub(b" ", head)
    found: dict[str, str] = {}
    hints: dict[str, str] = {}
    named = b"\n".join(c for c in comments.split(b"\n") if b"compatib" not in c.lower())
    for evidence in (*COMMENTS, *CODE):
        match = evidence.pattern.search(named if evidence in COMMENTS else code)
        if match:
            line = head.count(b"\n", 0, max(head.find(match[0]), 0)) + 1
            into = found if evidence.sure else hints
            into.setdefault(evidence.dialect, f"{evidence.why} (line {line})")
    _find_system(found, code)
    _prefer(found, code)
    chosen = found or hints
    _doubt_names(chosen, code)
    _refuse_mills(chosen, code, comments, lathe, name)
    if not found and set(chosen) == {"fanuc", "haas"}:
        why = f"{chosen['fanuc']}, which Fanuc and Haas have; which of the two, nothing tells"
        return DIALECTS["iso-mill"], f"{why}, so as what both read alike"
    if len(chosen) == 1:
        ((dialect, why),) = chosen.items()
        return _that_control_reads(control, DIALECTS[dialect], why, name)
    if not chosen and (common := _read_alike(code, comments, lathe)) is not None:
        return _that_control_reads(control, *common, name)
    if not chosen:
        raise ProgramError(
            f"the dialect cannot be told from the program (dialect: {AUTO})",
            f"state it: --dialect, or the machine file's dialect; one of {', '.join(DIALECTS)}",
            Place(name),
        )
    seen = "; ".join(f"{dialect}: {why}" for dialect, why in sorted(chosen.items()))
    raise ProgramError(
        f"the program could be of several dialects ({seen})",
        "state it: --dialect, or the machine file's dialect",
        Place(name),
    )


def _doubt_names(chosen: dict[str, str], code: bytes) -> None:
    """Set what a program is made of beside a name in a comment, which may name the part.

    (LID FOR MACH3 BOX) in a program with % and O1234, or with the T0101 of a lathe.
    """
    if len(chosen) != 1:
        return
    ((dialect, why),) = chosen.items()
    if dialect not in _ON_A_PC or not why.startswith("a comment names"):
        return
    if _NUMBERED_TAPE.match(code):
        chosen["iso-mill"] = "a % and a program number"
    elif _TOOL_OF_LATHE.search(code):
        chosen["fanuc-lathe-a"] = "a tool with its offset, T0101"


def _that_control_reads(control: str, dialect: Dialect, why: str, name: str) -> tuple[Dialect, str]:
    """Refuse to read a program as one for a PC that a machining centre's control will run.

    X100 is 100 mm for the one, and may be 0.1 mm for the other.
    """
    if control and control not in _ON_A_PC and dialect.name in _ON_A_PC:
        raise ProgramError(
            f"the program could be of {dialect.name} ({why}), but the machine's control reads "
            f"{control}",
            f"state which it is: --dialect {control}, or --dialect {dialect.name}",
            Place(name),
        )
    return dialect, why


def _beginning(line: bytes) -> bytes:
    """The part of a line that is looked at, and the line's end."""
    return line if len(line) <= LOOKED_AT else line[:LOOKED_AT] + line[len(line.rstrip(b"\r\n")) :]


def _read_alike(code: bytes, comments: bytes, lathe: bool) -> tuple[Dialect, str] | None:
    """What all dialects read alike that a program without evidence could be of.

    A program that ISO mills run begins with a %, and with its number; LinuxCNC, grbl and Mach have
    neither a number there, nor cycles of lathes.
    """
    upper = code.upper()
    if lathe or _turns(upper, comments):
        return None
    if _TAPE.match(code):
        why = (
            "a % and a program number, as Fanuc and Haas have them; which of the two, nothing tells"
        )
        return DIALECTS["iso-mill"], f"{why}, so as what both read alike"
    if _O_PROGRAM.search(code) or not _BLOCK.search(code) or _FOREIGN.search(upper):
        return None
    sign = next((what for pattern, what in _PC_CONTROL if pattern.search(code)), "")
    if not sign and _SMALL_LETTERS.search(comments):
        sign = "comments in small letters"
    if not sign and not (_Y.search(code) and _POINT.search(code)):
        return None
    if not sign:
        why = "X and Y with decimal points, and nothing that tells controls of mills apart"
        return DIALECTS["any-mill"], f"{why}, so as what they read alike"
    why = f"{sign}, as controls on a PC have it: LinuxCNC, grbl or Mach, and which, nothing tells"
    return DIALECTS["rs274"], f"{why}, so as what they read alike"


def _refuse_mills(
    chosen: dict[str, str], code: bytes, comments: bytes, lathe: bool, name: str
) -> None:
    """Refuse to take a program for one of a mill that reads like one of a lathe.

    In system A, G90 X40. Z-20. is a turning pass and X35. the next one; on a mill both are moves.
    """
    mills = [dialect for dialect in chosen if DIALECTS[dialect].lathe == "no"]
    if not mills:
        return
    why = "the machine's X is a diameter" if lathe else ""
    if not why and not _LIKE_FANUC.isdisjoint(mills):
        why = _turns(code.upper(), comments)
    if why:
        raise ProgramError(
            f"the program could be of {mills[0]} ({chosen[mills[0]]}), but reads like one of a "
            f"lathe ({why}), and which system of G codes the lathe has cannot be told",
            "state it: --dialect fanuc-lathe-a or fanuc-lathe-b (or fanuc, haas for a mill), or "
            "the machine file's dialect",
            Place(name),
        )


def _turns(code: bytes, comments: bytes) -> str:
    """What says that a program, in capitals, is one of a lathe; empty where nothing does."""
    why = next((what for pattern, what in LATHE if pattern.search(code)), "")
    comments = comments.upper()
    drawn = _Y.search(code) is not None
    if not why and not drawn and _TURNING_CYCLE.search(code):
        why = "a turning cycle"
    if not why and (_TURNING.search(comments) or (not drawn and _TURN.search(comments))):
        why = "a comment speaks of turning"
    return why


def _find_system(found: dict[str, str], code: bytes) -> None:
    """Tell the G-code system of a lathe by how it limits the spindle's speed.

    G50 S is that of system A, G92 S that of B; mills may have them, but no tool T0101 besides, nor
    a surface speed without any Y.
    """
    turns = _TOOL_OF_LATHE.search(code) or (_SURFACE.search(code) and not _Y.search(code))
    for dialect, pattern, what in _SPEED_LIMITS:
        if turns and (match := pattern.search(code)):
            line = code.count(b"\n", 0, match.start()) + 1
            found.setdefault(dialect, f"{what} of a lathe (line {line})")


def _prefer(found: dict[str, str], code: bytes) -> None:
    """Take out what the evidence of a more special dialect explains as well."""
    if "fanuc" in found and "haas" not in found and _INCREMENTS.search(code.upper()):
        why = f"{found.pop('fanuc')}, and U and W are increments in system A alone"
        found["fanuc-lathe-a"] = why
    if "haas" in found:
        found.pop("fanuc", None)  # it speaks Fanuc's language with words of its own
    if "linuxcnc" in found and "mach" in found and _O_PROGRAM.search(code):
        found.pop("mach")
