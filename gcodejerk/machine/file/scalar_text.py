"""Numbers, words and mappings in one line, as text that YAML reads back."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping


def number_text(value: float) -> str:
    """Shortest text that reads back as the same number, also for readers of YAML 1.1."""
    return re.sub(r"^(-?\d+)e", r"\1.0e", repr(float(value)))


def quoted(text: str) -> str:
    """Double-quoted scalar, which JSON and YAML write alike; simple words go without quotes."""
    if re.fullmatch(r"(?!(true|false|yes|no|on|off|null)$)[a-z][a-z0-9_-]*", text):
        return text
    return json.dumps(text, ensure_ascii=False)


def braces(values: Mapping[str, str]) -> str:
    """A mapping whose values are texts already."""
    return "{" + ", ".join(f"{key}: {value}" for key, value in values.items()) + "}"
