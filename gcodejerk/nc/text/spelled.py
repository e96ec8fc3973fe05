"""Spellings that only some controls know: their keywords, and what they read as something else.

Rule: a line that a control may read otherwise is a problem; what it makes of it, nobody is sure of.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache

from gcodejerk.nc.dialects.spelling import Text
from gcodejerk.nc.text.cursor import SyntaxProblem

_TIGHT = re.compile(
    rb" *\t(?![ \t]*(?:;|$))"
    rb"|[^;]*?(?:[A-Z] *\t|[GMT] *[-+]|[A-Z] *[-+] )",
    re.IGNORECASE,
)
_APART = re.compile(
    rb"[ \t]*(?:N[0-9]+[ \t]*)?(?:\([^)]*\))+[ \t](?:[ \t]|\([^)]*\))*[^ \t(;]"
    rb"|(?:[^;(]|\([^)]*\))*?[GMT][ \t]+[0-9]",
    re.IGNORECASE,
)
_COMMENTS = re.compile(rb"\([^)]*\)?|;.*")
_FEW = 4
"""Digits in front of the point up to which those that are lost are none that matter."""
_UNPADDED = re.compile(rb"[A-Z](?:0|[1-9][0-9]*)(?:\.[1-9])?", re.IGNORECASE)


def check_line(rules: Text, text: bytes) -> None:
    """Refuse a line that the control may cut, or whose words it may read as others.

    Parameters
    ----------
    rules : Text
        The dialect's.
    text : bytes
        The line, without its end.
    """
    if b"\r" in text and not rules.returns:
        raise SyntaxProblem("a carriage return may end the line", text.index(b"\r"))
    if rules.characters and len(text) > rules.characters:
        said = _COMMENTS.sub(b"", text).translate(None, b" \t")
        if len(said) > rules.characters:
            raise SyntaxProblem(f"more than {rules.characters} characters", rules.characters)
    if rules.tight and (found := _TIGHT.match(_COMMENTS.sub(_blanks, text))):
        raise SyntaxProblem("a blank, tab or sign that makes another word of it", found.end() - 1)
    if rules.adjoining and (found := _APART.match(text)):
        raise SyntaxProblem("a blank in front of it leaves no command", found.end() - 1)


def is_too_long(rules: Text, text: bytes) -> bool:
    """Whether the control may not read a line to its end, or refuse it."""
    if len(text) <= rules.line_limit or text.strip(b" \t") == b"%":
        return False
    return not rules.long_comments or bool(_COMMENTS.sub(b"", text).strip())


def _blanks(comment: re.Match[bytes]) -> bytes:
    return b" " * len(comment[0])


def check_word(rules: Text, text: bytes, begin: int) -> None:
    """Refuse a small letter, zeros in front or many digits, where that makes another word of it.

    Parameters
    ----------
    rules : Text
        The dialect's.
    text : bytes
        The word.
    begin : int
        Where it stands in its line.
    """
    if rules.number_digits and text[:1] in b"Nn":
        if len(text[1:].translate(None, b" \t")) > rules.number_digits:
            raise SyntaxProblem("a number of a line with more digits than the control takes", begin)
    elif rules.digits:
        front, _, behind = text[1:].translate(None, b" \t+-").partition(b".")
        if len(front) > _FEW and len(front) + len(behind) > rules.digits:
            raise SyntaxProblem("a number has more digits than the control reads", begin + 1)
    if rules.capitals and text[:1].islower():
        raise SyntaxProblem("a small letter may be read as nothing", begin)
    if not rules.padded and text[:1] in b"GMgm" and not _UNPADDED.fullmatch(text):
        raise SyntaxProblem(f"'{text.decode('latin-1')}' is no code in this form", begin)


def check_comments(rules: Text, text: bytes, comments: Iterable[tuple[int, int]]) -> None:
    """Refuse parentheses in a line of words, where what they hold may be read as words.

    Parameters
    ----------
    rules : Text
        The dialect's.
    text : bytes
        The line.
    comments : iterable of tuple of int
        Where its comments stand.
    """
    for begin, end in comments:
        if text[begin : begin + 1] != b"(":
            continue
        if rules.parentheses == "lone comment":
            raise SyntaxProblem("a comment beside words may be read as words", begin)
        if rules.inner_semicolon and b";" in text[begin:end] and text[end:].strip(b" \t"):
            raise SyntaxProblem("a ';' within parentheses may end the line", begin)


@lru_cache(maxsize=16)
def keyword_pattern(words: tuple[str, ...]) -> re.Pattern[bytes] | None:
    """Any of these words, not followed by another letter."""
    if not words:
        return None
    every = b"|".join(word.encode() for word in sorted(words, key=len, reverse=True))
    return re.compile(rb"(" + every + rb")(?![A-Za-z_])", re.IGNORECASE)
