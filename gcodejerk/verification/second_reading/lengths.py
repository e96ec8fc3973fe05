"""Which lines a control cuts, refuses or reads as other words, or writes frames with, told anew.

Rule: what stands here is said of the bytes of a line, before anything looks at its words.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect

_LOOSE = re.compile(rb"[A-Z] *\t|^\t[ \t\0]*[A-Z]|[GMT] *[-+]|[-+] ", re.IGNORECASE)
"""What Marlin takes for another word, or for none."""
_FRONT = re.compile(rb"^[ \t]*(?:N[0-9]+[ \t]*)?", re.IGNORECASE)
_ROUND = re.compile(rb"\([^)]*\)?")
_SPLIT = re.compile(rb"[GMT][ \t]+[0-9]", re.IGNORECASE)
_COMMENT = re.compile(rb"\([^)]*\)?|;.*", re.DOTALL)
_SAYING = re.compile(rb"^([ \t]*(?:N[0-9]+[ \t]*)?M11[78])(?:[^0-9.].*)?$")
_NUMBER = re.compile(rb"N([0-9]+)")
_HEXADECIMAL = re.compile(rb"[A-Z][-+ \t]*0X")
_EXPONENT = re.compile(rb"[0-9.]E")
_ASSIGNS = re.compile(rb"[ \t]*(?:N[ \t]*[0-9]+)?[ \t]*(#[0-9]+)[ \t]*=[^=#;()]*")
_OPERATOR = re.compile(rb"MOD|AND|XOR|OR")
_LETTER = re.compile(rb"[A-Z]")
_LONG = re.compile(rb"(?<![0-9.N])[0-9]{5,}\.?[0-9]*")


def is_cut(text: bytes, dialect: Dialect) -> bool:
    """Whether the control may not read a line to its end, or not see its command."""
    rules = dialect.text
    long = len(text) > rules.line_limit
    if long and not (rules.long_comments and not _COMMENT.sub(b"", text).strip()):
        return True
    if rules.adjoining and _is_no_command(text):
        return True
    ended = rules.inner_semicolon and b";" in text and b"(" in text and _may_end_within(text)
    return ended or (b"\r" in text and not rules.returns)


def _is_no_command(text: bytes) -> bool:
    """Whether a blank is left in front of the command, or stands within it."""
    said = _ROUND.sub(b"", _FRONT.sub(b"", text)).partition(b";")[0]
    return (said[:1].isspace() and bool(said.strip())) or _SPLIT.search(said) is not None


def _may_end_within(text: bytes) -> bool:
    """Whether a ``;`` stands within parentheses, and something behind them."""
    inner = [c.end() for c in _COMMENT.finditer(text) if c[0].startswith(b"(") and b";" in c[0]]
    return bool(inner) and bool(text[inner[0] :].strip(b" \t"))


def unsaid(text: bytes, dialect: Dialect) -> bytes:
    """A line without what M117 shows and M118 sends."""
    return _SAYING.sub(rb"\1", text) if dialect.text.messages else text


def is_loose(text: bytes, dialect: Dialect) -> bool:
    """Whether a tab, a blank or a sign makes another word of one; comments are taken out."""
    return dialect.text.tight and _LOOSE.search(text) is not None


def is_too_much(text: bytes, dialect: Dialect) -> bool:
    """Whether a line or a number is longer than the control reads; comments are taken out."""
    rules = dialect.text
    if not (rules.characters or rules.digits):
        return False
    text = text.translate(None, b" \t\0")
    if rules.characters and len(text) > rules.characters:
        return True
    if rules.number_digits and any(len(n) > rules.number_digits for n in _NUMBER.findall(text)):
        return True
    numbers = _LONG.findall(text) if rules.digits else []
    return any(len(n) - n.count(b".") > rules.digits for n in numbers)


def is_one_number(text: bytes, dialect: Dialect) -> bool:
    """Whether two words may be read as one number; capitals, comments are taken out."""
    rules = dialect.text
    if rules.hexadecimal and _HEXADECIMAL.search(text):
        return True
    return rules.exponents and _EXPONENT.search(text) is not None


def assigns_alone(text: bytes) -> bool:
    """Whether nothing but variables is set, as Fanuc asks for; capitals, functions taken out."""
    match = _ASSIGNS.match(text)
    return match is not None and not _LETTER.search(_OPERATOR.sub(b"", text[match.start(1) :]))


def written_frame(text: bytes) -> str:
    """Which frame of Siemens a line writes with more than a shift in it; empty without one."""
    target, _, value = b"".join(text.upper().split()).partition(b"=")
    if b"FR" not in target or target.endswith((b",TR]", b",FI]")):
        return ""
    if value and not re.sub(rb"C(?:TRANS|FINE)\([^()]*\):?", b"", value):
        return ""
    return "a programmed frame" if b"P_PFRAME" in target else "a written frame"
