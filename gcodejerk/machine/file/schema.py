"""The machine file as JSON Schema, for editors that complete and check while one types.

Rule: generated from the table of keys and nothing else. What involves several keys (a mode above
half the sampling rate, an offset of an axis that is not there) no schema can say; `machine check`
does.
"""

from __future__ import annotations

from typing import Any

import yaml

from gcodejerk.machine.file import kinds, table


def machine_schema() -> dict[str, Any]:
    """JSON Schema (2020-12) of a machine file.

    Returns
    -------
    dict
        The schema, ready for `json.dumps`.

    Examples
    --------
    >>> schema = machine_schema()
    >>> schema["required"]
    ['interval', 'positioning', 'axes']
    >>> schema["properties"]["interval"]["description"]
    'The control command interval. [s]'
    """
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "gcodejerk machine file",
        "description": "A machine: its axes, their limits, and the modes in which it vibrates.",
        **_of(table.MACHINE),
    }


def _of(kind: kinds.Kind) -> dict[str, Any]:
    match kind:
        case kinds.Section(keys=keys):
            return {
                "type": "object",
                "properties": {key.name: _key(key) for key in keys},
                "required": [key.name for key in keys if key.required],
                "additionalProperties": False,
            }
        case kinds.Table(entries=entries, at_least=at_least):
            return {
                "type": "object",
                "patternProperties": {f"^({pattern})$": _of(of) for pattern, of in entries},
                "minProperties": at_least,
                "additionalProperties": False,
            }
        case kinds.OrMapping(plain=plain, mapping=mapping):
            return {"anyOf": [_of(plain), _of(mapping)]}
        case kinds.ListOf(of=of, at_most=at_most, exactly=exactly):
            least = {"minItems": at_most} if exactly else {}
            return {"type": "array", "items": _of(of), **least, "maxItems": at_most}
        case kinds.Pair(of=of):
            return {"type": "array", "items": _of(of), "minItems": 2, "maxItems": 2}
        case kinds.Number():
            return _number(kind)
        case kinds.Text(pattern=pattern):
            return {"type": "string", "pattern": f"^({pattern})$"}
        case kinds.Choice(words=words):
            return {"enum": [int(word) if word.isdecimal() else word for word in words]}
        case kinds.Flag():
            return {"type": "boolean"}


def _number(kind: kinds.Number) -> dict[str, Any]:
    bounds = {
        "exclusiveMinimum": kind.above,
        "minimum": kind.at_least,
        "exclusiveMaximum": kind.below,
        # The bound of a length is one in mm, whatever the file's unit is.
        "maximum": None if kind.unit.startswith("mm") else kind.at_most,
    }
    return {"type": "number"} | {key: value for key, value in bounds.items() if value is not None}


def _key(key: kinds.Key) -> dict[str, Any]:
    schema = {"title": key.name, "description": key.doc} | _of(key.kind)
    unit = getattr(getattr(key.kind, "of", key.kind), "unit", None)
    if unit is not None:
        schema["description"] += f" [{_units(unit)}]"
    if key.default is not None:
        schema["default"] = 1 if key.name == "schema" else key.default
    if key.example is not None:
        schema["examples"] = [yaml.safe_load(key.example)]
    if not key.required and schema.get("type") in ("object", "array") and not unit:
        schema["type"] = [schema["type"], "null"]
    if isinstance(key.kind, kinds.OrMapping) and isinstance(key.kind.plain, kinds.ListOf):
        schema["anyOf"].append({"type": "null"})
    return schema


def _units(unit: str) -> str:
    """Name the unit of a number for every kind of file and axis."""
    if not unit.startswith("mm"):
        return unit
    inch, degrees = unit.replace("mm", "inch"), unit.replace("mm", "deg")
    return f"{unit}; {inch} with units: inch; {degrees} on a rotary axis"
