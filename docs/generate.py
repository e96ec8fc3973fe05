"""What in the documentation follows from the code: three pages, and what commands print.

`python docs/generate.py` writes the pages of every command, every machine key and every reason, and
the outputs below the commands of all pages; tests hold the files to what this says.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer

from gcodejerk.cli import app
from gcodejerk.machine import machine_schema
from gcodejerk.reasons import EXPLAINED, Reason

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
GENERATED = "<!-- written by docs/generate.py -->"


def commands() -> str:
    """Every command with its arguments and options."""
    group = typer.main.get_command(app)
    lines = [
        "# Commands", "", GENERATED, "",
        "Exit status: 0 done, 1 refused or failed (with a message, and nothing half-written), "
        "2 wrong usage, 3 from `process --check` where something would change. `-` is standard "
        "input or output; notes go to standard error, results to standard output.", "",
        "`gcodejerk --install-completion` teaches your shell the commands, options and names.", "",
    ]  # fmt: skip
    for name, command in _walk(group, ""):
        usage = " ".join(
            param.metavar or param.human_readable_name.upper()
            for param in command.params
            if param.param_type_name == "argument"
        )
        lines += [f"## gcodejerk {name}", "", _sentence(command.help), ""]
        lines += [f"`gcodejerk {' '.join(filter(None, (name, usage)))}`", ""]
        rows = [row for param in command.params if (row := _row(param)) is not None]
        if rows:
            lines += ["| | |", "|---|---|", *rows, ""]
    return "\n".join(lines)


def _walk(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, command in getattr(group, "commands", {}).items():
        full = f"{prefix}{name}"
        if getattr(command, "commands", None):
            yield from _walk(command, f"{full} ")
        else:
            yield full, command


def _row(param: Any) -> str | None:
    """One line of a table of options."""
    text = _cell(getattr(param, "help", None) or "")
    if param.param_type_name == "argument":
        return f"| `{param.metavar or param.human_readable_name.upper()}` | {text} |"
    if param.name == "help":
        return None
    names = ", ".join(f"`{name}`" for name in [*param.opts, *param.secondary_opts])
    takes = "" if getattr(param, "is_flag", False) else f" {param.metavar or ''}".rstrip()
    return f"| {names}{takes.replace('|', ' or ')} | {text} |"


def _sentence(text: str | None) -> str:
    return " ".join((text or "").split())


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def keys() -> str:
    """Every key of a machine file, from its JSON Schema."""
    lines = [
        "# Every key of a machine file", "", GENERATED, "",
        "[How to write one](machine-file.md). `gcodejerk machine schema` prints all of this as a "
        "JSON Schema, by which editors complete keys and check values.", "",
        "| key | what it is |", "|---|---|",
    ]  # fmt: skip
    schema = machine_schema()
    lines += [f"| `{path}` | {_cell(text)} |" for path, text in _keys(schema, "", schema, set())]
    return "\n".join(lines) + "\n"


def _keys(
    node: dict[str, Any], path: str, schema: dict[str, Any], seen: set[str]
) -> Iterator[tuple[str, str]]:
    """Paths of keys below a node, each once."""
    if reference := node.get("$ref"):
        name = reference.rsplit("/", 1)[-1]
        node = schema.get("$defs", {}).get(name, {})
    for name, inner in node.get("properties", {}).items():
        yield from _key(inner, f"{path}{name}", schema, seen)
    for inner in node.get("patternProperties", {}).values():
        yield from _key(inner, f"{path}?", schema, seen)
    for branch in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _keys(branch, path, schema, seen)
    items = node.get("items")
    if isinstance(items, dict):
        yield from _keys(items, path.removesuffix(".") + "[].", schema, seen)


def _key(
    inner: dict[str, Any], path: str, schema: dict[str, Any], seen: set[str]
) -> Iterator[tuple[str, str]]:
    if path in seen:
        return
    seen.add(path)
    text = inner.get("description", "")
    if text:
        yield path, text
    yield from _keys(inner, f"{path}.", schema, seen)


def reasons() -> str:
    """Every reason for which a rapid is left alone, and what helps."""
    lines = [
        "# What is left alone, and what helps", "", GENERATED, "",
        "Each rapid that passes through unchanged has one of these reasons. `gcodejerk inspect` "
        "shows them line by line, `process -v` by reason, the page of `--report part.html` with "
        "the remedies, worst first.", "",
        "| reason | means | what helps |", "|---|---|---|",
    ]  # fmt: skip
    lines += [
        f"| `{reason}` | {_cell(EXPLAINED[reason].means)} | {_cell(EXPLAINED[reason].remedy)} |"
        for reason in Reason
    ]
    return "\n".join([*lines, "", (HERE / "what-is-followed.md.part").read_text(), ""])


BLOCK = re.compile(r"```console\n\$ (gcodejerk [^\n]*)\n(.*?)```\n", re.DOTALL)
"""A command and what it prints; commands of other programs are not run."""
COMMANDS_RUN = (ROOT / "README.md", *sorted(HERE.glob("*.md")))


def outputs(page: str, folder: Path) -> Iterator[tuple[str, str, str]]:
    """Every command of a page, what the page shows, and what it prints in a folder of samples."""
    here = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    here.pop("COLUMNS", None)
    shutil.copytree(ROOT / "samples", folder, dirs_exist_ok=True)
    for command, shown in BLOCK.findall(page):
        run = subprocess.run(
            ["bash", "-c", command], cwd=folder, env=here, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        yield command, plain(shown), plain(run.stdout + run.stderr)


def plain(text: str) -> str:
    """Without blanks at the ends of lines, and without blank lines around it."""
    return "\n".join(line.rstrip() for line in text.splitlines()).strip("\n")


def refresh(path: Path) -> None:
    """Put what commands print now below them."""
    page = path.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        printed = [text for _, _, text in outputs(page, Path(folder))]
    lines = iter(f"{text}\n" if text else "" for text in printed)
    path.write_text(
        BLOCK.sub(lambda block: f"```console\n$ {block[1]}\n{next(lines)}```\n", page),
        encoding="utf-8",
    )


PAGES = {"commands.md": commands, "machine-keys.md": keys, "reasons.md": reasons}


def main() -> None:
    """Write the pages."""
    for name, page in PAGES.items():
        (HERE / name).write_text(page().rstrip("\n") + "\n", encoding="utf-8")
    for path in COMMANDS_RUN:
        refresh(path)


if __name__ == "__main__":
    main()
