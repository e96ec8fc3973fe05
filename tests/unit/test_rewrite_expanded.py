"""Programs with their cycles written out: every result is in terms of the original."""

import io
import json
import shutil
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from gcodejerk.batch.reports import record_of
from gcodejerk.errors import EmitError, ProgramError, VerifyError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.report.difference import difference
from gcodejerk.report.records import dump
from gcodejerk.rewrite.expanded import Front, verify_expanded, verify_written
from gcodejerk.rewrite.pipeline import Settings, process, process_file
from gcodejerk.verification import Kind

SAMPLES = Path(__file__).parents[2] / "samples"
HOLES = (SAMPLES / "holes.ngc").read_bytes()
VMC = Machine.load(find_machine("vmc"))
SCHEMA = json.loads(files("gcodejerk.report").joinpath("report.schema.json").read_text())


@pytest.fixture(scope="module")
def result():
    return process(HOLES, VMC, expand_cycles=True, name="holes.ngc")


def proven(original, processed):
    return verify_expanded(io.BytesIO(original), io.BytesIO(processed), VMC)


def test_rapids_of_cycles_are_planned(result):
    assert (result.expansion.holes, result.expansion.written) == (8, 8)
    assert result.planned > 40
    assert process(HOLES, VMC).planned < 5


def test_the_report_carries_the_lines_and_blocks_of_the_original(result):
    record = json.loads(dump(record_of(result, VMC, "out", io.BytesIO(HOLES), bounds=False)))
    jsonschema.validate(record, SCHEMA)
    lines = HOLES.decode().splitlines()
    assert record["rapids"]
    for rapid in record["rapids"]:
        assert rapid["block"] == lines[rapid["line"] - 1].strip()
    first = [r for r in record["rapids"] if r["line"] == lines.index("N80 X28.284 Y28.284") + 1]
    assert [r["end"] for r in first] == [{"X": 28.284, "Y": 28.284}, {"Z": 2.0}]
    assert record["summary"]["blocks"] == sum(line[0] == "N" for line in lines)
    assert (record["summary"]["cycles"], record["summary"]["cycles_expanded"]) == (8, 8)


@pytest.mark.parametrize("comments", [True, False])
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
def test_both_steps_are_proven(comments, newline):
    program = HOLES.replace(b"\n", newline)
    output = process(program, VMC, expand_cycles=True, comments=comments).output
    found, written = proven(program, output)
    assert found.ok, found.violations
    assert written == 8
    assert found.rewritten > 40
    assert (b"(gcodejerk: N70 G99 G81" in output) == comments


def test_without_the_flag_the_cycles_are_a_change(result):
    from gcodejerk.verification import verify

    assert not verify(HOLES, result.output, VMC).ok


def test_a_program_without_cycles_is_proven_as_any_other():
    program = b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1.\nM2\n"
    output = process(program, VMC, expand_cycles=True).output
    assert output.split(b"\n")[1:] == process(program, VMC).output.split(b"\n")[1:]
    found, written = proven(program, output)
    assert (found.ok, written) == (True, 0)


DAMAGE = {
    "depth": (b"G1 Z-1.5\n", b"G1 Z-1.6\n", Kind.CHANGED, 10),
    "peck": (b"G1 Z-2.\n", b"", Kind.CHANGED, 15),
    "stream": (b"G0 G61 X28.284", b"G0 G61 X28.285", Kind.END, 11),
    "head": (b"N110 G98 F150", b"N110 G98 F160", Kind.CHANGED, 15),
    "kept line": (b"N150 G80\n", b"", Kind.CHANGED, 19),
}


@pytest.mark.parametrize("case", DAMAGE)
def test_damage_is_listed_with_both_lines(case, result):
    old, new, kind, line = DAMAGE[case]
    found, _ = proven(HOLES, result.output.replace(old, new, 1))
    first = found.violations[0]
    assert first.kind is kind
    assert first.line == result.output.count(b"\n", 0, result.output.index(old)) + 1
    assert first.original_line == line


def test_wrong_moves_of_a_cycle_never_appear(monkeypatch):
    # Were the writing side wrong, nothing would be written.
    from gcodejerk.cycles import drilling

    rules = replace(drilling.LINUXCNC, clearance={False: drilling.Decimal("0.5"), True: None})
    monkeypatch.setitem(drilling.DRILLING, "linuxcnc", rules)
    with pytest.raises(VerifyError, match="expected a rapid to"):
        process(HOLES, VMC, expand_cycles=True)


def test_the_difference_replaces_what_it_says(result):
    source = HOLES
    out, at = b"", 0
    for begin, end, line, first, last in result.hunks.tolist():
        assert line == source.count(b"\n", 0, first) + (last > first)
        out += source[at:first]
        assert len(out) == begin
        out += result.output[begin:end]
        at = last
    assert out + source[at:] == result.output
    text = difference(io.BytesIO(source), io.BytesIO(result.output), result)
    assert b"\n-N80 X28.284 Y28.284\n" in text
    assert text.count(b"\n@@") == len(result.hunks)


def test_the_stamp_in_front_of_a_cycle_is_a_difference_of_its_own():
    machine = replace(VMC, program=replace(VMC.program, start={"X": 0.0, "Y": 0.0, "Z": 20.0}))
    program = b"G21 G90 G94 G99 G81 X3 Z-2 R2 F100\nG80\nM2\n"
    result = process(program, machine, expand_cycles=True)
    first, second = result.hunks.tolist()
    assert result.output[first[0] : first[1]].startswith(b"(gcodejerk stamp")
    assert (second[0], second[2:]) == (first[1], [1, 0, program.index(b"G80")])
    assert result.output[second[1] :] == b"G80\nM2\n"


def test_the_difference_of_a_program_whose_cycles_cannot_be_planned_is_there_too():
    machine = replace(VMC, design=replace(VMC.design, minimum_length=1e6))
    result = process(HOLES, machine, expand_cycles=True)
    assert (result.planned, len(result.hunks)) == (0, 8)
    found, written = verify_expanded(io.BytesIO(HOLES), io.BytesIO(result.output), machine)
    assert (found.ok, written) == (True, 8)


def test_notes_name_lines_of_the_original():
    program = HOLES.replace(b"N150 G80", b"N150 G80\nG84 X1 Y1 Z-3 R2\nG80\nG0 X4..2")
    notes = process(program, VMC, expand_cycles=True).notes
    line = program.splitlines().index(b"G84 X1 Y1 Z-3 R2") + 1
    assert any(note.startswith(f"line {line}: cycles not written out") for note in notes)
    assert any(note.startswith(f"line {line + 2}: block not understood") for note in notes)


def test_a_program_that_was_processed_before_is_refused(result):
    with pytest.raises(ProgramError, match="processed by gcodejerk before"):
        process(result.output, VMC, expand_cycles=True)


def test_a_controller_whose_streams_stand_elsewhere_is_refused():
    settings = Settings(controller="csv", expand_cycles=True)
    with pytest.raises(EmitError, match="--expand-cycles needs streams within the program"):
        process_file(io.BytesIO(HOLES), io.BytesIO(), VMC, settings, "holes.ngc")


def test_the_map_of_a_result_is_in_order(result):
    assert (np.diff(result.program.rapids.line) >= 0).all()
    assert (np.diff(result.program.rapids.begin) >= 0).all()


@pytest.fixture
def run(command, tmp_path):
    shutil.copy(SAMPLES / "holes.ngc", tmp_path)
    return command


def test_the_command_line_writes_proves_and_shows(run):
    code, out = run("process", "holes.ngc", "-m", "vmc", "--expand-cycles")
    assert (code, "8 cycles written out" in out) == (0, True)
    code, out = run("verify", "holes.ngc", "holes.jerk.ngc", "-m", "vmc", "--expand-cycles")
    assert (code, "with 8 cycles written out" in out) == (0, True)
    code, out = run("verify", "holes.ngc", "holes.jerk.ngc", "-m", "vmc")
    assert (code, "with 8 cycles written out" in out) == (0, True), "the stamp says it"
    code, out = run("inspect", "holes.ngc", "-m", "vmc", "--expand-cycles")
    assert (code, out.count("rapid inside a")) == (0, 0)
    code, out = run("process", "holes.ngc", "-m", "vmc", "--expand-cycles", "--check")
    assert code == 3


def test_a_table_has_no_cycles(run):
    code, out = run("verify", "holes.ngc", "holes.csv", "-m", "vmc", "--expand-cycles")
    assert (code, "no cycles" in out) == (2, True)


def test_m97_that_the_proof_does_not_follow_is_named():
    text = (
        "%\nO1\nG21 G90 G94 G17 G40 G49 G80 G54 G64\nG0 X0. Y0. Z50.\nG1 X5. F500.\nM97 P9 L2\n"
        "G0 X80.\nM30\nN9 G91 G0 X10.\nG1 X-2.\nG90\nM99\n%\n"
    )
    machine = replace(Machine.load(find_machine("vmc")), controller="haas", dialect="haas")
    made = process(text.encode(), machine, unroll=True)
    assert made.planned == 1
    assert any("M97 (line 6) runs a part" in note for note in made.notes), made.notes


LOOP = "o1 repeat [3]\nG1 X5\nG0 X20\no1 endrepeat\n"
DRILLED = "G0 Z20\nG99 G81 X5 Y5 Z-3 R2\nX15\nG80\n"


@pytest.mark.parametrize("loop", ["", LOOP])
@pytest.mark.parametrize("drilled", ["", DRILLED])
def test_both_may_be_asked_for_where_one_has_nothing_to_do(loop, drilled):
    # With nothing to unroll, cycles beside it ended with a traceback.
    head = "G21 G90 G94 G17 G40 G49 G80 G54 G64 F300\nG0 X0 Y0 Z50\n"
    text = (head + loop + drilled + "G0 X40 Y0 Z50\nM2\n").encode()
    both = process(text, VMC, unroll=True, expand_cycles=True)
    assert b"\no1" not in both.output
    assert b"\nG99 G81" not in both.output
    assert both.verification.confirmed == both.planned > 0
    asked = {"unroll": bool(loop), "expand_cycles": bool(drilled)}
    if not all(asked.values()):
        one = process(text, VMC, **{name: True for name, needed in asked.items() if needed})
        assert both.output.split(b"\n", 2)[2] == one.output.split(b"\n", 2)[2]
        assert [rapid.line for rapid in both.rapids] == [rapid.line for rapid in one.rapids]


CYCLES_OF_HAAS = (
    b"%\nO1234 (PLATE)\nG187 P1\nG21 G90 G94 G17 G40 G49 G80 G54\nG0 X0. Y0.\nG43 H1 Z20.\n"
    b"M3 S900\nG98 G81 X1. Y2. Z-3. R2. F100.\nX30.\nG80\nG0 X5. Y5.\nX40.\nM30\n%\n"
)
LOOP_OF_LINUXCNC = (
    b"G21 G90 G94 G17 G40 G49 G64\nG0 X0 Y0 Z5\nG98 G81 X1 Y2 Z-3 R2 F100\nG80\n#1=1\n"
    b"o1 repeat [3]\nG0 X[#1]\n#1=[#1*8]\no1 endrepeat\nM2\n"
)


@pytest.mark.parametrize(
    ("program", "dialect", "controller", "front"),
    [
        (CYCLES_OF_HAAS, "haas", "haas", Front(cycles=True)),
        (LOOP_OF_LINUXCNC, "linuxcnc", "linuxcnc", Front(unroll=True)),
        (LOOP_OF_LINUXCNC, "linuxcnc", "linuxcnc", Front(cycles=True, unroll=True)),
    ],
)
def test_a_program_tells_its_dialect_before_blocks_are_written_out(
    program, dialect, controller, front
):
    machine = replace(VMC, controller=controller, dialect="auto")
    options = {"expand_cycles": front.cycles, "unroll": front.unroll}
    told = process(program, machine, **options)
    stated = process(program, replace(machine, dialect=dialect), **options)
    assert told.planned > 0
    # The stamp names the machine file, which is another.
    lines, others = (r.output.split(b"\n") for r in (told, stated))
    differ = [a for a, b in zip(lines, others, strict=True) if a != b]
    assert all(b"gcodejerk" in line for line in differ)
    assert told.program.dialect == dialect
    assert any(note.startswith(f"read as {dialect}: ") for note in told.notes)
    found, written = verify_written(
        io.BytesIO(program), io.BytesIO(told.output), machine, front, dialect="auto"
    )
    assert found.ok
    assert written.written > 0


def test_what_several_dialects_read_alike_is_not_written_out():
    machine = replace(VMC, dialect="rs274")
    program = b"G21 G90 G94\nG0 X0 Y0\nG0 X5 Y5\nG1 Z-1 F100\nM2\n"
    for options in ({"expand_cycles": True}, {"unroll": True}):
        with pytest.raises(ProgramError, match=r"<program>.*cannot be written out") as caught:
            process(program, machine, **options)
        assert "--dialect" in caught.value.remedy
