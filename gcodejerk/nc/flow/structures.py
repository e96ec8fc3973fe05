"""O-words of LinuxCNC as a tree: ``if``, ``while``, ``do``, ``repeat``, ``sub`` and their lines.

Rule: a structure is collected whole before it runs. What is not nested as LinuxCNC demands, is too
long, or holds something that a tree cannot, is not followed (`Flow` then forgets what it can
change).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gcodejerk.nc.text.block import Block, Line

MOST_LINES = 20_000
MOST_BYTES = 1_000_000
"""Of one structure."""
DEEPEST = 12
"""Structures within structures."""
_ARGUMENTS = {"if": 1, "elseif": 1, "while": 1, "repeat": 1}
_OPENS = frozenset({"sub", "if", "while", "repeat", "do"})
_JUMPS = frozenset({"call", "return", "break", "continue"})


@dataclass(slots=True)
class Node:
    """A structure, or with `kind` ``line`` or that of a jump, a line."""

    kind: str
    name: str
    line: Line
    branches: list[tuple[bytes | None, list[Node]]] = field(default_factory=list)
    """Condition and body; the condition of a ``do`` comes with its end, ``else`` has none."""
    last: int = 0
    """Line of its end."""

    @property
    def body(self) -> list[Node]:
        """What runs in it."""
        return self.branches[0][1]

    @property
    def condition(self) -> bytes | None:
        """Of a loop, or its count."""
        return self.branches[0][0]


def plain_name(name: str) -> str | None:
    """Name of an O-word as it is compared; None for a computed one."""
    if name.startswith("<") and name.endswith(">"):
        return name
    return str(int(name)) if name.isascii() and name.isdigit() else None


class Collector:
    """Takes lines until a structure is complete."""

    def __init__(self, comments: bool = False) -> None:
        """Begin; `comments`: lines with nothing else belong to a body, too."""
        self.comments = comments
        self.lines: list[Line] = []
        self._stack: list[Node] = []
        self._size = 0

    def __bool__(self) -> bool:
        return bool(self._stack)

    @staticmethod
    def opens(block: Block) -> bool:
        """Whether a structure begins here."""
        return block.o_word in _OPENS and block.problem is None

    def add(self, line: Line) -> Node | None:
        """Take a line; the structure that it completes.

        Raises
        ------
        ValueError
            The structure cannot be followed; its lines are in `lines`.
        """
        self.lines.append(line)
        self._size += len(line.text) + 50
        block = line.block
        if len(self.lines) > MOST_LINES or self._size > MOST_BYTES or block.percent:
            raise ValueError
        if block.o_word is None:
            says = block.words or block.assigns or block.names or block.problem
            if says or (self.comments and block.comments):
                self._append(Node("line", "", line))
            return None
        name = plain_name(block.o_name)
        words = any(word.letter != "N" for word in block.words)
        beside = words or block.assigns or block.names or block.block_delete
        arguments = block.o_arguments
        if name is None or beside or block.problem is not None:
            raise ValueError
        if len(arguments) < _ARGUMENTS.get(block.o_word, 0):
            raise ValueError
        return self._o_word(block.o_word, name, line)

    def _o_word(self, word: str, name: str, line: Line) -> Node | None:
        """Take an O-word."""
        top = self._stack[-1] if self._stack else None
        condition = line.block.o_arguments[0] if line.block.o_arguments else None
        if word in _JUMPS:
            self._append(Node(word, name, line))
            return None
        if top is not None and top.name == name:
            if word in ("else", "elseif"):
                self._branch(top, condition if word == "elseif" else None)
                return None
            if word == "while" and top.kind == "do":
                top.branches[0] = (condition, top.body)
                return self._close(line)
            if word == "end" + top.kind:
                if word == "endsub" and condition is not None:
                    self._append(Node(word, name, line))  # what it returns is computed
                return self._close(line)
        self._open(Node(word, name, line, [(condition, [])]))
        return None

    @staticmethod
    def _branch(top: Node, condition: bytes | None) -> None:
        """Begin another branch of an ``if``; none follows its ``else``."""
        if top.kind != "if" or top.branches[-1][0] is None:
            raise ValueError
        top.branches.append((condition, []))

    def _open(self, node: Node) -> None:
        """Begin a structure."""
        nested = bool(self._stack)
        if node.kind not in _OPENS or (node.kind == "sub" and nested):
            raise ValueError
        if len(self._stack) >= DEEPEST:
            raise ValueError
        if nested:
            self._append(node)
        self._stack.append(node)

    def _append(self, node: Node) -> None:
        self._stack[-1].branches[-1][1].append(node)

    def _close(self, line: Line) -> Node | None:
        node = self._stack.pop()
        node.last = line.number
        return None if self._stack else node

    def take(self) -> list[Line]:
        """Give the lines up; the next structure may begin."""
        lines, self.lines, self._stack, self._size = self.lines, [], [], 0
        return lines
