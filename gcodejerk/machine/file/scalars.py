"""Single values as they are written: what counts as a number, and how messages show the rest.

Rule: a number is a decimal number, as a machinist reads it. YAML 1.1 has more of them (octal, base
60, 0x10) and fewer (it takes 5e6 for text); both would surprise, so the text decides, not the tag.
"""

from __future__ import annotations

import math
import re

import yaml

_DECIMAL = re.compile(r"[-+]?([0-9][0-9_]*(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")


def is_empty(node: yaml.Node) -> bool:
    """Whether nothing stands after the colon."""
    return isinstance(node, yaml.ScalarNode) and node.value == "" and not node.style


def number_value(node: yaml.ScalarNode) -> float:
    """Value of a scalar for which `number_remedy` has none."""
    return float(node.value.replace("_", ""))


def number_remedy(node: yaml.ScalarNode) -> str | None:
    """Remedy for a scalar that is not a decimal number; None for one that is."""
    text: str = node.value
    match = _DECIMAL.fullmatch(text)
    if node.style:  # quoted, or a block of text
        return "leave the quotes out" if match else "write a plain number"
    if match is not None:
        if not math.isfinite(number_value(node)):
            return "write a number that a machine can have"
        # YAML 1.1 reads a leading zero as octal; nobody who writes 010 means 8.
        if re.fullmatch(r"[-+]?0[\d_]+", text):
            return "leave the leading zero out"
        return None
    if text.lower().lstrip("+-") == ".inf":
        return "leave the key out where there is no limit"
    if text.lower() == ".nan":
        return "write the number, or leave the key out where it is optional"
    if re.fullmatch(r"[-+]?\d+,\d+", text):
        return "write a decimal point"
    if text == "":
        return "write the number after the colon, or leave the key out where it is optional"
    return "write a plain decimal number without its unit, for example 5.0e+5"


def shown(node: yaml.Node) -> str:
    """Value as messages show it: numbers as they are, words in quotes, all of it short."""
    if isinstance(node, yaml.MappingNode):
        return "an empty mapping" if not node.value else "a mapping"
    if isinstance(node, yaml.SequenceNode):
        parts = [n.value for n in node.value[:4] if isinstance(n, yaml.ScalarNode)]
        if len(parts) == len(node.value):
            return f"[{', '.join(str(part)[:20] for part in parts)}]"
        return f"a list of {len(node.value)}"
    text = str(node.value)
    if is_empty(node):
        return "empty"
    if not getattr(node, "style", None) and (
        _DECIMAL.fullmatch(text) or not node.tag.endswith(":str")
    ):
        return text[:60]
    return repr(text if len(text) <= 60 else text[:57] + "...")
