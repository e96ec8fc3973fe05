"""A reader that looks at the whole file before it runs it, where its flow can be followed.

Rule: what cannot be followed whole is read as `Reader` reads it, line after line, and everything
that jumps may lead to is forgotten.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import BinaryIO

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.elsewhere import Elsewhere
from gcodejerk.nc.flow.following import Follower
from gcodejerk.nc.flow.labels import label_script
from gcodejerk.nc.flow.macro_b import NotFollowedError, macro_script
from gcodejerk.nc.flow.named import named_script
from gcodejerk.nc.flow.o_words import Passes
from gcodejerk.nc.flow.script import Script
from gcodejerk.nc.flow.subprograms import Calls
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.runner import Finding, Runner
from gcodejerk.nc.reader import Reader
from gcodejerk.nc.text.block import Line
from gcodejerk.start import Start

MOST_BYTES = 4_000_000
"""Of a file that is followed; a larger one is read line after line."""
_NAMED = re.compile(
    rb"(?<![A-Z0-9_])(?:GOTO[FBC]?|FOR|WHILE|LOOP|REPEATB?|IF|PROC)(?![A-Z0-9_])|%_N_"
)
_NAMES = (b"GOTO", b"FOR", b"WHILE", b"LOOP", b"REPEAT", b"IF", b"PROC", b"%_N_")
"""One of them stands where it matches: to look for texts is ten times as quick."""
_BY_NUMBER = re.compile(
    rb"(?<![A-Z0-9_])REPEATB?[ \t]+(?:[A-Z_][A-Z0-9_]*[ \t]+)?N?[0-9]+(?![A-Z0-9_=])", re.IGNORECASE
)
"""``REPEATB N10``: of a stream only its first block bears the number."""
_LABEL = re.compile(rb"(?<![A-Z0-9_])LBL(?![A-Z0-9_])")
_G98 = re.compile(rb"G[ \t]*98(?![0-9.])")
_MACRO = re.compile(rb"GOTO|WHILE|DO[ \t]*[0-9]|G[ \t]*65(?![0-9.])|IF[ \t]*\[")


def worth_following(file: BinaryIO, dialect: Dialect) -> bool:
    """Whether a file has flow that can be followed; it stands where it stood."""
    names: tuple[bytes, ...] = (b"",)
    if dialect.text.variables == "R" and dialect.text.names:
        pattern, names = _NAMED, _NAMES
    elif dialect.text.keywords and dialect.text.o_word == "program":
        pattern = _MACRO
    elif dialect.text.variables == "Q":
        pattern, names = (_LABEL, (b"LBL",)) if dialect.text.klartext else (_G98, names)
    else:
        return False
    begin = file.tell()
    data = file.read(MOST_BYTES + 1)
    file.seek(begin)
    if len(data) > MOST_BYTES:
        return False
    said = data.upper()
    return any(name in said for name in names) and pattern.search(said) is not None


class FollowingReader(Reader):
    """Collects the lines of a file, and runs them when it is complete."""

    def __init__(
        self,
        name: str,
        dialect: Dialect,
        start: Start,
        calls: Callable[[Runner], Calls] | None,
        elsewhere: Elsewhere,
    ) -> None:
        super().__init__(name, dialect, start)
        self._elsewhere = elsewhere
        self._start, self._make_calls = start, calls
        self._kept: list[tuple[Line, bool]] = []
        """Lines, and whether each is the first block."""
        self._behind: list[tuple[Line, bool]] = []
        """The same behind a closing ``%``."""
        self._closed = False

    @property
    def used(self) -> tuple[str, ...]:
        """Files in which subprograms were found."""
        return tuple(self._elsewhere.files)

    @property
    def collecting(self) -> bool:
        """Whether lines wait to be run."""
        return True

    def can_run(self) -> bool:
        """Lines are run when the file is complete."""
        return False

    def _run(self, line: Line, first: bool = False) -> None:
        (self._behind if self._closed else self._kept).append((line, first))

    def _percent(self, line: Line) -> None:
        named = self.dialect.text.percent == "named"
        if not named and (self.percent is not None or self.blocks):
            self._closed = True
        if self.percent is None and not self.blocks:
            self.percent, self.insert_at, self.started = line.number, line.end, True
            if any(word.letter == "G" for word in line.block.words):
                self._count(line)  # %PART G71 of Heidenhain
        self._run(line)

    def finish(self) -> None:
        """Run everything, without what stands in other files where it cannot be followed."""
        observe = self.runner.observe
        said = (list(self.runner.syntax_problems), self.runner.problem_count)
        ways = [self._elsewhere, Elsewhere()] if self._elsewhere.lines else [self._elsewhere]
        for self._elsewhere in ways:
            self.runner.elsewhere = self._elsewhere.places
            try:
                self._follow_observed(observe)
                break
            except NotFollowedError:
                runner = self.runner = Runner(self.name, self.dialect, self._start)
                runner.syntax_problems, runner.problem_count = list(said[0]), said[1]
                runner.observe = observe
                self.passes = Passes(runner)
        else:
            if self._make_calls is not None:
                self.refer(self._make_calls(self.runner))
            self._replay_all()
        self._finish_log()

    def _follow_observed(self, observe: Callable[[Line, State], None] | None) -> None:
        """Run the file as a script, and tell what is seen when it is certain that it could be."""
        if observe is None:
            self._follow()
            return
        # What is seen before the file is given up is not what happens on every pass.
        passed: list[tuple[Line, State]] = []
        self.runner.observe = lambda line, state: passed.append((line, state.copy()))
        spoiled = self._follow()
        for line, state in passed:
            lost = any(first <= line.number <= last for first, last in spoiled)
            observe(line, State() if lost else state)

    def script(self) -> Script:
        """The file with what it calls in others, as a script.

        Raises
        ------
        NotFollowedError
        """
        lines, more = [line for line, _ in self._kept], self._elsewhere.lines
        if self.dialect.text.names:
            return named_script([*lines, *more])
        if self.dialect.text.variables == "Q":
            return label_script(lines, self.dialect)
        own = [line for line in lines if not line.block.percent]
        return macro_script([*own, *more], self.dialect)

    def _follow(self) -> list[tuple[int, int]]:
        """Run the file as a script; lines of which not every pass is known."""
        lines = [line for line, _ in self._kept]
        script, runner = self.script(), self.runner
        follower = Follower(runner, script)
        follower.follow()
        if follower.ended is not None:
            runner.state = follower.ended
        runner.enter_unreached(line for line in lines if not line.block.percent)
        if self._behind or follower.ended is not None:
            runner.executor.end()
        for line, _ in self._behind:
            if not line.block.percent and line.block.o_word is None:
                runner.run(line)
        return follower.spoiled

    def _replay_all(self) -> None:
        """Take all lines one by one."""
        self.percent = None
        lines = (line for line, _ in self._kept)
        repeated = (line.number for line in lines if _BY_NUMBER.search(line.text))
        if self.dialect.text.names and (number := next(repeated, None)) is not None:
            state = self.runner.state
            state.put("bars", {**state.bars, "unknown code": True})
            told = "it repeats blocks by their numbers: not followed, nothing is rewritten"
            self.runner.syntax_problems.append(Finding(number, told))
        blocks, started, insert_at = self.blocks, self.started, self.insert_at
        self.blocks, self.started = 0, False
        for line, first in [*self._kept, *self._behind]:
            if line.block.percent:
                super()._percent(line)
            else:
                self.blocks, self.started = blocks, True
                super()._run(line, first)
        self.blocks, self.started, self.insert_at = blocks, started, insert_at
        if self.calls is not None:
            self.calls.finish()
