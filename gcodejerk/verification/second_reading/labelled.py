"""Which line follows which, for the second reading: labels of Heidenhain, in both its languages.

``CALL LBL 1`` (``L1,0``) goes to a label and comes back at the next LBL 0 (``G98 L0``); ``CALL LBL
1 REP 2`` (``L1,2``) has what stands between run twice more; FN 9 to FN 12 (D09 to D12) jump.

Rule: a line with a word of flow that is not exactly one of these is not followed (`LostError`).
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.verification.second_reading.routes import LostError, Part, Routes, Way

_ONE = rb"([-+]?(?:Q[LR]?[0-9]+|[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+))"
_WHERE = rb"([0-9]{1,5}|\"[^\"]*\")"
_FRONT = rb"[ \t]*(?:N?[0-9]+[ \t]+)?"
_SPOKEN = tuple(
    (what, re.compile(_FRONT + pattern + rb"[ \t]*"))
    for what, pattern in (
        ("label", rb"LBL[ \t]+" + _WHERE),
        ("call", rb"CALL[ \t]+LBL[ \t]+" + _WHERE),
        ("again", rb"CALL[ \t]+LBL[ \t]+" + _WHERE + rb"[ \t]*REP[ \t]*([0-9]+)"),
        ("again", rb"CALL[ \t]+LBL[ \t]+" + _WHERE + rb"[ \t]*REP[ \t]*([0-9]+)/\2"),
        *(
            (
                "go",
                rb"FN[ \t]*%d[ \t]*:[ \t]*IF[ \t]+%s[ \t]+%s[ \t]+%s[ \t]+GOTO[ \t]+LBL[ \t]+%s"
                % (number, _ONE, word, _ONE, _WHERE),
            )
            for number, word in ((9, b"(EQU)"), (10, b"(NE)"), (11, b"(GT)"), (12, b"(LT)"))
        ),
    )
)
_CODED = tuple(
    (what, re.compile(_FRONT + pattern + rb"[ \t]*"))
    for what, pattern in (
        ("label", rb"G[ \t]*98[ \t]*L[ \t]*([0-9]{1,5})"),
        ("call", rb"L[ \t]*([0-9]{1,5}),0+"),
        ("again", rb"L[ \t]*([0-9]{1,5}),([0-9]{1,5})"),
        (
            "go",
            rb"D[ \t]*(0?9|1[0-2])[ \t]*P0?1[ \t]*%s[ \t]+P0?2[ \t]*%s[ \t]+P0?3[ \t]*([0-9]+)"
            % (_ONE, _ONE),
        ),
    )
)
_FLOW_SPOKEN = re.compile(rb"(?<![A-Z0-9_])LBL(?![A-Z0-9_])|FN[ \t]*(?:0*9|1[0-2])(?![0-9])")
_FLOW_CODED = re.compile(
    rb"(?<![A-Z0-9])(?:G[ \t]*98(?![0-9.])|D[ \t]*(?:0*9|1[0-2])(?![0-9.])|L[ \t]*[0-9]+)"
)
_COMPARED = {
    **{b"EQU": b"==", b"NE": b"<>", b"GT": b">", b"LT": b"<"},
    **{b"09": b"==", b"9": b"==", b"10": b"<>", b"11": b">", b"12": b"<"},
}


class LabelledRoutes(Routes):
    """The ways of a file with labels, which is one program."""

    by_code = False

    def __init__(self, lines: list[bytes], dialect: Dialect) -> None:
        self.lines, self.dialect, self.named = lines, dialect, False
        self.parts = [Part(0, len(lines), main=True)]
        self.ways = _ways(lines, klartext=dialect.text.klartext)


def _ways(lines: list[bytes], *, klartext: bool) -> dict[int, Way]:
    """Where its lines lead."""
    told: list[tuple[int, str, re.Match[bytes]]] = []
    labels: dict[bytes, int] = {}
    for at, line in enumerate(lines):
        said = line.replace(b"\0", b" ")
        for what, pattern in _SPOKEN if klartext else _CODED:
            match = pattern.fullmatch(said)
            if match is not None:
                told.append((at, what, match))
                break
        else:
            if (_FLOW_SPOKEN if klartext else _FLOW_CODED).search(said):
                raise LostError
            continue
        if what == "label" and (name := _key(match[1])) != b"0":
            if name in labels:
                raise LostError
            labels[name] = at
    return {at: _way(at, what, match.groups(), labels) for at, what, match in told}


def _way(at: int, what: str, said: tuple[bytes, ...], labels: dict[bytes, int]) -> Way:
    """Where a line leads."""
    if what == "label":
        return Way("back") if _key(said[0]) == b"0" else Way("go", None, at + 1)
    target = labels.get(_key(said[-1] if what == "go" else said[0]), -1)
    if what == "call" or (what == "again" and int(said[1]) == 0):
        return Way("sub", to=target)
    if what == "again":
        if not 0 <= target < at:
            raise LostError
        return Way("again", to=target, other=at, times=said[1])
    how, first = (said[0], said[1]) if said[0] in _COMPARED else (said[1], said[0])
    test = b"(%s)%s(%s)" % (first, _COMPARED[how], said[2])
    return Way("go", test, target, name="goto")


def _key(name: bytes) -> bytes:
    """A label by itself."""
    return name.lstrip(b"0") or b"0" if name.isdigit() else name
