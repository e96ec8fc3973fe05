"""M98, M97, GOTO, WHILE and labels: what is followed, and what is known behind a jump."""

import io

import pytest

from gcodejerk.nc import CERTAIN, REASONS, Start, read_program
from gcodejerk.nc.flow import outline, subprograms
from gcodejerk.reasons import Reason

HEAD = b"O1 (MAIN)\nG21 G90 G94 G17 G40 G49 G54 G80 G0 X0. Y0. Z0. F100.\n"
SUB = b"M30\nO1000\nG90 G0 X0.\nX10.\nG1 Z-1.\nG0 Z0.\nM99\n"


class Pipe(io.BytesIO):
    """A file that cannot go back."""

    def seekable(self):
        return False

    def seek(self, *arguments):
        raise io.UnsupportedOperation

    def tell(self):
        raise io.UnsupportedOperation


def reasons(text, dialect="fanuc", head=HEAD, file=io.BytesIO):
    """Reason of every rapid behind the head, by line counted from the text's first."""
    start = Start(startup="G71" if dialect == "siemens" else "")
    rapids = read_program(file(head + text), dialect=dialect, start=start).rapids
    assert rapids.line.tolist() == sorted(set(rapids.line.tolist()))
    found = zip(rapids.line.tolist(), rapids.reason.tolist(), strict=True)
    lines = head.count(b"\n")
    return {n - lines: None if r == CERTAIN else REASONS[r] for n, r in found if n > lines}


def certain(found, line):
    """Whether a line is a rapid that can be rewritten."""
    return found.get(line, "no rapid") is None


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "mach"])
def test_subprogram_behind_the_end_runs_where_it_is_called(dialect):
    found = reasons(b"G0 X5. Y5.\nM98 P1000\nG0 Y7.\nX0.\n" + SUB, dialect)
    assert found == {1: None, 3: None, 4: None, 7: None, 8: None, 10: None}
    assert reasons(b"G0 X5.\nM98 P1000\n" + SUB, dialect, file=Pipe)[5] is None


def test_subprogram_runs_so_often():
    text = b"M98 P1000 L3\nG0 X%d.\nM30\nO1000\nG91 G0 X5.\nG90\nM99\n"
    assert reasons(text % 16)[2] is None
    assert reasons(text % 15)[2] is Reason.NO_MOTION
    assert reasons(text % 15)[5] is Reason.SUBPROGRAM
    assert reasons(text.replace(b"P1000 L3", b"P31000") % 15)[2] is Reason.NO_MOTION


def test_packed_repeats_are_fanucs_alone():
    text = b"M98 P31000\nG0 Y1.\n" + SUB
    assert reasons(text)[2] is None
    assert reasons(text, "haas")[2] is not None


def test_rapids_whose_start_differs_between_calls_are_left_alone():
    found = reasons(b"M98 P1000\nG0 X3.\nM98 P1000\n" + SUB)
    assert (found[6], found[7], found[9]) == (Reason.SUBPROGRAM, None, None)


@pytest.mark.parametrize(
    "line",
    [b"M98 P2000", b"M98 P#1", b"M98", b"G65 P2000 X1.", b"G66 P9000", b"M98 P1000 Q5", b"M198 P1"],
)
def test_what_cannot_be_followed_leaves_nothing_known(line):
    found = reasons(line + b"\nG90 G21 G17 G40 G0 X3.\n" + SUB)
    assert found[2] is not None
    assert all(found[n] is Reason.SUBPROGRAM for n in (5, 6, 8))


def test_unfollowed_call_leaves_the_subprograms_alone():
    text = b"M98 P1000\nM98 P2000\nG90\n" + SUB
    assert None not in reasons(text).values()


def test_number_that_stands_twice_is_not_followed():
    found = reasons(b"M98 P1000\nG0 X1.\n" + SUB + b"O1000\nM99\n")
    assert found[2] is not None


def test_subprogram_without_return_is_not_followed():
    assert reasons(b"M98 P1000\nG0 X1.\nM30\nO1000\nG0 X5.\nX6.\n")[2] is not None


def test_subprogram_that_calls_itself_is_left_alone():
    found = reasons(b"M98 P1000\nG0 X1.\nM30\nO1000\nG90 G0 X5.\nX6.\nM98 P1000\nM99\n")
    assert (found[2], found[6]) == (Reason.NOT_FOLLOWED, Reason.SUBPROGRAM)


def test_nested_calls_are_followed():
    inner = b"O2000\nG0 Z5.\nZ6.\nM99\n"
    outer = b"O1000\nG0 X5.\nM98 P2000\nG0 X6.\nM99\n"
    assert set(reasons(b"M98 P1000\nG0 X1.\nM30\n" + outer + inner).values()) == {None}


def test_haas_calls_lines_of_the_same_program():
    text = b"M97 P100\nG0 X1.\nM30\nN100 G0 X5.\nX6.\nM99\n"
    # The first line may be run into as well as called.
    assert reasons(text, "haas") == {2: None, 4: Reason.SUBPROGRAM, 5: None}
    through = b"M97 P100\nG0 X1.\nN100 G0 X5.\nX6.\nM99\n"
    assert reasons(through, "haas")[3] is Reason.SUBPROGRAM
    backwards = b"N100 G0 X5.\nX6.\nM97 P100\nG0 X1.\nM30\n"
    assert reasons(backwards, "haas")[4] is not None


def test_subprogram_may_skip_its_call():
    found = reasons(b"/M98 P1000\nG0 X3.\nY4.\n" + SUB)
    assert (found[2], found[3], found[7]) == (Reason.START_UNKNOWN, None, None)


def test_condition_that_falls_through_keeps_what_is_known():
    found = reasons(b"IF [#1 GT 3] GOTO 100\nG0 X5.\nN50 X6.\nN100 G0 X7.\nX8.\n")
    # Lines other than the target follow the one in front of them.
    assert (found[2], found[3]) == (None, None)
    assert found[4] is not None


def test_behind_a_target_holds_what_is_stated_there():
    text = b"G0 X5.\nGOTO 10\nX6.\nN10 G21 G90 G94 G17 G40\nG0 X1. Y1. F100.\nX2.\n"
    found = reasons(text)
    assert certain(found, 1)
    assert not certain(found, 3)
    assert (found[5], found[6]) == (None, None)
    # ... and so it is where a jump leads to nowhere, and nothing is followed
    found = reasons(b"IF [#1 EQ 1] GOTO 99\n" + text)
    assert (found[6], found[7]) == (Reason.START_UNKNOWN, None)


def test_computed_jump_may_lead_to_every_number():
    found = reasons(b"N1 G0 X5.\nN2 X6.\nIF [#1] GOTO #2\nX7.\n")
    assert not certain(found, 1)
    assert not certain(found, 2)


def test_loop_knows_what_it_states():
    text = b"WHILE [#1 LT 3] DO 1\nG0 X1.\nG21 G90 G94 G17 G40\nG0 X0. F9.\nX2.\n#1=#1+1\n"
    text += b"END 1\nG0 X9.\n"
    found = reasons(text)
    assert (found[4], found[5]) == (None, None), "X stands at 1 on every pass"
    assert not certain(found, 2)
    assert not certain(found, 8)


def test_conditional_assignment_leaves_its_variable_unknown():
    text = b"#1=5.\n#2=6.\nIF [#3 EQ 1] THEN #1=7.\nG0 X#%d\nX8.\n"
    assert reasons(text % 1)[5] is Reason.START_UNKNOWN
    assert reasons(text % 2)[5] is None


def test_jump_back_makes_code_behind_the_end_run():
    text = b"IF [#1 EQ 1] GOTO 900\nM30\nN900 G21 G90 G94 G17 G40\nG0 X1. F9.\nX2.\nM30\n"
    assert certain(reasons(text), 5)


def test_program_that_repeats_itself_knows_nothing_at_its_beginning():
    start = Start(positions=dict.fromkeys("XYZ", 0.0))
    for text, certain in (
        (b"G21 G90 G94 G17 G0 X5.\nM30\n", True),
        (b"G21 G90 G94 G17 G0 X5.\nM99\n", False),
    ):
        rapids = read_program(io.BytesIO(text), dialect="fanuc", start=start).rapids
        assert (int(rapids.reason[0]) == CERTAIN) is certain


def test_m99_p_goes_on_at_a_number():
    text = b"M98 P1000\nG0 X1.\nN50 G0 X3.\nX4.\nM30\nO1000\nM99 P50\n"
    found = reasons(text)
    assert all(reason is not None for reason in found.values())


def test_work_is_bounded(monkeypatch):
    text = b"M98 P1000 L50\nG0 X1.\n" + SUB.replace(b"G90 G0 X0.", b"G91 G0 X1.")
    assert reasons(text)[2] is None
    monkeypatch.setattr(subprograms, "ALL", 100)
    assert reasons(text)[2] is not None
    assert None not in reasons(text).values()


def test_long_subprogram_is_not_followed(monkeypatch):
    text = b"M98 P1000\nG0 Y1.\n" + SUB
    monkeypatch.setattr(outline, "MOST_LINES", 3)
    assert reasons(text)[2] is not None


SIEMENS = b"G71 G90 G94 G17 G40 G54 G64 G0 X0 Y0 Z0 F100\n"


def test_siemens_label_is_a_comment_unless_something_jumps():
    text = b"G0 X1\nLABEL1:\nX2\nX3\n"
    assert reasons(text, "siemens", SIEMENS) == {1: None, 3: None, 4: None}
    found = reasons(text + b"IF R1>5 GOTOB LABEL1\nX4\n", "siemens", SIEMENS)
    assert certain(found, 1)
    assert not certain(found, 3)
    assert certain(found, 6), "on every way that leads there, X stands at 3"


def test_siemens_condition_keeps_what_is_known_where_it_goes_on():
    text = b"G0 X1\nIF R1==5 GOTOF N100\nX2\nN100 X3\n"
    found = reasons(text, "siemens", SIEMENS)
    assert certain(found, 3)
    assert not certain(found, 4)


def test_siemens_block_conditions_and_loops_forget():
    for word in (b"IF R1==5", b"ELSE", b"ENDIF", b"WHILE R1<5", b"FOR R1=1 TO 5", b"LOOP", b"RET"):
        found = reasons(b"G0 X1\n" + word + b"\nG0 X2\n", "siemens", SIEMENS)
        assert found[3] is not None, word


def test_words_beside_the_number_of_a_subprogram_are_not_passed_over():
    found = reasons(b"M98 P1000\nG90 G0 X1.\nX2.\nM30\nO1000 G0 X5.\nM99\n")
    assert not certain(found, 2)
