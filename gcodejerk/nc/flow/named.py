"""Flow of Siemens: labels and ``GOTOF``, ``IF``, ``FOR``, ``REPEAT``, subprograms by their names.

Sources: SINUMERIK ONE NC programming 12/2019; PGA 04.00. Jumps go to a label or a block number,
forwards with GOTOF, backwards with GOTOB, with GOTO first forwards and then backwards.

Rule: what is not written as the manual has it, or has words beside it, is not followed
(`NotFollowedError`): then nothing of the file is.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

from gcodejerk.nc.flow.macro_b import NotFollowedError
from gcodejerk.nc.flow.script import LOST, Op, Script, Structures, Unit, checked
from gcodejerk.nc.text.block import Block, Line

_UNIT = re.compile(rb"[ \t]*%_N_([A-Z0-9_]+)_([A-Z]+)[ \t]*", re.IGNORECASE)
_JUMP = re.compile(rb"(.*?)(?<![A-Z0-9_])(GOTO[FBCS]?)(?![A-Z0-9_])(.*)", re.IGNORECASE | re.DOTALL)
_FOR = re.compile(
    rb"[ \t]*(R[0-9]+|[A-Z_][A-Z_][A-Z0-9_]*)[ \t]*=(.*?)(?<![A-Z0-9_])TO(?![A-Z0-9_])(.*)",
    re.IGNORECASE,
)
_REPEAT = re.compile(
    rb"[ \t]*([A-Z_][A-Z_][A-Z0-9_]*)(?:[ \t]+([A-Z_][A-Z_][A-Z0-9_]*))?"
    rb"(?:[ \t]+P[ \t]*=?[ \t]*([0-9]+|R[0-9]+))?[ \t]*",
    re.IGNORECASE,
)
_PROC = re.compile(
    rb"[ \t]*([A-Z_][A-Z_][A-Z0-9_]*|L[0-9]+)[ \t]*(?:\(([^()]*)\))?((?:[ \t]+[A-Z]+)*)[ \t]*",
    re.IGNORECASE,
)
_PARAMETER = re.compile(
    rb"[ \t]*(REAL|INT|BOOL)[ \t]+([A-Z_][A-Z_][A-Z0-9_]*)[ \t]*(?:=([^,]*))?", re.IGNORECASE
)
_CLOSES = {
    "ENDIF": "IF",
    "ENDWHILE": "WHILE",
    "ENDFOR": "FOR",
    "ENDLOOP": "LOOP",
    "UNTIL": "REPEAT",
}
_UNFOLLOWED = frozenset(
    ("CASE", "GOTOS", "CALL", "PCALL", "SETINT", "ISOCALL", "EXECSTRING", "ENDPROC")
)


def named_script(lines: list[Line]) -> Script:
    """Write a file down as a script.

    Parameters
    ----------
    lines : list of Line
        Of the file, the lines of ``%`` with their names among them.

    Raises
    ------
    NotFollowedError
    """
    script = Script(lines)
    begins = [k for k, line in enumerate(lines) if line.block.percent]
    edges = sorted({0, *begins, len(lines)})
    for first, last in pairwise(edges):
        unit = Unit(first, last, main=first == 0)
        if match := _UNIT.fullmatch(lines[first].text):
            unit.name, kind = match[1].decode().upper(), match[2].decode().upper()
            unit.main = kind == "MPF" or (first == 0 and kind == "SPF")
            unit.runs = kind in ("MPF", "SPF")
        elif first:
            raise NotFollowedError  # another kind of archive
        script.units.append(unit)
    defined = frozenset(unit.name for unit in script.units if unit.name)
    for unit in script.units:
        if unit.runs:
            _Compiler(script, unit, defined).compile()
    names = [unit.name for unit in script.units]
    for unit in script.units:
        unit.name = unit.name if names.count(unit.name) == 1 else ""
    return script


def _arguments(text: bytes) -> list[bytes] | None:
    """Split arguments at their commas, but not within brackets; None where they hold text."""
    parts, depth, begin = [], 0, 0
    for k, byte in enumerate(text):
        depth += (byte in b"([") - (byte in b")]")
        if byte == 0x22 or depth < 0:
            return None
        if byte == 0x2C and not depth:
            parts.append(text[begin:k])
            begin = k + 1
    return [*parts, text[begin:]] if text.strip() else []


class _Compiler:
    """Writes the lines of flow of one program down."""

    def __init__(self, script: Script, unit: Unit, names: frozenset[str]) -> None:
        self.script, self.unit, self.names = script, unit, names
        self.structures = Structures()
        self.ops: dict[int, Op] = {}
        self.labels: dict[str, int] = {}

    def compile(self) -> None:
        """Take all lines."""
        unit, script = self.unit, self.script
        for at in range(unit.first, unit.last):
            block = script.lines[at].block
            for name in block.names:
                if not name.name:
                    self._target(name.arguments.decode("latin-1").upper(), at)
            for word in block.words:
                if word.letter == "N" and word.value is not None:
                    self._target(f"N{int(word.value)}", at)
        for at in range(unit.first, unit.last):
            self.structures.note(at)
            op = self._op(at, script.lines[at])
            if op is not None:
                self.ops[at] = op
        if self.structures.open:
            raise NotFollowedError
        script.ops.update(checked(self.ops, self.structures))

    def _target(self, name: str, at: int) -> None:
        """Note a place that jumps may lead to."""
        self.labels[name] = LOST if name in self.labels else at

    # Complex: one case for each form of a line.
    def _op(self, at: int, line: Line) -> Op | None:
        """What a line does."""
        block = line.block
        names = [name for name in block.names if name.name]
        words = [word for word in block.words if word.letter != "N"]
        if not names:
            return self._by_number(at, block)
        name, text = names[0].name, names[0].arguments.strip(b" \t")
        alone = len(names) == 1 and not words and not block.assigns
        if name == "PROC":
            if at - self.unit.first > 5 or not self._proc(text):
                raise NotFollowedError
            return None
        if any(n.name in _UNFOLLOWED for n in names):
            raise NotFollowedError
        if name in ("GOTO", "GOTOF", "GOTOB", "GOTOC"):
            return self._goto(name, text, None, at, alone)
        if name == "IF" and (match := _JUMP.fullmatch(text)):
            return self._goto(match[2].decode().upper(), match[3].strip(), match[1], at, alone)
        if name in ("IF", "WHILE", "FOR", "LOOP", "ELSE", *_CLOSES) or name.startswith("REPEAT"):
            if not alone or block.block_delete or any(not n.name for n in block.names[1:]):
                raise NotFollowedError
            return self._structure(name, text, at)
        if name == "RET":
            plain = alone and not text and not block.block_delete  # RET("LABEL") goes on there
            return Op("return") if plain else Op("jump", None, LOST)
        only_count = all(word.letter == "P" for word in words)
        if len(names) == 1 and only_count and not block.assigns and not block.block_delete:
            return self._call(name, text, words[0].value if words else 1.0, at)
        return None

    def _goto(self, how: str, text: bytes, condition: bytes | None, at: int, alone: bool) -> Op:
        """A jump to a label or a number."""
        name = text.decode("latin-1").upper().strip()
        name = f"N{name}" if name.isdigit() else name
        if name.startswith("N") and name[1:].isdigit():
            name = f"N{int(name[1:])}"
        target = self.labels.get(name, LOST)
        if not alone:
            raise NotFollowedError
        if (how == "GOTOF" and target <= at) or (how == "GOTOB" and target > at):
            target = LOST
        return Op("jump", condition, target, at + 1, "goto")

    def _structure(self, name: str, text: bytes, at: int) -> Op | None:
        """Begin or end a loop or a branch; repeat a part of the program."""
        opened = self.structures.open
        if name == "REPEATB" or (name == "REPEAT" and text):
            return self._part(name, text, at)
        if name == "ELSE":
            if not opened or opened[-1][0] != "IF" or opened[-1][3] != LOST:
                raise NotFollowedError
            _, _, begin, _ = opened.pop()
            opened.append(("IF", "", begin, at))
            self.ops[begin] = replace(self.ops[begin], no=at + 1)
            return Op("jump", None, LOST)
        if name not in _CLOSES:
            opened.append((name, "", at, LOST))
            return self._open(name, text, at)
        if not opened or opened[-1][0] != _CLOSES[name]:
            raise NotFollowedError
        _, _, begin, other = opened.pop()
        if name == "ENDIF":
            branch = begin if other == LOST else other
            self.ops[branch] = (
                replace(self.ops[branch], no=at + 1) if other == LOST else Op("jump", None, at + 1)
            )
            return Op("jump", None, at + 1)
        if name == "UNTIL":
            return Op("jump", text, at + 1, begin + 1)
        if name == "ENDLOOP":
            return Op("jump", None, begin + 1)
        self.ops[begin] = replace(self.ops[begin], no=at + 1)
        if name == "ENDWHILE":
            return Op("jump", None, begin)
        entry = self.ops[begin]
        return Op("endfor", entry.condition, begin + 1, at + 1, entry.name, entry.first)

    def _open(self, name: str, text: bytes, at: int) -> Op | None:
        """What the first line of a structure does; where it ends is not known yet."""
        if name in ("LOOP", "REPEAT"):
            return Op("jump", None, at + 1)
        if name in ("IF", "WHILE"):
            return Op("jump", text, at + 1, LOST)
        match = _FOR.fullmatch(text)
        if match is None:
            raise NotFollowedError
        counter = match[1].decode().upper()
        counter = f"R{int(counter[1:])}" if counter[1:].isdigit() else counter
        return Op("for", match[3], at + 1, LOST, counter, match[2])

    def _part(self, name: str, text: bytes, at: int) -> Op:
        """``REPEAT LABEL P=3``, ``REPEAT FIRST LAST P=3``, ``REPEATB LABEL P=3``."""
        match = _REPEAT.fullmatch(text)
        if match is None or "ENDLABEL" in self.labels or (match[2] and name == "REPEATB"):
            raise NotFollowedError
        first = self.labels.get(match[1].decode().upper(), LOST)
        last = at
        if match[2]:
            last = self.labels.get(match[2].decode().upper(), LOST) + 1
            if last == LOST + 1 or last > at:
                raise NotFollowedError
        elif name == "REPEATB":
            last = first + 1
        known = LOST < first < last <= at
        if not known or not self.structures.reaches(at, first):
            return Op("jump", None, LOST)
        return Op("part", None, at + 1, first, count=match[3] or b"1", first=b"%d" % last)

    def _by_number(self, at: int, block: Block) -> Op | None:
        """``L123 P3`` calls a subprogram; None for any other block."""
        words = [word for word in block.words if word.letter != "N"]
        if not words or words[0].letter != "L" or block.assigns or block.block_delete:
            return None
        if len(words) > 1 and not (len(words) == 2 and words[1].letter == "P"):
            return None
        name = words[0].text.translate(None, b" \t").decode("latin-1").upper()
        return self._call(name, b"", words[1].value if len(words) == 2 else 1.0, at)

    def _call(self, name: str, text: bytes, count: float | None, at: int) -> Op | None:
        """A call of a subprogram of the file; None for any other name."""
        if name not in self.names or name == self.unit.name:
            return None
        if count is None or not count.is_integer() or count < 1.0:
            return None
        if text and not (text.startswith(b"(") and text.endswith(b")")):
            return None
        parts = _arguments(text[1:-1])
        if parts is None:
            return None
        given = tuple(("", part.strip(b" \t")) for part in parts)
        return Op("call", None, at + 1, name=name, arguments=given, count=b"%d" % int(count))

    def _proc(self, text: bytes) -> bool:
        """``PROC NAME(REAL DEPTH=5) SAVE``; whether it is understood."""
        match = _PROC.fullmatch(text)
        if match is None:
            return False
        self.unit.name = self.unit.name or match[1].decode().upper()
        self.unit.saves = b"SAVE" in (match[3] or b"").upper()
        parameters = []
        for part in (match[2] or b"").split(b",") if (match[2] or b"").strip() else ():
            found = _PARAMETER.fullmatch(part)
            if found is None:
                self.unit.followed = False  # VAR, AXIS, an array
                return True
            default = (found[3] or b"0").strip(b" \t")
            parameters.append((found[2].decode().upper(), found[1].decode().upper(), default))
        self.unit.parameters = tuple(parameters)
        return True
