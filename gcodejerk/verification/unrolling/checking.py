"""The proof of a program whose flow was written out, whatever language it is in."""

from __future__ import annotations

from typing import BinaryIO

from gcodejerk.nc import Dialect, Start, find_dialect
from gcodejerk.verification.findings import Findings, Verification
from gcodejerk.verification.unrolling.o_words import FlowProof


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
        `rewritten` are structures that are written out.

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
    found = Findings(most)
    proof = FlowProof(original.read(), other.read(), find_dialect(dialect), start, found)
    proof.run()
    return Verification(0, proof.written, proof.kept, found.sorted(), names)
