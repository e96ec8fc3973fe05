"""The proof of a program whose flow was written out, whatever language it is in."""

from __future__ import annotations

from typing import BinaryIO

from gcodejerk.nc import Dialect, Start, find_dialect
from gcodejerk.verification.findings import Findings, Verification
from gcodejerk.verification.second_reading.agreement import begin_tracker
from gcodejerk.verification.second_reading.reading import Text
from gcodejerk.verification.second_reading.tracking import Tracker
from gcodejerk.verification.unrolling.o_words import FlowProof
from gcodejerk.verification.unrolling.scripts import NotFollowedError, check_script

__all__ = ["NotFollowedError", "check_unrolling"]


def check_unrolling(
    original: BinaryIO,
    other: BinaryIO,
    *,
    dialect: str | Dialect = "linuxcnc",
    start: Start | None = None,
    names: tuple[str, str] = ("<original>", "<unrolled>"),
    most: int = 100,
) -> Verification:
    r"""Compare a program with the same program with its loops and calls written out.

    Parameters
    ----------
    original, other : BinaryIO
        Opened for reading bytes, at their beginning; small enough to be held.
    dialect : str or Dialect, optional
        How the original is written.
    start : Start, optional
        What it may assume.
    names : tuple of str, optional
        For messages.
    most : int, optional
        Violations after which it stops; the walk ends at the first one that it cannot pass.

    Returns
    -------
    Verification
        `rewritten` are structures that are written out, or 1 for a program as a whole.

    Raises
    ------
    NotFollowedError
        The second reading does not follow the program.

    Examples
    --------
    >>> import io
    >>> program = b"#1=0\no1 while [#1 LT 2]\nG0 X#1\n#1=[#1+1]\no1 endwhile\nM2\n"
    >>> written = b"#1=0\nG0 X#1\n#1=[#1+1]\nG0 X#1\n#1=[#1+1]\nM2\n"
    >>> check_unrolling(io.BytesIO(program), io.BytesIO(written)).ok
    True
    >>> once = b"#1=0\nG0 X#1\n#1=[#1+1]\nM2\n"
    >>> found = check_unrolling(io.BytesIO(program), io.BytesIO(once)).violations
    >>> found[0].line, found[0].problem
    (4, "expected 'G0 X#1' as the original runs, found 'M2'")
    """
    start = Start() if start is None else start
    found, chosen = Findings(most), find_dialect(dialect)
    data, result = original.read(), other.read()
    if chosen.text.o_word == "flow":
        proof = FlowProof(data, result, chosen, start, found)
        proof.run()
        return Verification(0, proof.written, proof.kept, found.sorted(), names)

    def begin(text: Text) -> Tracker:
        return begin_tracker(text, chosen.set_up(start), start)

    kept = check_script(data, result, chosen, start, begin, found)
    return Verification(0, 1, kept, found.sorted(), names)
