"""O-words: what is known after a block of the program that may or may not have run.

Rule: nothing is executed. A body is read once, from a state in which nothing is known, only to
learn what it can change; afterwards exactly that is unknown. A subroutine's body changes nothing
where it stands, and a call may change everything.
"""

from __future__ import annotations

from collections import Counter

from gcodejerk.nc.interpreter.modal import State

_OPENS = {"sub": "endsub", "if": "endif", "while": "endwhile", "repeat": "endrepeat"}
_INNER = frozenset({"else", "elseif", "break", "continue", "return"})
_CLOSES = frozenset(_OPENS.values())


class Flow:
    """Follows the nesting of O-word blocks."""

    def __init__(self) -> None:
        self._before: State | None = None
        self._stack: list[tuple[str, str]] = []
        self._standing: Counter[tuple[str, str]] = Counter()
        """How often each is in the stack, which may be as deep as the file is long."""
        self._program_number = False
        self.leads_elsewhere = False
        """A program was called that is not followed."""

    @property
    def inside(self) -> bool:
        """Whether the current line may run any number of times."""
        return self._before is not None or self._program_number

    def apply(self, state: State, keyword: str, name: str, first: bool) -> State:
        """Pass one O-word line.

        Parameters
        ----------
        state : State
            In force before the line.
        keyword, name : str
            For example ``if`` and ``100``; an empty keyword is a bare number.
        first : bool
            Whether no block stands in front of it.

        Returns
        -------
        State
            In force after the line.
        """
        if keyword == "":
            # O1000 names a program; further on it begins a subprogram that M98 calls.
            if not first:
                self._program_number = True
                state.forget()
            return state
        if keyword == "while" and self._standing["do", name]:
            return self._close(state, "do", name)
        if keyword in _OPENS:
            return self._open(state, keyword, name)
        if keyword == "do":
            return self._open(state, "do", name)
        if keyword in _CLOSES:
            return self._close(state, keyword[3:], name)
        if keyword not in _INNER or self._before is None:
            # a call, a return from the main program, or something that we do not know
            self.leads_elsewhere = True
            state.forget()
            return state
        state.forget()
        return state

    def end_of_subprogram(self) -> None:
        """M99, M2 or M30 ends a numbered subprogram."""
        self._program_number = False

    def _open(self, state: State, keyword: str, name: str) -> State:
        self._stack.append((keyword, name))
        self._standing[keyword, name] += 1
        if self._before is None:
            self._before = state
            state = state.copy()
            state.touched = set()
        state.forget_silently()
        return state

    def _pop(self) -> None:
        """Leave the innermost block."""
        self._standing[self._stack.pop()] -= 1

    def _close(self, state: State, keyword: str, name: str) -> State:
        if not self._stack or self._stack[-1] != (keyword, name):
            # Not nested as the controller demands; it would refuse the program.
            state.forget()
            if not self._standing[keyword, name]:
                return state
            while self._stack[-1] != (keyword, name):
                self._pop()
        self._pop()
        if self._stack:
            state.forget_silently()
            return state
        before, touched = self._before, state.touched
        assert before is not None
        assert touched is not None
        self._before = None
        before.rotates |= state.rotates
        before.turns |= state.turns
        if keyword != "sub":
            before.forget_touched(touched)
            before.offsets = {k: v for k, v in before.offsets.items() if k in state.offsets}
        return before
