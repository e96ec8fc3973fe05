"""Programs of Siemens and macro B written out: run line by line, they move as the structure does.

`test_flow_drawn` draws structures and runs them in plain Python; here the text that was written out
is run by a few lines that know assignments and moves, and no flow at all.
"""

import io
import re

import pytest
from test_flow_drawn import SEEDS, STARTS, WRITERS, Control, Drawing, TooLongError

from gcodejerk.nc import CERTAIN, read_program
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.unrolling.unrolling import unroll
from gcodejerk.verification.unrolling.checking import check_unrolling


def run(text):
    """Where each move of a program without flow leads."""
    values, at, incremental, found = {}, [0.0] * 3, False, []

    for line in text.split("\n"):
        bare = re.sub(r"\(.*?\)|;.*", "", line) if "=" not in line else line.split(";")[0]
        bare = re.sub(r"^\s*N\d+\s*", "", bare).strip()
        if bare[:1] in ("%", "O", "") or bare.startswith(("DEF", "PROC")):
            continue
        match = re.fullmatch(r"#?([A-Z_]*\d*|R\[\d+\])=(.*)", bare)
        if match and match[1] not in ("X", "Y", "Z"):
            values[match[1].replace("[", "").replace("]", "")] = _value(match[2], values)
            continue
        if re.search("G9[01]", bare):
            incremental = "G91" in bare
        words = [match for word in bare.split() if (match := re.fullmatch("([XYZ])=?(.+)", word))]
        for word in words:
            k = "XYZ".index(word[1])
            at[k] = _value(word[2], values) + (at[k] if incremental else 0.0)
        if words:
            found.append(tuple(at))
        if re.search(r"M(30|0?2|17)$", bare):
            break
    return found


def _value(expression, values):
    """An expression of numbers, variables, plus, minus, times."""
    expression = re.sub(r"R\[([^\]]*)\]", lambda m: f"R{int(_value(m[1], values))}", expression)
    python = expression.replace("[", "(").replace("]", ")")
    python = re.sub(r"#(\d+)|([A-Z_]+\d*)", lambda m: f"values[{(m[1] or m[2])!r}]", python)
    return float(eval(python, {"values": values}))


def drawn(seed, dialect, writer, hidden=False):
    """A program, and where its moves lead; None where it is endless, or nearly."""
    drawing = Drawing(seed, hidden=hidden)
    programs, written = drawing.file(), writer()
    data = written.file(programs)
    control = Control(programs, written.places, (0.0, 0.0), dialect == "siemens")
    try:
        control.body(programs[""])
    except TooLongError:
        return None
    return data, [after for _, _, after, _ in control.passes]


def written_out(data, dialect, comments=True):
    target = io.BytesIO()
    start = STARTS[dialect]
    found = unroll(io.BytesIO(data), target, dialect=dialect, start=start, comments=comments)
    if not found.written:
        return None, found
    result = target.getvalue()
    checked = check_unrolling(io.BytesIO(data), io.BytesIO(result), dialect=dialect, start=start)
    assert checked.ok, (checked.violations, data.decode(), result.decode())
    return result, found


@pytest.mark.parametrize(("dialect", "writer"), WRITERS[:3])
def test_what_is_written_out_moves_as_the_structure_does(dialect, writer):
    count = 0
    for seed in SEEDS:
        if (made := drawn(seed, dialect, writer)) is None:
            continue
        data, moves = made
        result, found = written_out(data, dialect, comments=bool(seed % 2))
        if result is None:
            assert not found.structures, (found.findings, data.decode())
            continue
        assert run(result.decode()) == [pytest.approx(at) for at in moves], result.decode()
        rapids = read_program(io.BytesIO(result), dialect=dialect, start=STARTS[dialect]).rapids
        # Subprograms that were drawn and never called stay behind the main program.
        main = rapids.line <= result.partition(b"M30")[0].count(b"\n")
        left = {str(REASONS[r]) for r in rapids.reason[main] if r != CERTAIN}
        assert str(Reason.SUBPROGRAM) not in left, result.decode()
        count += 1
    assert count > len(SEEDS) // 2
