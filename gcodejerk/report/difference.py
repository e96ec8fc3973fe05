"""What would change in a program, in the form of `diff -u`.

Streams, and cycles that were written out, are the only differences, and where they are is known: so
nothing has to be searched for.
"""

from __future__ import annotations

import os
from typing import BinaryIO

from gcodejerk.rewrite.result import Result


def difference(source: BinaryIO, target: BinaryIO, result: Result) -> bytes:
    """A unified difference between a program and its output, without lines of context.

    Parameters
    ----------
    source, target : binary files
        The program and its output.
    result : Result
        What was done, with the place of every stream.

    Returns
    -------
    bytes
        Empty where nothing changes.
    """
    name = os.fsencode(result.program.name)
    out = [b"--- %s\n+++ %s (gcodejerk)\n" % (name, name)]
    added = 0
    for begin, end, line, first, last in result.hunks.tolist():
        target.seek(begin)
        new = target.read(end - begin).splitlines(keepends=True)
        source.seek(first)
        # The stamp replaces nothing.
        old = [source.read(last - first)] if last > first else []
        out.append(b"@@ -%d,%d +%d,%d @@\n" % (line, len(old), line + added, len(new)))
        out += [b"-" + _ended(text) for text in old] + [b"+" + _ended(text) for text in new]
        added += len(new) - len(old)
    return b"".join(out) if len(out) > 1 else b""


def _ended(line: bytes) -> bytes:
    """A line with its end, or with diff's note that it has none."""
    return line if line.endswith((b"\n", b"\r")) else line + b"\n\\ No newline at end of file\n"
