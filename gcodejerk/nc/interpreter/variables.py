"""Variables of a program: which can be known, and what a block does to them.

Rule: a variable is known only while the program itself has set it, on every way that leads here.
Variables of the control are never known, nor is what a tool change or a builder's M code, which may
be a program, can have set.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from decimal import Decimal
from functools import lru_cache

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import LINEAR
from gcodejerk.nc.interpreter.expressions import REMEMBERED, evaluate, variable_name
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.text.block import Block, Name, Word
from gcodejerk.nc.text.cursor import LARGEST

_INCREMENT_DECIMALS = (3, 4)
"""Of the least increment: 0.001 mm or degrees, 0.0001 inch."""
_SMALLEST = 1e-60
"""Of computed positions: what is less, and not 0, nobody writes out."""
_POSITIONS = frozenset("XYZABCUVWIJKR")
_SHARED = re.compile(r"R[0-9]+")
"""R parameters of Siemens, which all programs of a control have in common."""
_OF_PROGRAMS = re.compile(r"Q(?:[0-9]{1,2}|L[0-9]+)")
"""Those of Heidenhain that no cycle and no function of the control sets (iTNC 530 ISO p. 276)."""
_SET = re.compile(rb"[ \t]*(?:\[([^\]]*)\])?[ \t]*=(?!=)(.*)", re.DOTALL)
_FILLS = re.compile(rb"[ \t]*(?:SET|REP)[ \t]*\(", re.IGNORECASE)
_READ = re.compile(rb"#([0-9]+|<[^<>]*>|[#\[])")
_PREDEFINED = """
VMAJOR VMINOR LINE MOTION_MODE PLANE CCOMP METRIC IMPERIAL ABSOLUTE INCREMENTAL INVERSE_TIME
UNITS_PER_MINUTE UNITS_PER_REV COORD_SYSTEM TOOL_OFFSET RETRACT_R_PLANE RETRACT_OLD_Z
SPINDLE_RPM_MODE SPINDLE_CSS_MODE IJK_ABSOLUTE_MODE LATHE_DIAMETER_MODE LATHE_RADIUS_MODE
SPINDLE_ON SPINDLE_CW MIST FLOOD SPEED_OVERRIDE FEED_OVERRIDE ADAPTIVE_FEED FEED_HOLD FEED RPM
X Y Z A B C U V W ABS_X ABS_Y ABS_Z ABS_A ABS_B ABS_C ABS_U ABS_V ABS_W CURRENT_TOOL
CURRENT_POCKET SELECTED_TOOL SELECTED_POCKET VALUE VALUE_RETURNED TASK CALL_LEVEL REMAP_LEVEL
"""
_READ_ONLY = frozenset(_PREDEFINED.split())
"""Global names that LinuxCNC sets by itself ("Predefined Named Parameters")."""


def is_local(name: str, rules: Arithmetic) -> bool:
    """Whether a variable belongs to one program or subprogram alone."""
    if name.isdigit():
        return 1 <= int(name) <= rules.local
    if rules.q_parameters:
        return name.startswith("QL")
    if rules.brackets == "()":
        return not _SHARED.fullmatch(name)  # DEF: of the program that declares it
    return name.startswith("<") and not name.startswith("<_")


def _can_be_known(name: str, rules: Arithmetic) -> bool:
    """Whether what the program sets is what it finds later."""
    if name.isdigit():
        return 1 <= int(name) < rules.system
    if rules.q_parameters:
        return _OF_PROGRAMS.fullmatch(name) is not None
    return not (name.startswith("<_") and name[2:-1] in _READ_ONLY)


def is_own(target: str, rules: Arithmetic) -> bool:
    """Whether what a block sets is surely a variable of the program, and does nothing else."""
    return bool(target) and not target.startswith("$") and _can_be_known(_name(target), rules)


def assigned_values(block: Block, state: State, rules: Arithmetic) -> list[float]:
    """Values of the assignments of a block, by the variables as they were before it."""
    if rules.together or len(block.assigns) == 1:
        return [evaluate(text, state.variables, rules) for text in block.assigned]
    values = []
    known: Mapping[str, float] = state.variables
    for target, text in zip(block.assigns, block.assigned, strict=True):
        values.append(evaluate(text, known, rules))
        # Is R2=R1 in the line of R1=5 computed before or after? Not certain: neither.
        name = _name(target)
        known = {n: value for n, value in known.items() if n != name} if target else {}
    return values


def before_block(
    block: Block, variables: Mapping[str, float], rules: Arithmetic
) -> Mapping[str, float]:
    """List the variables whose value within a block is certain."""
    if rules.together or not (block.assigns or block.names):
        return variables
    # Is X#1 in the line of #1=5 read before or after? Not certain: neither.
    if "" in block.assigns:
        return {}
    targets = {*map(_name, block.assigns)}
    targets |= {found[0] for name in block.names if (found := named_assignment(name)) is not None}
    if not targets:
        return variables
    return {name: value for name, value in variables.items() if name not in targets}


def named_assignment(name: Name) -> tuple[str, bytes] | None:
    """Take ``DEPTH=R1+2`` or ``PLACE[3]=5`` apart: the variable, and what it is set to.

    The variable is all of an array where the index is computed.
    """
    match = _SET.fullmatch(name.arguments) if name.name else None
    if match is None:
        return None
    if match[1] is None:
        return name.name, match[2]
    index = [part.strip(b" \t") for part in match[1].split(b",")]
    if not all(part.isdigit() for part in index):
        return name.name + "[", match[2]
    return f"{name.name}[{','.join(str(int(part)) for part in index)}]", match[2]


def converted(value: float, kind: str) -> float:
    """Give what a variable of a type holds when a number is assigned to it.

    Parameters
    ----------
    value : float
        The number; NaN where it is not known.
    kind : str
        REAL, INT or BOOL; any other holds no number.

    Returns
    -------
    float
        INT rounds (NC programming, "Possible type conversions"); a half of a negative number, one
        way or the other, is not certain.
    """
    if kind == "REAL":
        return value
    if kind == "BOOL":
        return float(value != 0.0) if value == value else NAN
    if kind != "INT" or not abs(value) < LARGEST:
        return NAN
    whole = math.floor(value + 0.5)
    half = abs(value - whole) > 0.5 - 1e-6
    return NAN if half and not (value > 0.0 and value + 0.5 == whole) else float(whole)


def fills(text: bytes) -> bool:
    """Whether what a variable is set to goes on into those behind it: ``SET(1,2)``, ``REP(0)``.

    Siemens, Job planning (828D, 07/2010) p. 46: from the element that is named to the end of the
    list, or of the array.
    """
    return _FILLS.match(text) is not None


def assign(block: Block, values: Iterable[float], state: State, rules: Arithmetic) -> None:
    """Set the variables of a block."""
    filled = rules.brackets == "()" and any(fills(text) for text in block.assigned)
    for target, value in zip(block.assigns, values, strict=True):
        if not target or filled:
            state.forget_variables()
            continue
        name = _name(target)
        twice = sum(_name(other) == name for other in block.assigns) > 1
        known = _can_be_known(name, rules) and not twice
        state.set_variable(name, value if known else NAN)


def _name(target: str) -> str:
    return variable_name(target.encode("latin-1"))


def reads_feed(block: Block, rules: Arithmetic) -> bool:
    """Whether a block reads F, or a variable that is computed and may be it."""
    if not rules.feed:
        return False
    texts = [word.text for word in block.words if word.value is None]
    texts += [*block.assigned, *block.o_arguments, *(name.arguments for name in block.names)]
    if any(name.name in rules.feed for name in block.names):
        return True
    if "$" in rules.feed:
        return any(b"$" in text for text in texts)
    return any(b"#" in text and _reads_feed(text, rules.feed) for text in texts)


@lru_cache(maxsize=REMEMBERED)
def _reads_feed(text: bytes, feed: frozenset[str]) -> bool:
    """Whether an expression reads one of these, or a variable that is computed and may be one."""
    names = _READ.findall(text.translate(None, b" \t").upper())
    return any(name in (b"#", b"[") or _name_of(name) in feed for name in names)


def _name_of(text: bytes) -> str:
    return text.decode("latin-1").lower()


def forget_shared(state: State, rules: Arithmetic) -> None:
    """Forget what other programs can have set."""
    state.forget_variables([name for name in state.variables if is_local(name, rules)])


def word_value(word: Word, variables: Mapping[str, float], rules: Arithmetic, inch: bool) -> float:
    """Compute the number of a word; NaN where it is not certain to the last digit that counts."""
    text = word.text[1:] if b"=" not in word.text else word.text.partition(b"=")[2]
    if b"(" in text and word.function:
        text = text.partition(b"(")[2].rstrip(b" \t").removesuffix(b")")
    elif word.function:
        text = text[1:]  # IX+Q5 of Klartext
    if not rules.exact and rules.brackets == "[]" and b"ROUND" in text.upper():
        return NAN  # in a word it rounds to the least increment
    value = evaluate(text, variables, rules)
    if not abs(value) <= LARGEST:
        return NAN
    if word.letter in _POSITIONS:
        if rules.exact:
            return value if value == 0.0 or abs(value) > _SMALLEST else NAN
        decimals = _INCREMENT_DECIMALS[inch and word.letter in LINEAR | set("IJKR")]
        return _if_short(value, decimals)
    if word.letter in "FS":
        return _if_short(value, 6)
    whole = round(value)
    if math.isclose(value, whole, rel_tol=0.0, abs_tol=1e-9):
        return float(whole)
    return NAN if abs(value - whole) < 1e-3 else value


def number_text(value: float) -> bytes:
    """A number with all its digits, and without an exponent.

    Examples
    --------
    >>> number_text(3.0), number_text(0.1), number_text(-0.0), number_text(1e-7)
    (b'3', b'0.1', b'0', b'0.0000001')
    """
    if value == int(value):
        return b"%d" % int(value)
    text = repr(value)
    return (format(Decimal(text), "f") if "e" in text else text).encode()


def _if_short(value: float, decimals: int) -> float:
    """Give a number with so few decimals; any other is not certain."""
    short = round(value, decimals)
    return short if abs(value - short) < 1e-9 else NAN
