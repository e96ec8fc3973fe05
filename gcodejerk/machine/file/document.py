"""The text of a machine file as YAML nodes that know their place.

Rule: nothing is constructed here. PyYAML composes nodes, which keep line and column, and every
value stays the text that was written; what it means is decided against the table. So no tag can
make an object, and a key such as `on` or `Y` is a word and never a truth value.

Rule: a file is measured before it is composed. Size, depth, number of nodes and number of aliases
have an upper end, and merge keys draw on a budget, so that a small file cannot become a large one
(the "billion laughs").
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from gcodejerk.errors import Place
from gcodejerk.machine.problems import Problems, refusal
from gcodejerk.machine.reading import NotAFileError, read_file

MOST_BYTES = 1 << 20
MOST_NODES = 20_000
MOST_DEPTH = 20
MOST_ALIASES = 1_000
MOST_DIRECTIVES = 20
"""Lines such as `%YAML 1.1`; the parser compares each of them with all others."""

# Composing in C is ten times as fast; PyYAML built without libyaml has the same nodes and marks.
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_YAML = "tag:yaml.org,2002:"
_PLAIN_TAGS = {_YAML + word for word in ("str", "int", "float", "bool", "null", "map", "seq")}
_DIRECTIVE = re.compile("^%", re.MULTILINE)
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
_WRITE_TEXT = "write the machine file as UTF-8 text; machines/vmc.yaml is an example"


def read_text(path: str | Path) -> str:
    """Read the text of a machine file.

    Parameters
    ----------
    path : str or Path
        The file; it is taken as it is.

    Returns
    -------
    str
        Its text, without a byte order mark.

    Raises
    ------
    MachineFileError
        The file cannot be read, is too large to be a machine file, or is not UTF-8 text.
    """
    name = str(path)
    try:
        data = read_file(Path(path), MOST_BYTES + 1)
    except FileNotFoundError:
        raise refusal(
            Place(name), "there is no such file", "give the path of a machine file (YAML)"
        ) from None
    except IsADirectoryError:
        raise refusal(
            Place(name), "is a directory, expected a machine file", "name the file in it"
        ) from None
    except NotAFileError:
        raise refusal(
            Place(name),
            "is a pipe or a device, expected a machine file",
            "write it to a file, and give the path of that",
        ) from None
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise refusal(
            Place(name), f"cannot be read: {reason}", "check the path and its permissions"
        ) from None
    return decode(data, name)


def decode(data: bytes, name: str) -> str:
    """Text from the bytes of a machine file.

    Parameters
    ----------
    data : bytes
        The whole file.
    name : str
        What messages call it.

    Returns
    -------
    str
        The text, without a byte order mark.

    Raises
    ------
    MachineFileError
        It is too large, UTF-16 or UTF-32, not UTF-8 or not text.
    """
    _check_size(len(data), name)
    if data.startswith((b"\xff\xfe", b"\xfe\xff", b"\x00\x00\xfe\xff")):
        raise refusal(Place(name, 1, 1), "is UTF-16 or UTF-32 text", "save it as UTF-8")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = len(before[before.rfind(b"\n") + 1 :].decode("utf-8", "replace")) + 1
        raise refusal(
            Place(name, line, column),
            f"byte 0x{data[error.start]:02X} is not UTF-8 text",
            _WRITE_TEXT,
        ) from None


class Document:
    """Text, its places, and the nodes in it.

    Parameters
    ----------
    text : str
        The machine file.
    name : str
        What messages call it.

    Raises
    ------
    MachineFileError
        The text is not YAML, is empty, or is more than a machine file can hold.
    """

    def __init__(self, text: str, name: str) -> None:
        self.name = name
        self._lines = text.splitlines()
        self._merge_budget = MOST_NODES
        _check_size(len(text), name)
        control = _CONTROL.search(text)
        if control is not None:
            raise refusal(
                self._place_at(text, control.start()),
                f"holds the control character 0x{ord(control[0]):02X}; this is not a text file",
                _WRITE_TEXT,
            )
        try:
            self._measure(text)
            root = yaml.compose(text, Loader=_LOADER)
        except yaml.MarkedYAMLError as error:
            raise self._not_yaml(error) from None
        except yaml.reader.ReaderError as error:
            raise refusal(
                self._place_at(text, error.position),
                f"holds the character {error.character!r}, which YAML does not allow",
                _WRITE_TEXT,
            ) from None
        except (ValueError, OverflowError) as error:
            # Where libyaml is missing, PyYAML asks Python for the character '\\U00110000'.
            raise refusal(Place(name), f"is not YAML: {error}", _WRITE_TEXT) from None
        if root is None:
            raise refusal(
                Place(name, 1, 1), "is empty, expected a machine", "start from machines/vmc.yaml"
            )
        self.root: yaml.Node = root

    def place(self, node: yaml.Node) -> Place:
        """Where a node begins."""
        return self._place_of(node.start_mark)

    def entries(
        self, node: yaml.MappingNode, label: str, problems: Problems
    ) -> list[tuple[str, yaml.Node, yaml.Node]]:
        """Keys of a mapping as text, with the nodes of key and value; merge keys followed.

        Parameters
        ----------
        node : yaml.MappingNode
            The mapping.
        label : str
            Its dotted path with a final dot, for messages; empty at the top level.
        problems : Problems
            Takes a key that is given twice, and one that is not a word.

        Returns
        -------
        list of (str, yaml.Node, yaml.Node)
            Each key once, in the order written, merged ones last.
        """
        own: dict[str, tuple[yaml.Node, yaml.Node]] = {}
        merged: list[yaml.Node] = []
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                problems.add(
                    self.place(key), f"a key of {label[:-1] or 'the file'} is not a word",
                    "write the key as one word before a colon",
                )  # fmt: skip
            elif key.tag == _YAML + "merge":
                merged.append(value)
            elif key.value in own:
                first = self.place(own[key.value][0])
                problems.add(
                    self.place(key),
                    f"{label}{key.value} is given twice, first at {first}",
                    "keep one of the two",
                )
            else:
                own[key.value] = (key, value)
        for value in merged:
            for key, key_node, value_node in self._merged(value, 0):
                own.setdefault(key, (key_node, value_node))
        return [(key, *nodes) for key, nodes in own.items()]

    def _merged(self, node: yaml.Node, depth: int) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
        """Entries that a merge key (`<<`) brings in, those that count first coming first."""
        self._merge_budget -= 1
        if depth > MOST_DEPTH or self._merge_budget < 0:
            raise refusal(
                self.place(node),
                "merge keys (<<) expand to more than a machine file can hold",
                "write the values out",
            )
        if isinstance(node, yaml.SequenceNode):
            for part in node.value:
                yield from self._merged(part, depth + 1)
        elif isinstance(node, yaml.MappingNode):
            nested = []
            for key, value in node.value:
                self._merge_budget -= 1
                if key.tag == _YAML + "merge":
                    nested.append(value)
                elif isinstance(key, yaml.ScalarNode):
                    yield key.value, key, value
            for value in nested:
                yield from self._merged(value, depth + 1)
        else:
            raise refusal(
                self.place(node),
                "a merge key (<<) stands before something that is not a mapping",
                "merge an alias of a mapping, for example <<: *linear",
            )

    def _measure(self, text: str) -> None:
        """Refuse what is too large to compose, and tags that stand for more than plain values."""
        directives = list(islice(_DIRECTIVE.finditer(text), MOST_DIRECTIVES + 1))
        if len(directives) > MOST_DIRECTIVES:
            raise refusal(
                self._place_at(text, directives[-1].start()),
                f"holds more than {MOST_DIRECTIVES} lines that begin with %",
                "begin a comment with #",
            )
        nodes = depth = aliases = 0
        for event in yaml.parse(text, Loader=_LOADER):
            nodes += isinstance(event, yaml.NodeEvent)
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            aliases += isinstance(event, yaml.AliasEvent)
            if nodes > MOST_NODES or depth > MOST_DEPTH or aliases > MOST_ALIASES:
                raise self._too_much(self._place_of(event.start_mark))
            tag = getattr(event, "tag", None)
            if tag is not None and tag != "!" and tag not in _PLAIN_TAGS:
                raise refusal(
                    self._place_of(event.start_mark),
                    f"the tag {tag.replace(_YAML, '!!')[:60]!r} is not allowed",
                    "write plain words and numbers",
                )

    def _too_much(self, place: Place) -> Exception:
        return refusal(
            place,
            f"holds more than {MOST_NODES} values, {MOST_ALIASES} aliases or {MOST_DEPTH} levels, "
            "which no machine has",
            "start from machines/vmc.yaml",
        )

    def _not_yaml(self, error: yaml.MarkedYAMLError) -> Exception:
        mark = error.problem_mark or error.context_mark
        place = Place(self.name) if mark is None else self._place_of(mark)
        if "nesting depth" in (error.problem or ""):
            # libyaml reads ahead, and from 0.2.6 on no deeper than 1000 levels.
            return self._too_much(place)
        remedy = "indent with spaces, put a colon and a blank after each key, close every bracket"
        if "\t" in (place.text or ""):
            remedy = "this line holds a tab; indent with spaces"
        elif "another document" in (error.problem or ""):
            remedy = "keep one machine per file"
        context = f" {error.context}" if error.context else ""
        return refusal(place, f"is not YAML: {error.problem}{context}", remedy)

    def _place_of(self, mark: Any) -> Place:
        text = self._lines[mark.line] if mark.line < len(self._lines) else None
        return Place(self.name, mark.line + 1, mark.column + 1, text)

    def _place_at(self, text: str, index: int) -> Place:
        before = text[:index]
        line = before.count("\n")
        return Place(self.name, line + 1, index - (before.rfind("\n") + 1) + 1)


def _check_size(size: int, name: str) -> None:
    if size > MOST_BYTES:
        raise refusal(
            Place(name),
            f"is larger than {MOST_BYTES >> 20} MiB, which no machine file is",
            "check that this is the machine file and not the program",
        )
