"""What a program does beside its moves, and what else its file holds, once its flow is written out.

For each: what the writer does now, and that the proof refuses what would do something else.
"""

import io

import pytest

from gcodejerk.start import Start
from gcodejerk.unrolling.unrolling import unroll
from gcodejerk.verification.unrolling.checking import NotFollowedError, check_unrolling

HEAD = "%\nO1\nG21 G90 G94 G17 G40 G49 G80 F100.\nG0 X0. Y0. Z9.\n"
SIEMENS = "%_N_MAIN_MPF\nG71 G90 G94\nG0 X0 Y0 Z9\n"
FILES = Start(subprograms={"s.ngc": b"o<s> sub\nG0 X[#<_call_level>+1]\no<s> endsub\nM2\n"})
NONE = Start(decimal_point="calculator")


def out(text, dialect, start=NONE):
    """What is written; what was left alone, and why; the proof agrees with all that is written."""
    target = io.BytesIO()
    found = unroll(io.BytesIO(text.encode()), target, dialect=dialect, start=start, comments=False)
    written = target.getvalue().decode()
    if written:
        assert not problems(text, written, dialect, start)
    return written, [finding.message for finding in found.findings]


def problems(text, written, dialect, start=NONE):
    """What the proof has against a program that was written out."""
    checked = check_unrolling(
        io.BytesIO(text.encode()), io.BytesIO(written.encode()), dialect=dialect, start=start
    )
    return [violation.problem for violation in checked.violations]


def test_a_file_that_reads_how_deep_it_was_called_stays():
    text = "G21 G90 G64\no<s> call\nG0 X1\nM2\n"
    written, why = out(text, "linuxcnc", FILES)
    assert not written
    assert "reads #<_call_level>" in why[0]
    told = problems(text, "G21 G90 G64\nG0 X[#<_call_level>+1]\nG0 X1\nM2\n", "linuxcnc", FILES)
    assert "a line reads where in the flow it is" in told[0]


def test_what_an_abort_shows_is_the_number_of_the_subprogram():
    text = "G21 G90\no1 sub\n(ABORT,bad #1)\no1 endsub\no1 call [3]\nM2\n"
    written, _ = out(text, "linuxcnc")
    assert "(ABORT,bad 3.000000)" in written
    assert problems(text, "G21 G90\n(ABORT,bad #1)\nM2\n", "linuxcnc")


@pytest.mark.parametrize("dialect", ["fanuc", "haas"])
@pytest.mark.parametrize(
    "block", ["G98 G81 X1. Z-3. R2. {}#1", "G4 P#1", "G82 X1. Z-3. R2. P#1", "G89 X1. R2. Z0. P#1"]
)
def test_counts_and_dwells_that_are_computed_stay(dialect, block):
    block = block.format("K" if dialect == "fanuc" else "L")
    text = HEAD + f"G65 P100 A3.\nM30\nO100\n{block}\nG80\nM99\n%\n"
    written, why = out(text, dialect)
    assert not written
    assert "is not certain here" in why[0]
    for number in ("3", "3."):
        told = problems(text, HEAD + block.replace("#1", number) + "\nG80\nM30\n%\n", dialect)
        assert "what a computed" in told[0]


def test_what_the_operator_reads_stands_behind_a_condition_too():
    text = (
        HEAD
        + "#1=0\nWHILE[#1LT2]DO1\nIF[#1EQ1]THEN #3006=1 (TURN THE PART)\n#1=#1+1\nEND1\nM30\n%\n"
    )
    written, _ = out(text, "fanuc")
    assert "#3006=1 (TURN THE PART)\n" in written
    silent = written.replace(" (TURN THE PART)", "")
    assert "expected" in problems(text, silent, "fanuc")[0]


@pytest.mark.parametrize("second", ["O2\nG0 X5.\nM30\n", "O100\nG0 X5.\nM99\n"])
def test_a_program_that_nothing_here_calls_is_kept(second):
    text = HEAD + "M98 P50\nM30\nO50\nG0 X1.\nM99\n" + second + "%\n"
    written, _ = out(text, "fanuc")
    assert "G0 X1.\nM30\nO50\nG0 X1.\nM99\n" + second + "%\n" in written
    told = problems(text, HEAD + "G0 X1.\nM30\n%\n", "fanuc")
    assert told == ["a program is left out that nothing here has called"]


def test_a_subprogram_of_siemens_that_nothing_calls_is_kept():
    text = SIEMENS + "SUB1\nM30\n%_N_SUB1_SPF\nG0 X1\nM17\n%_N_SUB2_SPF\nG0 X2\nM17\n"
    written, _ = out(text, "siemens")
    assert written.endswith("G0 X1\nM30\n%_N_SUB1_SPF\nG0 X1\nM17\n%_N_SUB2_SPF\nG0 X2\nM17\n")


@pytest.mark.parametrize("end", ["M30", "M2", 'RET("BACK")'])
def test_a_subprogram_of_siemens_that_may_end_elsewhere_stays(end):
    text = SIEMENS + f"SUB1\nG0 X5\nBACK: G0 X6\nM30\n%_N_SUB1_SPF\nG0 X1\n{end}\n"
    written, why = out(text, "siemens")
    assert not written
    assert "not followed" in why[0]
    with pytest.raises(NotFollowedError):
        problems(text, SIEMENS + f"G0 X1\n{end}\n", "siemens")


@pytest.mark.parametrize("number", ["1/0", "1e3", "SQRT[-#1]", "#<never set>", "#5420"])
def test_a_number_that_may_be_an_error_is_not_left_out(number):
    text = f"G21 G90\no1 sub\n#2=[{number}]\nG0 X#1\no1 endsub\no1 call [3]\nM2\n"
    written, why = out(text, "linuxcnc")
    assert not written
    assert "a number in a subprogram is not known" in why[0]
    told = problems(text, "G21 G90\nG0 X3\nM2\n", "linuxcnc")
    assert "set to what is not known" in told[0]
