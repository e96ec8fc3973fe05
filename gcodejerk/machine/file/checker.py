"""Nodes held against the table of keys: plain values come out, problems are collected.

Rule: what is wrong is left out of the result. So whatever comes out is of the kind that the table
says, converted to mm, and later steps check only what one key alone cannot show.
"""

from __future__ import annotations

import re
from typing import Any

import yaml

from gcodejerk.errors import Place
from gcodejerk.machine.file import kinds, table
from gcodejerk.machine.file.document import Document
from gcodejerk.machine.file.scalars import is_empty, number_remedy, number_value, shown
from gcodejerk.machine.problems import Problems, nearest
from gcodejerk.units import mm_from_inch

KeyPath = tuple[str | int, ...]

_MISSING = object()


class Checker:
    """Reads a document by the table.

    Parameters
    ----------
    document : Document
        The machine file.
    problems : Problems
        Takes what is wrong.
    """

    def __init__(self, document: Document, problems: Problems) -> None:
        self.document = document
        self.problems = problems
        self.inch = False
        self.axes: frozenset[str] = frozenset()
        self.rotary: frozenset[str] = frozenset()
        self._nodes: dict[KeyPath, yaml.Node] = {}
        self._keys: dict[KeyPath, yaml.Node] = {}

    def read(self) -> dict[str, Any]:
        """Give the values of the file by key; those that are wrong are absent.

        A list comes as a dict from its indices, so that each entry keeps its path.
        """
        self._look_ahead()
        values = self._read(self.document.root, table.MACHINE, ())
        return values if isinstance(values, dict) else {}

    def place(self, path: KeyPath) -> Place:
        """Where the value of a key stands."""
        return self.document.place(self._nodes[path])

    def given(self, path: KeyPath) -> bool:
        """Whether the file says something of a key."""
        return path in self._nodes

    def key_place(self, path: KeyPath) -> Place:
        """Where a key itself stands."""
        return self.document.place(self._keys[path])

    def unit(self, unit: str, path: KeyPath) -> str:
        """Name the unit in which the file gives a number."""
        if not unit.startswith("mm"):
            return unit
        length = "deg" if self.rotary.intersection(map(str, path)) else "mm"
        return unit.replace("mm", "inch" if self.inch and length == "mm" else length)

    def _look_ahead(self) -> None:
        """Find out what the unit of a number depends on, and which axes the file is about."""
        top = self._peek(self.document.root)
        units = top.get("units")
        self.inch = isinstance(units, yaml.ScalarNode) and units.value == "inch"
        axes = self._peek(top.get("axes"))
        self.axes = frozenset(axes)
        rotary = set("ABC") - self.axes
        for name, axis in axes.items():
            kind = self._peek(axis).get("type")
            given = kind.value if isinstance(kind, yaml.ScalarNode) else None
            if given == "rotary" or (given is None and name in set("ABC")):
                rotary.add(name)
        self.rotary = frozenset(rotary)

    def _peek(self, node: yaml.Node | None) -> dict[str, yaml.Node]:
        if not isinstance(node, yaml.MappingNode):
            return {}
        return {key: value for key, _, value in self.document.entries(node, "", Problems())}

    def _read(self, node: yaml.Node, kind: kinds.Kind, path: KeyPath) -> Any:
        """Give the value of one node, or `_MISSING` after telling what is wrong with it."""
        self._nodes[path] = node
        match kind:
            case kinds.Section():
                return self._section(node, kind, path)
            case kinds.Table():
                return self._table(node, kind, path)
            case kinds.OrMapping():
                return self._read(node, self._chosen(node, kind), path)
            case kinds.ListOf():
                return self._list(node, kind, path)
            case kinds.Pair():
                return self._pair(node, kind, path)
            case kinds.Number():
                return self._number(node, kind, path)
            case kinds.Flag():
                return self._flag(node, path)
            case kinds.Choice() | kinds.Text():
                return self._words(node, kind, path)

    def _chosen(self, node: yaml.Node, kind: kinds.OrMapping) -> kinds.Kind:
        """Which of the two a node is: a mapping none of whose keys fits is a list without dash."""
        fits = any(nearest(key, kind.mapping.names) for key in self._peek(node))
        return kind.mapping if fits else kind.plain

    def _section(self, node: yaml.Node, kind: kinds.Section, path: KeyPath) -> Any:
        what = f"a mapping with the keys {', '.join(kind.names)}"
        if not isinstance(node, yaml.MappingNode):
            return self._wrong(node, path, what)
        keys = {key.name: key for key in kind.keys}
        values: dict[str, Any] = {}
        given: set[str] = set()
        for name, key_node, value_node in self._entries(node, path):
            if name in keys:
                if not keys[name].required and _is_left_empty(value_node, keys[name].kind):
                    continue
                given.add(name)
                value = self._read(value_node, keys[name].kind, (*path, name))
                if value is not _MISSING:
                    values[name] = value
            else:
                known = f"known keys: {', '.join(keys)}"
                meant = self._unknown(key_node, name, path, kind.names, known)
                # Whoever misspells a key did not forget it.
                given.update(filter(None, [meant]))
        for key in kind.keys:
            if key.required and key.name not in given:
                self._missing(node, key, path)
            elif key.name not in given:
                values |= _default(key)
        return values

    def _table(self, node: yaml.Node, kind: kinds.Table, path: KeyPath) -> Any:
        if not isinstance(node, yaml.MappingNode):
            return self._wrong(node, path, f"a mapping; its keys: {kind.expected}")
        values: dict[str, Any] = {}
        entries = self._entries(node, path)
        if len(entries) < kind.at_least:
            return self._wrong(node, path, f"at least one key: {kind.expected}")
        for name, key_node, value_node in entries:
            of = kind.kind_of(name)
            if of is None:
                self._unknown(key_node, name, path, kind.known, f"expected {kind.expected}")
                continue
            self._keys[*path, name] = key_node
            value = self._read(value_node, of, (*path, name))
            if value is not _MISSING:
                values[name] = value
        return values

    def _list(self, node: yaml.Node, kind: kinds.ListOf, path: KeyPath) -> Any:
        count = len(node.value) if isinstance(node, yaml.SequenceNode) else -1
        if count < (kind.at_most if kind.exactly else 0) or count > kind.at_most:
            what = f"a list of at most {kind.at_most} entries, each in braces or after a dash"
            of = f"{kind.at_most} {'names' if isinstance(kind.of, kinds.Text) else 'numbers'}"
            return self._wrong(node, path, f"a list of {of}" if kind.exactly else what)
        values = [self._read(n, kind.of, (*path, i)) for i, n in enumerate(node.value)]
        if kind.exactly and any(value is _MISSING for value in values):
            return _MISSING
        return {i: value for i, value in enumerate(values) if value is not _MISSING}

    def _pair(self, node: yaml.Node, kind: kinds.Pair, path: KeyPath) -> Any:
        what = f"a list of two numbers, the lower first [{self.unit(kind.of.unit, path)}]"
        if not isinstance(node, yaml.SequenceNode) or len(node.value) != 2:
            return self._wrong(node, path, what, "for example [-400, 50]")
        low, high = (self._read(n, kind.of, (*path, i)) for i, n in enumerate(node.value))
        if low is _MISSING or high is _MISSING:
            return _MISSING
        if low >= high:
            return self._wrong(node, path, what, "swap the two ends, or leave travel out")
        return low, high

    def _number(self, node: yaml.Node, kind: kinds.Number, path: KeyPath) -> Any:
        unit = self.unit(kind.unit, path)
        expected = kind.expected(unit)
        if not isinstance(node, yaml.ScalarNode):
            return self._wrong(node, path, expected)
        remedy = number_remedy(node)
        if remedy is not None:
            return self._wrong(node, path, expected, remedy)
        value = number_value(node)
        if unit.startswith("inch"):
            value = mm_from_inch(value)
        if not kind.holds(value):
            return self._wrong(node, path, expected)
        plausible = kind.plausible(value)
        if plausible is not None:
            own = kind.unit if unit.startswith("inch") else unit
            return self._wrong(node, path, f"{plausible} [{own}]", f"the unit here is {unit}")
        return value

    def _flag(self, node: yaml.Node, path: KeyPath) -> Any:
        text = node.value if isinstance(node, yaml.ScalarNode) else None
        if isinstance(text, str) and node.tag.endswith(":bool"):
            return text.lower() in {"true", "yes", "on"}
        return self._wrong(node, path, "true or false")

    def _words(self, node: yaml.Node, kind: kinds.Choice | kinds.Text, path: KeyPath) -> Any:
        if not isinstance(node, yaml.ScalarNode) or is_empty(node):
            expected = kind.expected if isinstance(kind, kinds.Text) else _one_of(kind.words)
            return self._wrong(node, path, expected)
        text: str = node.value
        if isinstance(kind, kinds.Text):
            if re.fullmatch(kind.pattern, text):
                return text
            return self._wrong(node, path, kind.expected)
        if text in kind.words:
            return text
        close = nearest(text, kind.words)
        return self._wrong(
            node, path, _one_of(kind.words), f"did you mean {close!r}?" if close else None
        )

    def _entries(
        self, node: yaml.MappingNode, path: KeyPath
    ) -> list[tuple[str, yaml.Node, yaml.Node]]:
        return self.document.entries(node, f"{dotted(path)}." if path else "", self.problems)

    def _wrong(
        self, node: yaml.Node, path: KeyPath, expected: str, remedy: str | None = None
    ) -> Any:
        what = dotted(path) or "the file"
        self.problems.add(
            self.document.place(node), f"{what} is {shown(node)}, expected {expected}",
            remedy or _example(path),
        )  # fmt: skip
        return _MISSING

    def _unknown(
        self, node: yaml.Node, name: str, path: KeyPath, known: tuple[str, ...], remedy: str
    ) -> str | None:
        """Tell of an unknown key; gives the known one that was probably meant."""
        close = nearest(name, known)
        hint = f", the nearest known key is {close!r}" if close else ""
        label = dotted((*path, name[:80]))
        self.problems.add(self.document.place(node), f"{label} is not a known key{hint}", remedy)
        return close

    def _missing(self, node: yaml.Node, key: kinds.Key, path: KeyPath) -> None:
        match key.kind:
            case kinds.Number(unit=unit):
                expected = key.kind.expected(self.unit(unit, (*path, key.name)))
            case kinds.Choice(words=words):
                expected = _one_of(words)
            case (
                kinds.Text(expected=expected) | kinds.OrMapping(plain=kinds.Text(expected=expected))
            ):
                pass
            case _:
                expected = "a mapping"
        remedy = f"add {key.name}: {key.example}" if key.example else key.doc
        self.problems.add(
            self.document.place(node),
            f"{dotted((*path, key.name))} is missing, expected {expected}",
            remedy,
        )


def dotted(path: KeyPath) -> str:
    """Path as messages show it: `axes.Z.modes[0].frequency`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


def _default(key: kinds.Key) -> dict[str, Any]:
    """Entry that stands for an absent key; none for a key without a default."""
    if isinstance(key.kind, kinds.Section) and not key.required:
        return {key.name: {k: v for part in key.kind.keys for k, v in _default(part).items()}}
    return {} if key.default is None else {key.name: key.default}


def _is_left_empty(node: yaml.Node, kind: kinds.Kind) -> bool:
    """Whether all entries of a key like `modes:` have been deleted or commented out."""
    kind = kind.plain if isinstance(kind, kinds.OrMapping) else kind
    collection = isinstance(kind, kinds.Section | kinds.Table | kinds.ListOf)
    return collection and is_empty(node)


def _one_of(words: tuple[str, ...]) -> str:
    return words[0] if len(words) == 1 else f"one of {', '.join(words)}"


def _example(path: KeyPath) -> str | None:
    """Remedy from the table's own example for a key."""
    kind: kinds.Kind | None = table.MACHINE
    key: kinds.Key | None = None
    for part in path:
        if isinstance(kind, kinds.OrMapping):
            kind = kind.mapping if isinstance(part, str) else kind.plain
        match kind:
            case kinds.Section():
                key = next((k for k in kind.keys if k.name == part), None)
                kind = key.kind if key else None
            case kinds.Table():
                kind = kind.kind_of(str(part))
            case kinds.ListOf() | kinds.Pair():
                kind = kind.of
    if key is None:
        return "start from machines/vmc.yaml"
    return f"for example {key.name}: {key.example}" if key.example else key.doc
