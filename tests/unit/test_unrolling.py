"""Loops and calls written out: what stands in their place, what stays and why, and the way back."""

import io
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.cycles.expansion import expand
from gcodejerk.errors import EmitError, ProgramError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc.line_map import Chain
from gcodejerk.reasons import Reason
from gcodejerk.rewrite.pipeline import process
from gcodejerk.start import NOTHING_KNOWN, Start
from gcodejerk.unrolling.spelling import number_text
from gcodejerk.unrolling.unrolling import unroll

VMC = Machine.load(find_machine("vmc"))
ROOT = Path(__file__).parents[2]
GRID = (ROOT / "samples/grid.ngc").read_bytes()
HEAD = "G21 G90 G94 G17 G40 G49 G80 F100.\n"


def out(text, dialect="linuxcnc", start=NOTHING_KNOWN, comments=False):
    """Lines that are written, and what was found."""
    target = io.BytesIO()
    data = text if isinstance(text, bytes) else text.encode()
    found = unroll(io.BytesIO(data), target, dialect=dialect, start=start, comments=comments)
    assert bool(target.getvalue()) == bool(found.written)
    return target.getvalue().decode().split("\n")[:-1], found


def left(text, dialect="linuxcnc", start=NOTHING_KNOWN):
    """Why nothing is written out."""
    _, found = out(text, dialect, start)
    assert not found.whole
    assert found.findings
    return found.findings[0].message


def test_a_subprogram_stands_there_with_its_numbers():
    lines, found = out(
        "#1=7\no1 sub\nG0 X#1 Y[#2*2] (to) ;it\nG1 X#<_a>\n#<_a>=#1 #1=3\n#5=1\n/G0 Z-#2\n"
        "o1 endsub\no1 call [0.1+0.2] [-4]\nG0 X#1\nM2\n"
    )
    assert lines == [
        "#1=7", "G0 X0.30000000000000004 Y-8 (to) ;it", "G1 X#<_a>", "#<_a>=0.30000000000000004",
        "/G0 Z4", "G0 X#1", "M2",
    ]  # fmt: skip
    assert found.whole


def test_numbers_have_all_their_digits():
    for value in (1 / 3, 1e-7, 123456.789, -2.5, 4.0, 1e15 + 0.125):
        text = number_text(value)
        assert float(text) == value
        assert b"e" not in text


STAYS = {
    "depends on what is not known": "o1 if [#33 GT 1]\nG0 X1\no1 endif\nM2\n",
    "does not stand in front of it": "o<x> call\nM2\n",
    "saves or restores modes": "o1 sub\nM70\no1 endsub\no1 call\nM2\n",
    "a line is not understood": "o1 repeat [1]\nG0 X1.2.3\no1 endrepeat\nM2\n",
    "M97, M98 and M99": "o1 repeat [1]\nM98 P1\no1 endrepeat\nM2\n",
    "how often it runs is not certain": "o1 repeat [1.5]\nG0 X1\no1 endrepeat\nM2\n",
    "leads out of no while or do": "o1 repeat [2]\no1 break\no1 endrepeat\nM2\n",
    "a number in a subprogram is not known": "o1 sub\nG0 X[#33+#1]\no1 endsub\no1 call\nM2\n",
    "sets a variable that is computed": "o1 sub\n#[#1+100]=2\no1 endsub\no1 call\nM2\n",
    "shows a formatted variable": "o1 sub\n(DEBUG,%.2f #1)\no1 endsub\no1 call\nM2\n",
    "reads #<_value>": "o1 repeat [1]\nG0 X#<_Value>\no1 endrepeat\nM2\n",
    "not nested as LinuxCNC demands": "o1 repeat [1]\nG0 X1\no2 endif\no1 endrepeat\nM2\n",
    "more than 5 lines (program.unrolled_lines": "o1 repeat [6]\nG0 X1\no1 endrepeat\nM2\n",
    "it runs more than": "o1 while [1]\no1 endwhile\nM2\n",
    "the operator decides whether": "o1 repeat [1]\n/M2\no1 endrepeat\nM2\n",
}


@pytest.mark.parametrize("reason", STAYS)
def test_what_is_not_certain_stays_with_its_reason(reason):
    assert reason in left(STAYS[reason], start=Start(unrolled_lines=5))


MACRO_STAYS = {
    "G66 calls a macro behind every move": "G66 P2 A1.\nG0 X1.\nG67\nIF [1 EQ 1] GOTO 9\nN9 M30\n",
    "M99 begins the program again": "#1=1\nWHILE [#1 LT 2] DO1\n#1=#1+1\nEND1\nM99\n",
    "depends on what is not known": "IF [#500 GT 1] GOTO 9\nG0 X1.\nN9 M30\n",
    "in a way that is not followed": "GOTO 77\nM30\n",
    "refers to blocks by their N": "M98 P2000\nG71 P10 Q20\nM30\nO2000\nG0 X1.\nM99\n",
    "words stand beside a return": "M98 P2000\nM30\nO2000\nG0 X1. M99\n",
    "what a computed E means": "G65 P2000 A1.\nM30\nO2000\nG1 X1. E#1\nM99\n",
    "not known to its last digit": "G65 P2000 A1.\nM30\nO2000\nG1 X[#1/3]\nM99\n",
    "a macro calls a program that is not here": "G65 P2000 A1.\nM30\nO2000\nG0 X#1\nM98 P7\nM99\n",
    "may skip a line of a macro": "G65 P2000 A1.\nM30\nO2000\n/G0 X#1\nM99\n",
    "no end in front of the next one": "IF [1 EQ 2] GOTO 9\nN9 G0 X1.\nO2000\nM8\nM99\n",
}


@pytest.mark.parametrize("reason", MACRO_STAYS)
def test_a_program_of_macro_b_stays_with_its_reason(reason):
    dialect = "fanuc-lathe-b" if "G71" in MACRO_STAYS[reason] else "fanuc"
    assert reason in left(f"O1\n{HEAD}{MACRO_STAYS[reason]}", dialect)


def test_a_program_of_macro_b_runs_from_top_to_bottom():
    lines, found = out(
        f"%\nO1\n{HEAD}N1 G0 X0.\n#1=1\nN5 M98 P2000 L2\nG65 P3000 A2. K1.5\nM97 P7\n"
        "IF [#1 EQ 3] THEN #2=4\nIF [#2 NE 4] GOTO 8\nGOTO 9\nN8 G0 X99.\nN9 M30\nN7 G0 Z1.\nM99\n"
        "O2000\nN1 G0 Y#1\n#1=#1+1\nM99\nO3000\nG0 X#1 Z[#6*2] (m)\n#1=5.\nM99\n%\n",
        "haas",
    )
    assert lines[3:] == [
        "N1 G0 X0.", "#1=1", "G0 Y#1", "#1=#1+1", "G0 Y#1", "#1=#1+1", "G0 X2. Z3. (m)",
        "N7 G0 Z1.", "#2=4", "N9 M30", "%",
    ]  # fmt: skip
    assert found.whole


def test_a_call_of_what_is_not_here_stays_and_is_not_counted():
    lines, found = out(
        f"O1\n{HEAD}M98 P7\nM98 P2000\nN5 M98 P7\nM30\nO2000\nG0 X2.\nM99\n", "fanuc"
    )
    assert lines[2:6] == ["M98 P7", "G0 X2.", "N5 M98 P7", "M30"]
    assert (found.structures, found.written) == (3, 1)
    assert [finding.line for finding in found.findings] == [3, 5]
    assert all("neither in this file nor in --sub" in each.message for each in found.findings)
    assert found.whole


def test_calls_by_name_of_what_is_not_here_stay_with_their_reasons_too():
    """Siemens: an instruction that the table knows is no call, and neither is a cycle."""
    lines, found = out(
        "G71 G90\nR1=0\nAGAIN:\nG0 X=R1 Y5\nR1=R1+1\nIF R1<2 GOTOB AGAIN\n"
        "SIDE(3,4)\nFNORM\nL7 P2\nCYCLE800()\nM30\n", "siemens"
    )  # fmt: skip
    assert lines[-5:] == ["SIDE(3,4)", "FNORM", "L7 P2", "CYCLE800()", "M30"]
    assert lines.count("G0 X=R1 Y5") == 2
    assert (found.structures, found.written) == (3, 1)
    assert [finding.line for finding in found.findings] == [7, 9]
    assert all("neither in this file nor in --sub" in each.message for each in found.findings)


def test_a_program_that_only_calls_what_is_not_here_stays_as_it_is():
    program = f"O1\n{HEAD}M98 P7\nG0 X1.\nM30\nO2000\nG0 X2.\nM99\n".encode()
    result = process(program, VMC, unroll=True, dialect="haas", controller="haas")
    assert result.output == program
    assert (result.unrolling.structures, result.unrolling.written) == (1, 0)
    assert any("neither in this file nor in --subprograms" in note for note in result.notes)


def test_subprograms_of_siemens_give_their_modes_back_or_not():
    head = "%_N_A_MPF\nG90 G71\n"
    sub = "%_N_SUB_SPF\nPROC SUB(REAL DEEP)\nG91 G0 X=DEEP\nM17\n"
    lines, _ = out(f"{head}SUB(4)\nM30\n{sub}", "siemens")
    assert lines == [*head.split("\n")[:-1], "G91 G0 X=4", "M30"]
    lines, found = out(f"{head}SUB(4)\nSUB(4,5)\nM30\n{sub}", "siemens")
    assert "does not take such arguments" in found.findings[0].message
    assert (found.structures, found.written, found.whole) == (2, 1, False)
    saves = sub.replace("DEEP)", "DEEP) SAVE")
    assert "gives back modes" in left(f"{head}SUB(4)\nM30\n{saves}", "siemens")
    two = f"{head}M30\n%_N_C_MPF\nIF 1==1\nG0 X1\nENDIF\nM30\n"
    assert "more than one main program" in left(two, "siemens")


def test_a_dialect_without_flow_is_refused():
    with pytest.raises(ProgramError, match="cannot be written out"):
        out("G0 X1\n", "grbl")


def test_line_ends_marks_and_a_missing_end_are_the_files_own():
    text = b"\xef\xbb\xbfG0 X1\r\no1 repeat [2]\r\nG0 X2\r\no1 endrepeat"
    target = io.BytesIO()
    assert unroll(io.BytesIO(text), target, comments=False).written
    assert target.getvalue() == b"\xef\xbb\xbfG0 X1\r\nG0 X2\r\nG0 X2"


def test_lines_lead_back_to_the_original():
    text = "G0 X0\no1 sub\nG0 X#1\no1 endsub\n"
    text += "o2 repeat [2]\nG1 Z1\no1 call [3]\no2 endrepeat\nG0 Y1\nM2\n"
    lines, found = out(text, comments=True)
    assert lines == [
        "G0 X0", "(gcodejerk: o1 sub)", "(gcodejerk: o2 repeat [2])", "G1 Z1", "G0 X3", "G1 Z1",
        "G0 X3", "G0 Y1", "M2",
    ]  # fmt: skip
    assert found.map.lines_of(np.arange(1, 10)).tolist() == [1, 2, 5, 6, 3, 6, 3, 9, 10]
    spans = found.map.replaced
    assert [text[a:b] for a, b in zip(spans.original_begin, spans.original_end, strict=True)] == [
        text[6 : text.index("o2")], text[text.index("o2") : text.index("G0 Y1")],
    ]  # fmt: skip


def test_two_steps_lead_back_through_both():
    text = b"G21 G90 G98 G61 F100\nG0 X0 Y0 Z9\nG81 X1 Z-1 R2\nG80\no1 repeat [2]\n" \
        b"G81 X3 Z-1 R2\nG80\no1 endrepeat\nG81 X5 Z-1 R2\nG80\nM2\n"  # fmt: skip
    between, last = io.BytesIO(), io.BytesIO()
    first = unroll(io.BytesIO(text), between, comments=False)
    second = expand(io.BytesIO(between.getvalue()), last, comments=False)
    assert (first.written, second.written) == (1, 4)
    chain, result = Chain(first.map, second.map), last.getvalue()
    count = result.count(b"\n")
    lines = chain.lines_of(np.arange(1, count + 1)).tolist()
    moves = ["G81 X1", "G81 X3", "G81 X5"]
    for line, row in zip(lines, result.decode().split("\n"), strict=False):
        said = text.decode().split("\n")[line - 1]
        assert said == row or said[:6] in moves, (said, row)
    spans = chain.replaced
    rebuilt, at = b"", 0
    ends = np.array([0, 1, 2, 1])[spans.original_terminator]
    for k in range(len(spans)):
        begin, stop = int(spans.original_begin[k]), int(spans.original_end[k] + ends[k])
        assert begin >= at
        rebuilt += text[at:begin] + result[spans.begin[k] : spans.end[k]]
        at = stop
    assert rebuilt + text[at:] == result


def test_a_program_is_processed_pass_by_pass():
    before = process(GRID, VMC, name="grid.ngc")
    result = process(GRID, VMC, name="grid.ngc", unroll=True)
    assert result.planned > 5 * before.planned
    assert not [rapid for rapid in result.rapids if rapid.reason is Reason.SUBPROGRAM]
    assert result.verification.confirmed == result.planned
    places = {rapid.line for rapid in result.rapids}
    assert places == {3, 5, 6, 8, 19}
    unrolled = result.unrolling
    assert (unrolled.structures, unrolled.written, unrolled.whole) == (1, 1, True)
    source, output = GRID, result.output
    rebuilt, at = b"", 0
    for begin, end, _, original, stop in result.hunks.tolist():
        rebuilt += source[at:original] + output[begin:end]
        at = stop
    assert rebuilt + source[at:] == output


def test_what_has_no_place_for_it_refuses():
    with pytest.raises(EmitError, match="--unroll needs streams within the program"):
        process(GRID, VMC, unroll=True, controller="csv")
    with pytest.raises(EmitError, match="--unroll and --expand-cycles has nothing to do"):
        process(GRID, replace(VMC, controller="klipper"), form="parameters", unroll=True,
                expand_cycles=True)  # fmt: skip


def test_the_machine_file_bounds_it():
    text = find_machine("vmc").read_text()
    assert "\nprogram:" not in text
    machine = Machine.loads(f"{text}\nprogram:\n  unrolled_lines: 20\n")
    assert machine.program.unrolled_lines == 20
    notes = process(GRID, machine, unroll=True).notes
    assert any("more than 20 lines (program.unrolled_lines" in note for note in notes)


def test_the_command_line_writes_and_proves(command, tmp_path):
    shutil.copy(ROOT / "samples/grid.ngc", tmp_path)
    code, said = command("process", "grid.ngc", "-m", "vmc", "--unroll")
    assert (code, "1 loop or call written out" in said) == (0, True)
    code, said = command("verify", "grid.ngc", "grid.jerk.ngc", "-m", "vmc")
    assert (code, "with 1 loop or call written out" in said) == (0, True), "the stamp says it"
    code, said = command("inspect", "grid.ngc", "-m", "vmc", "--unroll")
    assert (code, said.count("inside a subprogram")) == (0, 0)
    code, said = command("verify", "grid.ngc", "grid.csv", "-m", "vmc", "--unroll")
    assert (code, "no loops" in said) == (2, True)


@pytest.mark.parametrize("front", [False, True])
def test_who_leaves_loops_as_they_are_is_told_what_writes_them_out(front):
    notes = process(GRID, VMC, unroll=front).notes
    assert any("--unroll writes out" in note for note in notes) is not front
    # Lines of a subprogram are read by themselves first: nothing is unknown since the call.
    assert not any("is unknown since" in note for note in notes)


def test_a_file_may_have_lines_of_both_ends():
    program = b"G21 G90\nIF [1 EQ 1] GOTO 2\nN2 M98 P1\n%\r\n(1001)\r\n"
    result = process(program, VMC, unroll=True, dialect="fanuc-lathe-b", controller="fanuc")
    assert result.output.endswith(b"\nN2 M98 P1\n%\r\n(1001)\r\n")


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r", b""])
def test_the_last_line_of_the_file_keeps_its_end(end):
    program = b"IF [1 EQ 1] GOTO 2\nN2 X152.156" + end
    result = process(program, VMC, unroll=True, dialect="fanuc-lathe-a", controller="fanuc")
    assert result.output.endswith(b"\nN2 X152.156" + end.replace(b"\r\n", b"\n"))
