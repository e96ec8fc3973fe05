"""Replacements that stand in the file once more, byte for byte, after they were proven.

Whatever is judged of a replacement depends on its text, on the block, on what the columns of the
rapid say (its places among them), on whether a stream stands right in front of it, and on the
profile that was reported. Where all of that is as it was with one in which nothing was wrong,
nothing is wrong with it here.

Rule: nothing is learned before it was judged, and nothing any more once anything was complained of.
All of that is compared as it is, and so is the text with that of the file.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc import Rapids
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.bytes.states import States

Reported = Mapping[int, NDArray[np.float64]]
Key = tuple[bytes, bytes, bool, bytes | None, bytes]
"""Columns but for the places, places, whether a stream stands in front, profile, and block."""
MOST_BYTES = 1 << 24
"""Text that is remembered, with its keys."""
KEY_BYTES = 1 << 10
"""What a key and its places take, about."""


class Proven:
    """What was proven, by what its judgement depends on."""

    def __init__(self, window: Window, rapids: Rapids, states: States, reported: Reported) -> None:
        """Begin.

        Parameters
        ----------
        window : Window
            The processed file.
        rapids : Rapids
            Of the original.
        states : States
            What their columns say.
        reported : mapping of int to array
            The profiles that streams are held to, by line; empty where they are held to none.
        """
        self.window, self.states, self.reported = window, states, reported
        self.line = rapids.line
        self.known: dict[Key, bytes] = {}
        self.size = 0
        self.open: list[tuple[Key, bytes]] = []
        """Read, and not judged yet."""

    def key(self, i: int, block: bytes, follows: bool) -> Key:
        """What the judgement of a replacement depends on, but for its own text.

        Parameters
        ----------
        i : int
            The rapid.
        block : bytes
            Its block, line end included.
        follows : bool
            Whether a stream stands right in front of it.
        """
        profile = self.reported.get(int(self.line[i])) if self.reported else None
        # As many numbers in a row as any other: the bytes say how many rows there are.
        said = None if profile is None else profile.tobytes()
        return *self.states.state_and_place(i), follows, said, block

    def passes(self, key: Key) -> bool:
        """Pass a replacement that was proven; whether one stands here."""
        text = self.known.get(key)
        if text is None:
            return False
        window = self.window
        window.fill(len(text))
        if not window.data.startswith(text, window.at):
            return False
        window.skip(len(text))
        return True

    def read(self, key: Key, text: bytes) -> None:
        """Note a replacement that was read, and is still to be judged."""
        self.open.append((key, text))

    def judged(self, without_fault: bool) -> None:
        """All that were read have been judged."""
        for key, text in self.open if without_fault else ():
            if self.size + len(text) + KEY_BYTES > MOST_BYTES:
                self.known.clear()
                self.size = 0
            if key not in self.known:
                self.known[key] = text
                self.size += len(text) + KEY_BYTES
        self.open.clear()
