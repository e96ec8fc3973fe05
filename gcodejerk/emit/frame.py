"""The lines around the points of a stream: what its block says besides, and what it relies on.

This module owns what every form of a stream in place has in common: the comment that names the
block, the block's other words, the modes that points need, the block's own words at the end, and
the modal values that the program relies on behind it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from decimal import Decimal

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import EmitError
from gcodejerk.nc import Block, Dialect, Rapids, Word, parse_block
from gcodejerk.nc.dialects.dialect import code_name
from gcodejerk.nc.dialects.gcodes import G90
from gcodejerk.nc.dialects.spelling import Writing
from gcodejerk.units import MM_PER_INCH

MOST = 1000
"""Different words around streams that are kept."""
COMMENT_LENGTH = 69
"""Controllers and senders with short lines choke on longer comments."""
_SIMPLE = re.compile(
    rb"(?:G0?0 )?((?:[XYZABCUVW]-?[0-9]+\.[0-9]*)(?: [XYZABCUVW]-?[0-9]+\.[0-9]*)*)"
)
"""A block of G0 and places: the most usual one, which need not be taken apart."""
NO_DIGIT = 1e-11
"""Of a difference of two positions: it may be an error of rounding. [mm] or [deg]"""
_SHOWN = bytes(c if 32 <= c < 127 and c not in b"()" else ord("?") for c in range(256))
"""Characters as comments have them."""


class Spelled:
    """The modal words around streams, which most rapids of a program have in common."""

    def __init__(self, rapids: Rapids, dialect: Dialect) -> None:
        self.rapids, self.dialect = rapids, dialect
        self.other_axes = [axis.encode() for axis in dialect.increments]
        """Addresses that look like those of axes."""
        self._modes: dict[tuple[bool, int, bool, int], list[bytes]] = {}
        self._restored: dict[tuple[int, float, bool], list[bytes]] = {}

    def modes(self, move: int) -> list[bytes]:
        """The modes of the stream that are not in force, or not stated."""
        rapids = self.rapids
        key = (
            bool(rapids.distance_stated[move]),
            int(rapids.feed_mode[move]),
            bool(rapids.feed_mode_stated[move]),
            int(rapids.path[move]),
        )
        if key not in self._modes:
            self._modes[key] = self._spell_modes(*key)
        return self._modes[key]

    def _spell_modes(
        self, distance_stated: bool, feed_mode: int, feed_mode_stated: bool, path: int
    ) -> list[bytes]:
        dialect = self.dialect
        codes: list[int | None] = []
        if not distance_stated and dialect.groups.get(G90) == "distance":
            codes.append(G90)
        if feed_mode != 94 or not feed_mode_stated:
            codes.append(dialect.feed_code(94))
        if path in (61, 62):
            codes.append(dialect.path_code(64))
        words = b" ".join(code_name(code) for code in codes if code is not None)
        return [words] if words else []

    def restored(self, move: int) -> list[bytes]:
        """Words that restore the feed mode and F."""
        rapids = self.rapids
        key = int(rapids.feed_mode[move]), float(rapids.feed[move]), bool(rapids.feed_whole[move])
        if key not in self._restored:
            if len(self._restored) >= MOST:
                self._restored.clear()
            self._restored[key] = self._spell_restored(*key)
        return self._restored[key]

    def _spell_restored(self, mode: int, feed: float, whole: bool) -> list[bytes]:
        """`whole`: F has to go without a decimal point, as it was written."""
        words = []
        code = self.dialect.feed_code(mode)
        if mode != 94 and code is not None:
            words.append(code_name(code))
        if mode != 93 and not np.isnan(feed):
            number = plain(Decimal(repr(feed)))
            words.append(b"F" + (number.rstrip(b"0").rstrip(b".") if whole else number))
        return words


def frame_of(spelled: Spelled, move: int, text: bytes) -> Frame:
    """The frame of a move, by the text of its block."""
    simple = _SIMPLE.fullmatch(text)
    if (
        simple is None
        or len(text) > COMMENT_LENGTH // 2
        or spelled.rapids.incremental[move]
        or spelled.rapids.fed[move]
        or any(letter in simple[1] for letter in spelled.other_axes)
    ):
        return Frame(spelled, move, parse_block(text, spelled.dialect), text)
    return SimpleFrame(spelled, move, text, simple[1])


class Frame:
    """The lines around a move's points: what its block says besides, and what it relies on."""

    def __init__(self, spelled: Spelled, move: int, block: Block, text: bytes) -> None:
        self.spelled, self.rapids, self.dialect = spelled, spelled.rapids, spelled.dialect
        self.move, self.block, self.text = move, block, text
        self.writing = writing_of(self.dialect)
        self.fed = bool(self.rapids.fed[move])
        """The block is a G1 that counts as a rapid."""
        self.axis_words: list[Word] = []
        self.behind: list[Word] = []
        """What the control runs when the motion has ended."""
        self.exact: list[Word] = []
        """G9, which is about the end of the motion of its own block."""
        self.others: list[Word] = []
        """What is said in front of the points; of G0, and the G1 of such a block, nothing."""
        self._moved: list[Word] = []
        self._sort()

    def _sort(self) -> None:
        """Put each word where it belongs."""
        dialect = self.dialect
        exact = None if dialect.exact_stop is None else dialect.exact_stop / 10
        for word in self.block.words:
            letter, value = word.letter, word.value
            if letter in AXES or letter in self.turned:
                self.axis_words.append(word)
            elif letter == "M" and value in dialect.after_m:
                self.behind.append(word)
            elif letter == "G" and value == exact:
                self.exact.append(word)
            elif not (letter == "G" and value == 1.0 and self.fed):
                self.others += [] if letter == "G" and value == 0.0 else [word]
                continue
            self._moved.append(word)

    @property
    def turned(self) -> Mapping[str, str]:
        """Addresses of increments, with their axes."""
        return self.dialect.increments

    def head(self, comments: bool) -> list[bytes]:
        """A comment that names the block, and the block without its axis words."""
        out = [self._comment()] if comments else []
        if self.block.comments or self.others:
            rest, at = [], 0
            for word in self._moved:
                rest.append(self.text[at : word.begin])
                at = word.end
            rest.append(self.text[at:])
            out.append(b"".join(rest).rstrip(b" \t\r"))
        return out

    def _comment(self) -> bytes:
        """`(gcodejerk: ...)` with the words of the block, in at most COMMENT_LENGTH characters."""
        opens, closes = self.writing.comment
        words = b" ".join(b"".join(w.text.split()) for w in self.block.words)
        shown = words.translate(_SHOWN)
        room = COMMENT_LENGTH - len(opens + b"gcodejerk: " + closes)
        if len(shown) > room:
            shown = shown[: room - 3] + b"..."
        return opens + b"gcodejerk: " + shown + closes

    def standstill(self, follows: bool) -> list[bytes]:
        """An exact stop, unless the machine rests already."""
        stands = follows or self.rapids.path[self.move] in (61, 62)
        return [] if stands else [self.writing.standstill]

    def modes(self) -> list[bytes]:
        """The modes of the stream that are not in force, or not stated."""
        return self.spelled.modes(self.move)

    def last_point(self, before_end: Mapping[int, Decimal], code: bytes = b"G1") -> bytes:
        """The last point: the block's own words, or what is left of its increments."""
        words = [self._last_word(word, before_end) for word in self.axis_words]
        return b" ".join([code, *self._ending(), *words])

    def own_motion(self) -> bytes:
        """The rapid as its own block has it: its axis words, and G0."""
        words = (w.letter.encode() + b"".join(w.text[1:].split()) for w in self.axis_words)
        return b" ".join([b"G0", *words])

    def _ending(self) -> list[bytes]:
        """What lets the last point end in a standstill where the rapid did."""
        path, dialect = int(self.rapids.path[self.move]), self.dialect
        code = dialect.path_code(path) if path in (61, 62) else None
        if code is None and (self.exact or dialect.stops_after_rapid):
            code = dialect.exact_stop
        return [] if code is None else [code_name(code)]

    def _last_word(self, word: Word, before_end: Mapping[int, Decimal]) -> bytes:
        axis = self.turned.get(word.letter)
        if axis is not None:
            # The points are absolute: so is the end of an increment.
            return axis.encode() + plain(programmed_end(self.rapids, self.move, axis, False))
        incremental = bool(self.rapids.incremental[self.move])
        if word.value is None or word.function:
            # A variable, or X=IC(5): the points know nothing of either.
            exact = self.dialect.arithmetic.exact
            end = computed_end if exact else programmed_end
            number = end(self.rapids, self.move, word.letter, incremental)
            left = number - before_end.get(AXES.index(word.letter), Decimal(0))
            return word.letter.encode() + plain(left if incremental else number)
        # X=3 of Siemens is X3.
        text = b"".join(word.text[1:].split()).removeprefix(b"=")
        number = Decimal(text.decode())
        if word.whole and number and self.dialect.whole_numbers == "machine":
            number = programmed_end(self.rapids, self.move, word.letter, incremental)
            if not incremental:
                return word.letter.encode() + plain(number)
        if not incremental:
            return word.letter.encode() + text.upper()
        left = number - before_end.get(AXES.index(word.letter), Decimal(0))
        return word.letter.encode() + plain(left)

    def restored(self) -> list[bytes]:
        """Words that restore the feed mode and F."""
        return self.spelled.restored(self.move)

    def after(self) -> list[bytes]:
        """What the block says when its motion has ended."""
        return [b" ".join(b"".join(w.text.split()) for w in self.behind)] if self.behind else []


class SimpleFrame(Frame):
    """The same of a block that is nothing but G0 and where the axes go."""

    def __init__(self, spelled: Spelled, move: int, text: bytes, places: bytes) -> None:
        super().__init__(spelled, move, Block(), text)
        self.places = places

    def _comment(self) -> bytes:
        opens, closes = self.writing.comment
        return opens + b"gcodejerk: " + self.text + closes

    def last_point(self, before_end: Mapping[int, Decimal], code: bytes = b"G1") -> bytes:
        """The last point: the block's own words."""
        return b" ".join([code, *self._ending(), self.places])

    def own_motion(self) -> bytes:
        """The rapid as its own block has it."""
        return b"G0 " + self.places


def writing_of(dialect: Dialect) -> Writing:
    """How streams are spelled in a dialect.

    Raises
    ------
    EmitError
        No form is known.
    """
    if dialect.writing is None:
        raise EmitError(
            f"no form of a stream is known for the dialect {dialect.name}",
            "use --controller csv, which writes the streams as a table, or say in which other "
            "dialect the program is written (--dialect)",
        )
    return dialect.writing


def programmed_end(rapids: Rapids, move: int, axis: str, incremental: bool) -> Decimal:
    """Where an axis ends, or how far it goes, as it is programmed, to six decimals.

    Parameters
    ----------
    rapids : Rapids
        The program's.
    move : int
        Which of them.
    axis : str
        Its letter.
    incremental : bool
        How far, instead of where.

    Returns
    -------
    Decimal
        In the program's unit; a diameter where the program has diameters.
    """
    end = _way(rapids, move, axis, incremental) / _scale(rapids, move, axis)
    return Decimal(repr(round(end, 6)))


def computed_end(rapids: Rapids, move: int, axis: str, incremental: bool) -> Decimal:
    """The same where the control rounds no number that it computes: to its last digit.

    Parameters
    ----------
    rapids, move, axis, incremental
        As of `programmed_end`.

    Returns
    -------
    Decimal
        Where it ends: a number that the control takes for the very double that it had computed. How
        far it goes: to twelve decimals, beyond which sums of increments are not certain either.
    """
    way, scale = _way(rapids, move, axis, incremental), _scale(rapids, move, axis)
    end = way / scale
    short = round(end, 6)
    if incremental:
        same = abs(end - short) * scale < NO_DIGIT
        return Decimal(repr(short if same else round(end, 12)))
    near = (short, end, math.nextafter(end, math.inf), math.nextafter(end, -math.inf))
    return Decimal(repr(next((number for number in near if number * scale == way), end)))


def _way(rapids: Rapids, move: int, axis: str, incremental: bool) -> float:
    """Where an axis ends, or how far it goes, in mm or degrees."""
    k = AXES.index(axis)
    start = float(rapids.start[move, k]) if incremental else 0.0
    return float(rapids.target[move, k]) - start


def _scale(rapids: Rapids, move: int, axis: str) -> float:
    """Of the numbers of an axis in the program, in mm or degrees."""
    unit = MM_PER_INCH if rapids.inch[move] and axis not in "ABC" else 1.0
    return unit * (0.5 if rapids.diameter[move] and axis == "X" else 1.0)


def plain(number: Decimal) -> bytes:
    """A number without exponent, with a decimal point, and never minus zero."""
    text = format(number if number else abs(number), "f")
    return (text if "." in text else text + ".").encode()
