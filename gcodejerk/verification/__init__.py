"""Proof that a processed program is the original with only its rapids re-timed.

It reads both files from their bytes, with means of its own: how a stream was planned or written
it does not know and cannot ask (`tests/unit/test_layers.py`). What it shares with the writing
side is `nc`, which says where the rapids are and what is in force there; and that is not taken on
trust: a second reader (`second_reading`), which shares nothing with `nc` but the dialects' tables,
has to agree wherever it knows.

    verify(original, processed, machine)       -> Verification
    require(verification)                      raises VerifyError unless it is all right

What is checked where: `bytes` (every other byte is kept, the lines of a stream hold what they may,
modal values are restored), `physics` (exact ends, straight, never backwards, duration and limits,
F words, no more vibration than the controller's own rapid leaves), `second_reading` (where the
tool is and what is in force), `cycles` (drilling cycles written out), `table` (controller `csv`).
"""

from gcodejerk.verification.findings import Kind, Verification, Violation, require
from gcodejerk.verification.proof import verify, verify_files

__all__ = [
    "Kind",
    "Verification",
    "Violation",
    "require",
    "verify",
    "verify_files",
]
