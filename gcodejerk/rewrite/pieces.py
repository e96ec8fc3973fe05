"""Pieces of a program's streams: what is needed to make some of them, and what comes of it.

A piece stands for itself: it holds the rows of its moves, of the rapids that stand right in front
of them, and their blocks. So it can be worked on in another process (`spread`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.emit import Controller, Options
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Rapids
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.independent_axes import path_deviation
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.stream import make_batch


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Some moves of a program, apart from it.

    Attributes
    ----------
    rows : ndarray of int, shape (k,)
        Which rapids of the program it holds, rising: its moves, and those in front of them.
    moves : ndarray of int, shape (b,)
        Its moves, counted within the piece.
    plans, rapids, number_format : Plans, Rapids, NumberFormat
        Of the k rapids; profiles of the moves alone.
    blocks : sequence of bytes
        The b blocks; none where no text is wanted.
    """

    rows: NDArray[np.int64]
    moves: NDArray[np.int64]
    plans: Plans
    rapids: Rapids
    number_format: NumberFormat
    blocks: Sequence[bytes]

    @classmethod
    def of(
        cls,
        moves: NDArray[np.int64],
        plans: Plans,
        rapids: Rapids,
        number_format: NumberFormat,
        blocks: Sequence[bytes],
        reason: NDArray[np.uint8],
    ) -> Piece:
        """Some moves, with the reasons that hold for those in front of them."""
        rows = np.union1d(moves, np.maximum(moves - 1, 0))
        places = np.searchsorted(rows, moves)
        own = np.zeros(len(rows), dtype=np.bool_)
        own[places] = True
        part = replace(plans.part(rows, own), reason=reason[rows])
        return cls(rows, places, part, rapids.part(rows), number_format.take(rows), blocks)

    def behind(self, reason: NDArray[np.uint8]) -> Piece:
        """The same with other reasons for the rapids in front of its moves."""
        reason = reason[self.rows]
        reason[self.moves] = self.plans.reason[self.moves]
        return replace(self, plans=replace(self.plans, reason=reason))


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """The streams of a piece.

    Attributes
    ----------
    moves : ndarray of int, shape (b,)
        Those of the piece's moves that have a stream, counted in the program.
    reason : ndarray of uint8
        Of all moves of the piece: CERTAIN, or why they have none.
    residual, conventional : ndarray, shape (b, m)
        As `Batch` has them. [mm]
    deviation : ndarray, shape (b,)
        How far each path is from the control's own. [mm]
    texts : list of bytes
        The b texts; none where they are not wanted.
    batch : Batch or None
        What the texts are to be made of, where they depend on the whole program.
    """

    moves: NDArray[np.int64]
    reason: NDArray[np.uint8]
    residual: Array
    conventional: Array
    deviation: Array
    texts: list[bytes]
    batch: Batch | None


@dataclass(frozen=True, slots=True, eq=False)
class Maker:
    """Makes the streams of pieces, and their texts where these do not depend on more."""

    emitter: Controller
    stride: int
    newline: bytes
    options: Options
    writes: bool

    def __call__(self, piece: Piece) -> Made:
        """Make those of a piece."""
        # Reasons are noted there; the piece may be made once more.
        plans = replace(piece.plans, reason=piece.plans.reason.copy())
        emitter, rapids = self.emitter, piece.rapids
        batch = make_batch(plans, piece.moves, piece.number_format, self.stride, emitter.play)
        apart = self.writes and emitter.apart
        texts: list[bytes] = []
        if apart and len(batch):
            at = np.searchsorted(piece.moves, batch.moves).tolist()
            blocks = [piece.blocks[k] for k in at]
            texts = emitter.render(batch, rapids, blocks, self.newline, self.options)
        return Made(
            moves=piece.rows[batch.moves],
            reason=plans.reason[piece.moves],
            residual=batch.residual,
            conventional=batch.conventional_residual,
            deviation=path_deviation(batch) if len(batch) else np.zeros(0),
            texts=texts,
            batch=batch if self.writes and not apart else None,
        )
