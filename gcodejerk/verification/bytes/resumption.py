"""Where two files that differ agree again, so that what else is wrong behind is found too.

Rule: nothing here says that anything is right: it is asked behind a violation alone.
"""

from __future__ import annotations

import io

from gcodejerk.verification.bytes.source import Window

TRACES = (b"(gcodejerk: ", b"; gcodejerk: ")
"""How a stream begins that has a comment."""
REACH = 1 << 16
"""Bytes within which files have to agree again."""
CHANGED = 8
"""Lines of the original that may be lost or changed in one go."""


def pass_changed(original: Window, processed: Window, size: int | None) -> bool:
    """Pass lines that are changed, lost or added.

    Parameters
    ----------
    original, processed : Window
        At the first line that differs.
    size : int, optional
        Bytes of the original up to the next rapid that may be replaced; to its end where left out.

    Returns
    -------
    bool
        Whether the files agree again behind them.
    """
    text = original.peek(REACH)
    mine, theirs = _lines(text), _lines(processed.peek(REACH))
    # Behind the last of these a stream may stand, and the lines that follow need not be the same.
    within = len(mine) if size is None else text.count(b"\n", 0, size)
    first: dict[bytes, int] = {}
    pairs: dict[tuple[bytes, bytes], int] = {}
    stream = len(theirs)
    for k, line in enumerate(theirs):
        first.setdefault(line, k)
        pairs.setdefault((line, theirs[k + 1] if k + 1 < len(theirs) else b""), k)
        if line.startswith(TRACES):
            stream = min(stream, k)
    best = None
    for i, line in enumerate(mine[: min(CHANGED, within) + 1]):
        if i + 1 < within:
            k = pairs.get((line, mine[i + 1]), len(theirs))
        else:
            k = first.get(line, len(theirs))
        if i == within:  # the rapid's block, or its stream
            k = min(k, stream)
        if k < len(theirs) and i + k and (best is None or i + k < sum(best)):
            best = i, k
    if best is None:
        return False
    _skip(original, mine[: best[0]])
    _skip(processed, theirs[: best[1]])
    return True


def pass_stream(original: Window, processed: Window, size: int) -> bool:
    """Pass the rest of what stands in the place of a rapid, and is no stream.

    Parameters
    ----------
    original : Window
        At the rapid's block; it stays there.
    processed : Window
        Where reading ended.
    size : int
        Bytes of the block.

    Returns
    -------
    bool
        Whether the files agree again behind it.
    """
    following = _lines(original.peek(size + REACH)[size:])[:1]
    theirs = _lines(processed.peek(REACH))
    for k, line in enumerate(theirs):
        if (line.startswith(TRACES) and k) or (following == [line] and line.strip()):
            _skip(processed, theirs[:k])
            return True
    return False


def _lines(text: bytes) -> list[bytes]:
    return io.BytesIO(text).readlines()


def _skip(window: Window, lines: list[bytes]) -> None:
    window.skip(sum(map(len, lines)))
