"""How far a study is: steps that follow each other, each named as it begins.

Rule: what a step does is not told on the way, where it does not know it: a search does not know how
often it has to look.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import accumulate

Progress = Callable[[str, int, int], None]
"""Takes what is done, how much of the work is done, and how much there is."""


class Steps:
    """The steps of one study.

    Examples
    --------
    >>> told = Steps(print, {"searching": 3, "judging": 10})
    >>> told("searching")
    searching 0 13
    >>> told("judging", 0.5)
    judging 8 13
    """

    def __init__(self, progress: Progress | None, work: Mapping[str, int]) -> None:
        """`work`: of each step in their order, about how much there is."""
        self.progress, self.work = progress, work
        self.begun = dict(zip(work, accumulate(work.values(), initial=0), strict=False))

    def __call__(self, step: str, share: float = 0.0) -> None:
        """A step begins, or a share of it is done."""
        if self.progress is not None:
            done = self.begun[step] + int(share * self.work[step])
            self.progress(step, done, sum(self.work.values()))
