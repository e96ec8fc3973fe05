"""The command `controllers`."""

from __future__ import annotations

import json

from gcodejerk.cli.common import JsonOption, console
from gcodejerk.errors import GcodejerkError


def controllers(as_json: JsonOption = False) -> None:
    """Show what each controller's emitter can write, and how far its facts can be trusted."""
    from gcodejerk.emit import controllers as installed
    from gcodejerk.emit import load_controller
    from gcodejerk.report.tables import controllers_table

    rows: list[tuple[str, str, str, str]] = []
    for name in sorted(installed()):
        try:
            rows += [(name, f.name, f.confidence, f.note) for f in load_controller(name).forms]
        except GcodejerkError as error:
            rows.append((name, "-", "broken", str(error)))
    if as_json:
        keys = ("controller", "form", "confidence", "note")
        print(json.dumps([dict(zip(keys, row, strict=True)) for row in rows], indent=1))
        return
    console().print(controllers_table(rows))
