"""What a program for `linuxcnc-hal` may not say itself, since the form says it.

Both forms ask for rapids by `motion.analog-out-03` (M67, M68 E3), and HAL answers with
`motion.digital-in-03` (M66 P3). The form `adaptive-feed` scales every stream, which M52 P0 ends.
The form `position` waits with M66, whose answer is #5399.

Rule: a program that says one of these, or may say it by a computed number, is refused by its line.
"""

from __future__ import annotations

import re
from typing import BinaryIO

from gcodejerk.emit.guard import ANSWER, INSTEAD, lines_of_code, plain_numbers
from gcodejerk.errors import EmitError, Place

ADAPTIVE, POSITION = "adaptive-feed", "position"
_THREE = rb"(?:3(?![0-9])|[^0-9])"
"""The number 3, or what is computed."""
_BOTH = (
    (re.compile(rb"M6[78](?![0-9]).*E" + _THREE + rb"|E" + _THREE + rb".*M6[78](?![0-9])"),
     "M67 or M68 E3 asks for a rapid"),
    (re.compile(rb"M66(?![0-9]).*P" + _THREE + rb"|P" + _THREE + rb".*M66(?![0-9])"),
     "M66 P3 reads whether a rapid was played"),
    (re.compile(rb"M[\[#]"), "an M code is computed, M67 or M68 perhaps"),
)  # fmt: skip
_TAKEN = {
    ADAPTIVE: (*_BOTH, (re.compile(rb"M52(?![0-9])"), "M52 acts on every stream of this form")),
    POSITION: (*_BOTH, *ANSWER),
}
_HELP = {
    ADAPTIVE: "take it out, or process with --controller linuxcnc",
    POSITION: "process with --as adaptive-feed, which does not use #5399, or --controller linuxcnc",
}


def check_words(source: BinaryIO, name: str, form: str) -> None:
    """Refuse programs that say what the form says.

    Parameters
    ----------
    source : binary file
        The program.
    name : str
        Its name.
    form : str
        `adaptive-feed` or `position`.

    Raises
    ------
    EmitError
        At the first such line.
    """
    for number, code in lines_of_code(source):
        plain = plain_numbers(code)
        for pattern, problem in _TAKEN[form]:
            if pattern.search(plain):
                taken = (pattern, problem) in _BOTH
                raise EmitError(
                    f"{problem}: no stream of linuxcnc-hal can stand in this program",
                    INSTEAD.get((pattern, problem), "") + _HELP[ADAPTIVE if taken else form],
                    Place(name, number),
                )
