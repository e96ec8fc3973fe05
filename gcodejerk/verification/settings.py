"""A program that sets its control (`process --as parameters`), held against its original.

It is recognised by the comment below the stamp, which names the control. Every line that the
original does not have is one of the forms of `bytes.settings_form`; where they have to stand is
found by a reading of the original of its own, and what has to be restored is computed from the
machine file.

Rule: the original leads. Between two of its lines stands exactly what has to stand there: nothing,
the lines that set, those that take it back, or first those and then these.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import BinaryIO

from gcodejerk.machine import Axis, Machine
from gcodejerk.nc import Dialect, Program
from gcodejerk.verification.bytes.settings_form import CONTROLS, PATH, Control, Key, Values
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.findings import Findings, Kind

WITHIN = 1 << 17
"""What is farther from the top is no such comment. [bytes]"""
_NOTE = re.compile(
    rb"^[(;] ?gcodejerk settings for ([a-z0-9-]+): [ -~]{1,40}?\)?\r?$", re.MULTILINE
)
_STAMP = re.compile(rb"[(;] ?gcodejerk stamp [ -~]{1,80}")


def settings_note(processed: BinaryIO) -> str | None:
    """The control that a processed program sets; None where it sets none. Back where it stood."""
    at = processed.tell()
    match = _NOTE.search(processed.read(WITHIN))
    processed.seek(at)
    return None if match is None else match[1].decode()


def check_settings(
    original: Window,
    processed: Window,
    program: Program,
    machine: Machine,
    name: str,
    found: Findings,
) -> tuple[int, int]:
    """Compare a program that sets its control with its original.

    Parameters
    ----------
    original, processed : Window
        At their beginning.
    program : Program
        The original, as it was read.
    machine : Machine
        Limits, today's rapids, and what its owner states.
    name : str
        The control, of `settings_note`.
    found : Findings
        Takes the violations.

    Returns
    -------
    kept, places : int
        Lines of the original; places at which lines were inserted.
    """
    control = CONTROLS.get(name)
    if control is None or machine.controller != name:
        said = "is not known here" if control is None else f"is not {machine.controller}"
        found.add(Kind.STAMP, None, None, f"the program sets control {name}, which {said}")
        return 0, 0
    return _Walk(original, processed, program, machine, control, found).run()


class _Walk:
    """One walk through both files."""

    def __init__(
        self,
        original: Window,
        processed: Window,
        program: Program,
        machine: Machine,
        control: Control,
        found: Findings,
    ) -> None:
        self.original, self.processed = original, processed
        self.program, self.machine, self.control, self.found = program, machine, control, found
        self.dialect = program.language
        self.newline = program.newline
        self.prefix: list[bytes] = []
        self.restore: list[bytes] = []
        self.at = self.kept = self.places = 0
        self.open = False
        """The last line that was kept had no end in the original."""
        self.begun = False
        """A block stands in front of the stamp."""
        self.values: Values = {}

    def run(self) -> tuple[int, int]:
        """Walk to the end of both."""
        if self._top():
            for line, needed in _needs(
                self.original, self.dialect, self.begun, self.control.several
            ):
                if not self._stands(needed) or (line and not self._keep(line)):
                    return self.kept, self.places
            if not self.processed.ended:
                self._complain(Kind.ADDED, "the original ends, here follows more")
            claimed, sum_found = self.processed.claimed, self.processed.sum
            if claimed not in (None, sum_found) and not self.found.violations:
                self._complain(
                    Kind.STAMP,
                    f"the file was changed after it was written: its sum is {sum_found}, the "
                    f"stamp says {claimed}",
                )
        return self.kept, self.places

    def _complain(self, kind: Kind, problem: str) -> None:
        line = None if self.original.ended else self.original.line
        self.found.add(kind, self.processed.line, line, problem)

    def _top(self) -> bool:
        """What stands in front of the stamp, the stamp, and the lines that set."""
        head = self.original.take(self.program.insert_at)
        if self.processed.take(len(head)) != head:
            self._complain(Kind.CHANGED, "what stands in front of the stamp was changed")
            return False
        self.kept += head.count(b"\n")
        codes = [_code(line, self.dialect) for line in head.splitlines()]
        self.begun = any(code and not code.startswith(b"%") for code in codes)
        stamp, note = self._taken(), self._taken()
        if stamp is None or note is None or not (_STAMP.match(stamp) and _NOTE.match(note)):
            self._complain(Kind.STAMP, "the stamp and its second line stand elsewhere")
            return False
        # A setting that stands again is the first of those that take it back.
        while (found := self._form(self.processed.peek_line())) is not None:
            if set(found) & set(self.values):
                break
            line = self._taken()
            if line is None:
                return False
            self.prefix.append(line)
            self.values |= found
        self.places = 1
        return self._judge_prefix()

    def _taken(self) -> bytes | None:
        """The next line of the processed file without its end, which is as the original's are."""
        line = self.processed.peek_line()
        body = line.rstrip(b"\r\n")
        if line[len(body) :] != self.newline:
            self._complain(Kind.LINE_END, "an inserted line does not end as those of the original")
            return None
        self.processed.skip(len(line))
        return body

    def _form(self, line: bytes) -> Values | None:
        """What a line sets; None where it is of no form."""
        body = line.rstrip(b"\r\n")
        for pattern, values in self.control.forms:
            match = pattern.fullmatch(body)
            if match:
                return values(match) or None
        return None

    def _judge_prefix(self) -> bool:
        """Whether the settings are within the machine's limits."""
        if not self.values:
            self._complain(Kind.SETTING, "no line sets anything")
            return False
        before = len(self.found.violations)
        for problem in _beyond(self.values, self.control, self.machine):
            self._complain(Kind.SETTING, problem)
        return len(self.found.violations) == before

    def _judge_restore(self, lines: list[bytes]) -> bool:
        """The lines that take it back: the same settings, as the machine file has them."""
        values: Values = {}
        for line in lines:
            one = self._form(line) or {}
            if not one or set(one) & set(values):
                return self._no(
                    f"'{line[:60].decode('latin-1')}' is no line that takes settings back"
                )
            values |= one
        control = self.control
        mine = {key for key in self.values if key[0] not in (control.frequency, control.damping)}
        theirs = {key for key in values if key[0] not in (control.frequency, control.damping)}
        if mine != theirs:
            names = ", ".join(" ".join(key).strip() for key in sorted(mine ^ theirs))
            return self._no(f"what is set is not what is taken back: {names}")
        for key, text in values.items():
            wanted = _old(key, control, self.machine)
            if wanted is None:
                return self._no(f"{' '.join(key).strip()}: the machine file does not state the old")
            if not _same(text, wanted):
                return self._no(f"{' '.join(key).strip()} goes back to {text}, it was {wanted}")
        return True

    def _no(self, problem: str) -> bool:
        self._complain(Kind.SETTING, problem)
        return False

    def _stands(self, needed: str) -> bool:
        """Whether what is needed stands here; it is passed."""
        for what in needed:
            lines = self.prefix if what == SETS else self.restore
            if what == BACK and not lines:
                if not self._read_restore():
                    return False
            elif not self._pass(lines):
                return False
            self.places += 1
        return True

    def _read_restore(self) -> bool:
        """The first lines that take settings back: all others have to be the same."""
        lines: list[bytes] = []
        for _ in self.prefix:
            line = self._next()
            if line is None:
                return False
            lines.append(line)
        self.restore = lines
        return self._judge_restore(lines)

    def _pass(self, lines: list[bytes]) -> bool:
        for wanted in lines:
            line = self._next()
            if line is None:
                return False
            if line != wanted:
                shown = [x[:60].decode("latin-1") for x in (wanted, line)]
                return self._no(f"expected '{shown[0]}', found '{shown[1]}'")
        return True

    def _next(self) -> bytes | None:
        """The next inserted line, whose end is that of the file where the original has none."""
        if self.open:
            if self.processed.peek(len(self.newline)) != self.newline:
                self._complain(Kind.SETTING, "lines that take settings back are missing")
                return None
            self.processed.skip(len(self.newline))
            line = self.processed.peek_line()
            body = line.rstrip(b"\r\n")
            self.processed.skip(len(body))
            return body
        if self._form(self.processed.peek_line()) is None:
            shown = self.processed.peek_line()[:60].rstrip(b"\r\n").decode("latin-1")
            self._complain(Kind.SETTING, f"a line with settings is missing in front of '{shown}'")
            return None
        return self._taken()

    def _keep(self, line: bytes) -> bool:
        """Pass a line of the original."""
        if self.processed.peek(len(line)) != line:
            shown = [
                x[:60].rstrip(b"\r\n").decode("latin-1") for x in (line, self.processed.peek_line())
            ]
            added = self._form(self.processed.peek_line()) is not None
            kind = Kind.SETTING if added else Kind.CHANGED
            self._complain(kind, f"expected '{shown[0]}' as in the original, found '{shown[1]}'")
            return False
        self.processed.skip(len(line))
        self.open = not line.endswith(b"\n")
        self.kept += 1
        return True


SETS, BACK = "s", "b"
_M = re.compile(rb"M0*([0-9]+)(?:\.0*)?(?![0-9.])")
_FIRST = re.compile(rb"(?:N\s*[0-9]+\s*)?([GM])\s*0*([0-9]+)(?![0-9.])")
_WAITS = (0, 1, 25, 226, 600, 601)
_SAYS = (117, 118)
"""M codes that show the rest of their line."""


def _needs(
    original: Window, dialect: Dialect, begun: bool, several: bool
) -> Iterator[tuple[bytes, str]]:
    """The lines of the original, and what has to stand in front of each; at last an empty one.

    `several`: all commands of a line run.
    """
    pending, ended = "", False
    while not original.ended:
        line = original.peek_line()
        code = _code(line, dialect)
        needed, behind = pending, ""
        closing = not dialect.one_command and code.startswith(b"%")
        if not ended and closing and begun:
            needed, ended = needed + BACK, True
        elif not ended and not closing:
            stop, end = _stops(code, dialect, several)
            if stop or end:
                needed += BACK
                ended = end and not code.startswith(b"/")
                behind = "" if ended else SETS
            begun |= bool(code)
        yield line, needed
        original.skip(len(line))
        pending = behind
    yield b"", pending if ended else pending + BACK


def _code(line: bytes, dialect: Dialect) -> bytes:
    """A line in capitals, without comments, texts in quotes, blanks and a checksum."""
    text = dialect.text
    line = line.removeprefix(b"\xef\xbb\xbf").upper()
    line = re.sub(rb'"[^"\r\n]*"?', b"", line)
    if text.parentheses != "code":
        line = re.sub(rb"\([^()\r\n]*\)", b" ", line)
        if text.parentheses == "open comment":
            line = line.partition(b"(")[0]
    if text.semicolon != "error":
        line = line.partition(b";")[0]
    if text.names or dialect.one_command:
        return line.strip()
    return bytes(byte for byte in line if byte not in b" \t\r\n\v\f\x11\x13")


def _stops(code: bytes, dialect: Dialect, several: bool) -> tuple[bool, bool]:
    """Whether a line stops a program, and whether it ends it."""
    ends = not dialect.one_command and bool({int(n) for n in _M.findall(code)} & {2, 30})
    if dialect.one_command or several:
        first = _FIRST.match(code)
        if several and not (first and first[1] == b"M" and int(first[2]) in _SAYS):
            numbers = re.findall(rb"M\s*0*([0-9]+)(?![0-9.])", code)
            return not {int(number) for number in numbers}.isdisjoint(_WAITS), ends
        if first is None:
            return re.match(rb"(?:N[0-9]+\s*)?PAUSE(?![A-Z0-9_])", code) is not None, ends
        return first[1] == b"M" and int(first[2]) in _WAITS, ends
    codes = {int(number) for number in _M.findall(code)}
    return bool(codes & {0, 1}), ends


def _old(key: Key, control: Control, machine: Machine) -> str | None:
    """What a setting was before, as far as the machine file or the control's manual says."""
    number, axis = key
    for one in machine.controller_parameters:
        if one.number == number and one.axis in (None, axis or None) and one.old is not None:
            return one.old
    if number in ("G231", "G233"):
        return "100"
    if number and number == control.acceleration:
        own = [a.rapid.acceleration for a in _moved(control, machine, axis)]
        along = machine.path.rapid.acceleration
        if axis == PATH and math.isfinite(along):
            return f"{along:.0f}"
        return f"{min(own) if control.shared else max(own):.0f}"
    return None


def _moved(control: Control, machine: Machine, axis: str) -> list[Axis]:
    """The axes that an acceleration is of: its own, or all; Klipper's Z has another."""
    if control.shared:
        sharing = [a for a in machine.axes if not a.rotary and a.name != "Z"]
        return sharing or list(machine.axes)
    return [a for a in machine.axes if axis in (PATH, a.name)]


def _same(text: str, wanted: str) -> bool:
    """Whether two texts are the same number or word; a shaper may be off by several names."""
    try:
        return abs(float(text) - float(wanted)) <= 1e-9 * max(1.0, abs(float(wanted)))
    except ValueError:
        off = {"off", "none", "0"}
        return text == wanted or (text in off and wanted.lower() in off)


def _beyond(values: Values, control: Control, machine: Machine) -> list[str]:
    """What is beyond the machine's limits, or no number of its kind."""
    names = {axis.name for axis in machine.axes}
    out = []
    for (number, axis), text in values.items():
        if axis and axis not in names:
            out.append(f"{number} {axis}: the machine has no such axis")
        elif problem := _impossible(number, axis, text, control, machine):
            out.append(f"{number} {axis}= {text} {problem}")
    return out + _percentages_beyond(values, machine)


def _impossible(
    number: str, axis: str, text: str, control: Control, machine: Machine
) -> str | None:
    """Why a setting cannot have a value; None where it can."""
    if not number:
        return None
    if number == control.acceleration:
        moved = _moved(control, machine, axis)
        own = [max(a.limit.acceleration, a.rapid.acceleration) for a in moved]
        most = min(own) if control.shared else max(own)
        path = max(machine.path.limit.acceleration, machine.path.rapid.acceleration)
        most = path if axis == PATH and math.isfinite(path) else most
        if not 0.0 < float(text) <= most + 1.0:
            return f"is beyond the acceleration limit {most:g}"
    elif number == control.frequency and not 0.1 <= float(text) <= 1000.0:
        return "is no frequency of a shaper"
    elif number == control.damping and not 0.0 <= float(text) < 1.0:
        return "is no damping ratio"
    return None


def _percentages_beyond(values: Values, machine: Machine) -> list[str]:
    """Axes that G231 and G233, percentages of today's acceleration and of its ramp, overload."""
    if ("G231", PATH) not in values or ("G233", PATH) not in values:
        return []
    acceleration, ramp = (float(values[(g, PATH)]) / 100.0 for g in ("G231", "G233"))
    if not (acceleration > 0.0 and ramp > 0.0):
        return ["G231 or G233 is 0"]
    return [
        f"axis {axis.name}: {what} {share * now:g} is beyond {max(now, most):g}"
        for axis in machine.axes
        for what, share, now, most in (
            ("acceleration", acceleration, axis.rapid.acceleration, axis.limit.acceleration),
            ("jerk", acceleration / ramp, axis.rapid.jerk, axis.limit.jerk),
        )
        if share * now > max(now, most) * (1.0 + 1e-6)
    ]
