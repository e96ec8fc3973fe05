"""Program flow of LinuxCNC: what is followed, what is known behind it, what is left alone."""

import io
import math

import pytest

from gcodejerk.nc import CERTAIN, REASONS, read_program, trace
from gcodejerk.nc.flow import o_words, structures
from gcodejerk.reasons import Reason
from gcodejerk.testing.programs import differences

HEAD = b"G21 G90 G94 G17 G40 F100 G0 X0 Y0 Z0\n"


def reasons(text, dialect="linuxcnc"):
    """Reason of every rapid behind the head, by line counted from the text's first."""
    rapids = read_program(io.BytesIO(HEAD + text), dialect=dialect).rapids
    found = zip(rapids.line.tolist(), rapids.reason.tolist(), strict=True)
    return {n - 1: None if r == CERTAIN else REASONS[r] for n, r in found if n > 1}


def end(text):
    """Positions X, Y, Z behind a plain head and the text."""
    *_, (_, positions, _) = trace(io.BytesIO(HEAD + text))
    return [None if math.isnan(p) else round(p, 9) for p in positions[:3]]


def test_branch_that_is_not_taken_changes_nothing():
    text = b"#1=3\no1 if [#1 GT 5]\nG0 X1\no1 else\nG0 X2\no1 endif\n"
    assert end(text) == [2, 0, 0]
    assert reasons(text) == {3: Reason.SUBPROGRAM, 5: None}


def test_branch_that_may_be_taken_leaves_unknown_what_it_changes():
    text = b"o1 if [#1 GT 5]\nG0 X1 Y5\no1 else\nG0 X2 Y5\no1 endif\nG0 Y6\nX3\n"
    assert end(text) == [3, 6, 0]
    branch = Reason.SUBPROGRAM  # whether it runs is not known
    assert reasons(text) == {2: branch, 4: branch, 6: None, 7: Reason.START_UNKNOWN}


def test_loop_runs_as_often_as_its_condition_says():
    text = b"#1=0\no1 while [#1 LT 4]\nG91 G0 X10\no2 if [#1 EQ 2]\no1 break\no2 endif\n"
    text += b"#1=[#1+1]\no1 endwhile\nY#1\n"
    assert end(text) == [30, 2, 0]
    assert end(b"#1=0\no1 do\n#1=[#1+1]\no1 while [#1 LT 5]\nG0 X#1\n") == [5, 0, 0]


def test_rapid_is_certain_if_it_is_the_same_on_every_pass():
    text = b"o1 repeat [3]\nG0 X0 Y0 Z0\nG0 X10\nG1 Z-1\nG0 Z5\nX20\no1 endrepeat\n"
    # The first one comes from the head the first time, from X20 Z5 afterwards.
    kept = {2: Reason.SUBPROGRAM, 3: None, 5: None, 6: None}
    assert reasons(text) == kept
    unknown = text.replace(b"[3]", b"[#1]")
    assert reasons(unknown) == kept


def test_rapid_that_starts_elsewhere_on_a_later_pass_is_left_alone():
    assert reasons(b"o1 repeat [2]\nG91 G0 X1\no1 endrepeat\n") == {2: Reason.SUBPROGRAM}
    assert reasons(b"o1 repeat [1]\nG91 G0 X1\no1 endrepeat\n") == {2: None}


def test_line_that_is_a_rapid_on_one_pass_only_is_left_alone():
    text = b"#1=0\nG0\no1 while [#1 LT 2]\nX0\nX5\nG1 X6\n#1=[#1+1]\no1 endwhile\n"
    assert reasons(text) == {4: Reason.SUBPROGRAM, 5: Reason.SUBPROGRAM}


def test_rapids_of_a_subprogram_are_certain_if_all_calls_agree():
    sub = b"o1 sub\nG0 X#1\nG0 Z5\nG1 Z-1\nG0 Z5\no1 endsub\n"
    found = reasons(sub + b"o1 call [3]\no1 call [4]\n")
    assert found == {2: Reason.SUBPROGRAM, 3: Reason.SUBPROGRAM, 5: None}


def test_subprogram_that_is_never_called_is_left_alone():
    assert reasons(b"o1 sub\nG0 X1\no1 endsub\nG0 Y1\n") == {2: Reason.SUBPROGRAM, 4: None}


def test_subprogram_has_variables_of_its_own():
    text = b"#1=1 #31=1 #<a>=1\no1 sub\n#1=5 #31=5 #<a>=5\no1 endsub\no1 call [#1]\n"
    assert end(text + b"G0 X#1 Y#31 Z#<a>\n") == [1, 5, 1]


def test_arguments_that_are_not_given_are_zero():
    assert end(b"o1 sub\nG0 X#1 Y[#2+1]\no1 endsub\no1 call [7]\n") == [7, 1, 0]


def test_return_ends_a_subprogram_early():
    sub = b"o1 sub\no2 if [#1 GT 2]\no1 return\no2 endif\nG0 X9\no1 endsub\n"
    assert end(sub + b"o1 call [3]\n") == [0, 0, 0]
    assert end(sub + b"o1 call [2]\n") == [9, 0, 0]
    assert end(sub + b"o1 call [#40]\n") == [None, 0, 0]


def test_modes_that_a_subprogram_gives_back_are_unknown():
    text = b"o1 sub\nM73\nG91\no1 endsub\no1 call\nG0 X5\n"
    assert end(text) == [None] * 3


def test_call_of_something_else_leaves_all_subprograms_alone():
    sub = b"o1 sub\nG90 G0 X0\nG0 X5\no1 endsub\n"
    assert reasons(sub + b"o1 call\n")[3] is None
    assert reasons(sub + b"o1 call\no<other> call\n")[3] is Reason.SUBPROGRAM
    assert reasons(b"o<other> call\nG21 G40\n" + sub + b"o1 call\n")[5] is Reason.SUBPROGRAM


@pytest.mark.parametrize(
    "text",
    [
        b"o1 sub\nG0 X1\no1 call\no1 endsub\no1 call\n",
        b"#1=1\no1 while [#1]\n#1=[#1+1]\nG0 X#1\no1 endwhile\n",
        b"#1=1\no1 while [#1]\no2 while [#1]\no3 while [#1]\nG91 G0 X1\n#1=[#1+1]\no3 endwhile\n"
        b"#2=[#2+#1]\no2 endwhile\n#3=[#3+#2]\no1 endwhile\n",
        b"o1 repeat [1000000]\nG91 G0 X1\no1 endrepeat\n",
    ],
    ids=["recursion", "endless", "nested", "long"],
)
def test_what_does_not_end_is_left_alone(text):
    found = reasons(text + b"G0 X5\n")
    *inside, (_, last) = sorted(found.items())
    assert all(reason in (Reason.SUBPROGRAM, Reason.EXPRESSION) for _, reason in inside)
    assert last is not None


def test_endless_loop_has_nothing_behind_it():
    text = b"o1 while [1]\nG0 X0\nG0 X5\no1 endwhile\nG0 X7\n"
    assert reasons(text)[3] is None
    assert reasons(text)[5] is not None


def test_end_of_the_program_in_a_branch():
    assert reasons(b"o1 if [1]\nM2\no1 endif\nG0 X1\n") == {4: Reason.AFTER_END}
    assert reasons(b"o1 if [#1]\nM2\no1 endif\nG0 X1\n") == {4: None}


@pytest.mark.parametrize(
    "text",
    [
        b"o1 while [#1]\nG0 X1\no2 endwhile\n",
        b"o1 if [#1]\no1 else\no1 else\nG0 X1\no1 endif\n",
        b"/o1 if [#1]\nG0 X1\no1 endif\n",
        b"o1 repeat [2]\nG0 X1\n",
        b"o1 repeat [2]\nG0 X1\nM99\no1 endrepeat\n",
    ],
)
def test_what_is_not_nested_as_linuxcnc_demands_is_left_alone(text):
    assert set(reasons(text).values()) == {Reason.SUBPROGRAM}


def test_structure_that_is_too_long_is_read_as_one_that_may_do_anything(monkeypatch):
    text = b"o1 if [1]\nG0 X1\nG0 X2\nG0 X1\no1 endif\nG0 Y5\nG0 X3\n"
    assert reasons(text)[2] is None
    monkeypatch.setattr(structures, "MOST_LINES", 3)
    found = reasons(text)
    assert {found[line] for line in (2, 3, 4)} == {Reason.SUBPROGRAM}
    assert found[7] is Reason.START_UNKNOWN


def test_work_is_bounded_for_the_whole_program(monkeypatch):
    monkeypatch.setattr(o_words, "EXACT", 50)
    monkeypatch.setattr(o_words, "ALL", 100)
    loop = b"o%d repeat [8]\nG0 X0\nG0 X2\no%d endrepeat\n"
    text = b"".join(loop % (k, k) for k in range(1, 40))
    found = list(reasons(text).values())
    assert found[1] is None
    assert found[-1] is Reason.SUBPROGRAM


def test_rows_are_in_the_order_of_the_file():
    text = b"o1 sub\nG0 X1\no1 endsub\nG0 Y1\no1 call\nG0 Y2\no1 call\n"
    rapids = read_program(io.BytesIO(HEAD + text)).rapids
    assert rapids.line.tolist() == [1, 3, 5, 7]


def test_feed_is_needed_if_any_pass_needs_it():
    sub = b"o1 sub\nG0 X0\nG0 X5\no1 endsub\n"
    head = b"G21 G90 G94 G17 G40 G0 X0 Y0 Z0\n"

    def last(text):
        return int(read_program(io.BytesIO(head + sub + text)).rapids.reason[2])

    assert last(b"o1 call\nG1 X1 F100\nM2\n") == CERTAIN
    assert REASONS[last(b"o1 call\nG1 X1\nM2\n")] is Reason.FEED_UNKNOWN
    assert REASONS[last(b"o1 call\nG1 F9 X1\no1 call\nG1 X1\nM2\n")] is Reason.FEED_UNKNOWN


@pytest.mark.parametrize(("depth", "known"), [(9, True), (11, True), (12, False), (200, False)])
def test_nesting_is_followed_within_bounds(depth, known):
    opens = b"".join(b"o%d if [#1 GT -1]\n" % (100 + k) for k in range(depth - 1))
    closes = b"".join(b"o%d endif\n" % (98 + depth - k) for k in range(depth - 1))
    body = opens + b"o2 if [#1 LT 5]\no1 call [#1+1]\no2 endif\n" + closes
    found = end(b"o1 sub\n" + body + b"G0 X7\no1 endsub\no1 call [0]\n")
    assert found == ([7, 0, 0] if known else [None] * 3)


def test_nested_loops_of_unknown_length_end():
    depth = 11
    text = b"".join(b"o%d while [#31 GT 0]\n#%d=[#%d+1]\n" % (k, k, k) for k in range(1, depth))
    text += b"G91 G0 X1\n" + b"".join(b"o%d endwhile\n" % k for k in range(depth - 1, 0, -1))
    assert end(text + b"G90 G0 Y3\n")[0] is None


def test_a_break_makes_the_passes_of_a_later_do_unknown():
    # LinuxCNC 2.9 remembers the break, and ends the next do after one pass: measured.
    text = (
        b"#1=0\no1 while [#1 LT 3]\n#1=[#1+1]\no2 if [#1 EQ 1]\no1 break\no2 endif\no1 endwhile\n"
    )
    loop = b"#2=0\no3 do\n#2=[#2+1]\nG0 X#2\no3 while [#2 LT 3]\nG0 Y1\n"
    assert end(text + loop) == [None, 1, 0]
    assert end(loop) == [3, 1, 0]


def test_a_return_out_of_a_repeat_makes_its_later_passes_unknown():
    # LinuxCNC 2.9 goes on with the count where it was left: measured.
    text = b"o100 sub\no101 repeat [3]\n#1=[#1+1]\no103 if [#1 EQ 2]\no100 return\no103 endif\n"
    text += b"G91 G0 X1\nG90\no101 endrepeat\no100 endsub\n"
    assert end(text + b"o100 call [0]\n") == [1, 0, 0]
    assert end(text + b"o100 call [0]\no100 call [10]\nY2\n") == [None, 2, 0]


def test_what_a_call_leaves_unknown_is_said_to_be_so_since_the_call():
    rows = b"".join(b"G0 X%d Y1\n" % k for k in range(30))
    for text in (rows, b"G0 X1 Y1\n"):
        lines = b"G21 G90 G94 G64\n" + text + b"O1 call [1] (elsewhere)\nG0 X0 Y3 Z1\nM2\n"
        assert not differences(lines)
        (finding,) = read_program(io.BytesIO(lines)).findings
        assert finding.line == 2 + text.count(b"\n")
        assert "unknown since this line (O1 call [1]" in finding.message
