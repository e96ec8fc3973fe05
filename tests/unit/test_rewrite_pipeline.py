"""The main job on open files: what is copied, what is stamped, what is refused."""

import io

import pytest

from gcodejerk.errors import EmitError, ProgramError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import read_program
from gcodejerk.report.records import process_record
from gcodejerk.rewrite.pipeline import Settings, process, process_file

VMC = Machine.load(find_machine("vmc"))
PROGRAM = b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1.\nG1 X5 F100\nG0 X40\nM2\n"


class Changing(io.BytesIO):
    """A program that another one writes to once it has been read."""

    def __init__(self, data, change):
        super().__init__(data)
        self.change, self.rewinds = change, 0

    def seek(self, offset, whence=io.SEEK_SET):
        if (offset, whence) == (0, io.SEEK_SET):
            self.rewinds += 1
            # For a look at its beginning, one whether it begins again, to be read; then twice more.
            if self.rewinds == 4:
                self.change(self)
        return super().seek(offset, whence)


def append(file):
    file.getbuffer().release()
    end = io.BytesIO.seek(file, 0, io.SEEK_END)
    file.write(b"G0 Z-50\n")
    io.BytesIO.seek(file, end)


def overwrite(file):
    file.getbuffer()[30:31] = b"9"


@pytest.mark.parametrize("change", [append, overwrite])
def test_a_program_that_changes_while_it_is_read_is_refused(change):
    with pytest.raises(EmitError, match="changed while it was being processed"):
        process_file(Changing(PROGRAM, change), io.BytesIO(), VMC, Settings(), "part.nc")


def test_a_program_without_a_certain_rapid_comes_back_byte_for_byte():
    data = b"%\r\n(caf\xe9)\r\nG21 G90\r\nG1 X1 F100\r\nG0 X#1\r\nM2\r\n%"
    result = process(data, VMC)
    assert result.output == data
    assert result.left == 1


def test_the_stamp_stands_behind_the_percent_sign_and_is_found_again():
    output = process(b"%\n" + PROGRAM, VMC).output
    lines = output.splitlines()
    assert lines[0] == b"%"
    assert lines[1].startswith(b"(gcodejerk stamp 0.1.0 ")
    assert all(len(line) < 70 for line in lines if line.startswith(b"("))
    assert read_program(io.BytesIO(output)).stamp == 2
    with pytest.raises(ProgramError, match="processed by gcodejerk before"):
        process(output, VMC)


def test_the_stamp_changes_with_the_settings():
    stamps = {
        process(PROGRAM, VMC, profile=p).output.splitlines()[0] for p in (None, "conventional")
    }
    assert len(stamps) == 2


def test_a_second_run_finds_nothing_that_the_first_has_rewritten():
    once = process(PROGRAM, VMC)
    again = process(once.output, VMC, force=True)
    assert again.planned == 0


def test_comments_can_be_left_out():
    output = process(PROGRAM, VMC, comments=False).output
    assert output.count(b"(gcodejerk") == 1


def test_edits_name_every_byte_that_is_not_the_programs():
    result = process(PROGRAM, VMC)
    kept, at = b"", 0
    for begin, end, _ in result.edits.tolist():
        kept += result.output[at:begin]
        at = end
    kept += result.output[at:]
    assert kept == PROGRAM.replace(b"G0 Z1.\n", b"").replace(b"G0 X40\n", b"")


def test_notes_tell_what_was_assumed():
    result = process(b"G21 G0 X0\nG0 X10\nM2\n", VMC)
    assert result.planned == 1
    assert any("G90" in note for note in result.notes)


def test_a_note_says_what_would_settle_the_unit():
    result = process(b"G0 X0\nG0 X10\nM2\n", VMC)
    assert result.planned == 0
    assert any("G21 or G20" in note and "program.startup" in note for note in result.notes)


def test_independent_positioning_on_linuxcnc_is_noted():
    text = (
        find_machine("vmc").read_text().replace("positioning: linear", "positioning: independent")
    )
    result = process(PROGRAM.replace(b"G0 X40", b"G0 X40 Z20"), Machine.loads(text))
    # The one along X alone; a dogleg is not what LinuxCNC would play.
    assert result.planned == 1
    assert any("straight line" in note for note in result.notes)


def test_a_path_mode_that_nobody_states_is_noted():
    assert not any("G64" in note for note in process(PROGRAM, VMC).notes)
    notes = process(PROGRAM.replace(b" G64", b""), VMC).notes
    (note,) = [note for note in notes if "G64" in note]
    assert note.startswith("line 3: no G61 or G64")


def test_progress_goes_through_all_steps():
    seen = []
    process_file(
        io.BytesIO(PROGRAM), io.BytesIO(), VMC, Settings(), "p", lambda *step: seen.append(step)
    )
    assert [step for step, *_ in dict.fromkeys((s[0],) for s in seen)] == [
        "reading",
        "writing",
        "verifying",
    ]
    assert all(done <= total for _, done, total in seen)


def test_a_result_has_one_record_for_each_rapid():
    result = process(PROGRAM, VMC)
    records = result.rapids
    assert [r.line for r in records] == result.program.rapids.line.tolist()
    assert sum(r.rewritten for r in records) == result.planned > 0
    blocks = [""] * len(records)
    report = process_record(result, VMC, None, blocks)["rapids"]
    assert len(records) == len(report)
    for mine, told in zip(records, report, strict=True):
        for name in ("line", "reason", "profile"):
            assert getattr(mine, name) == told[name]
        assert mine.rewritten == (told["status"] == "planned")
        if mine.rewritten:
            assert mine.time == pytest.approx(told["time"], rel=1e-5)
            left = max(entry["displacement"] for entry in told["residual"])
            today = max(entry["conventional_displacement"] for entry in told["residual"])
            assert mine.residual == pytest.approx(left, rel=1e-4)
            assert mine.conventional_residual == pytest.approx(today, rel=1e-4)
        else:
            assert (mine.time, mine.residual) == (None, None)


def test_results_are_shown_in_one_short_line():
    result = process(PROGRAM, VMC, name="part.ngc")
    count = len(result.plans)
    assert repr(result) == f"<Result part.ngc: {result.planned} of {count} rapids rewritten>"
    assert repr(result.plans) == f"<Plans: {result.planned} of {count} moves, condition3>"
    assert len(repr(result.plans.profiles)) < 80


def test_where_todays_rapid_is_lucky_at_the_file_s_frequencies_it_is_said():
    centre = Machine.load(find_machine("centre"))
    program = b"G21 G90 G94\nG1 X0 Y0 Z50 F900\nG0 X25\nG0 Z2\nM2\n"
    made = process(program, centre)
    lucky = made.rapids[0]
    assert lucky.rewritten
    assert lucky.residual > lucky.conventional_residual
    assert made.rapids[1].residual < made.rapids[1].conventional_residual
    said = [note for note in made.notes if note.startswith("1 rapid leaves more than today's")]
    assert len(said) == 1
    assert "within 5 % of them" in said[0]
    assert made.plans.worst_in_band[0] < 0.98 * made.plans.most_in_band[0]
    assert not any("leaves more" in note for note in process(PROGRAM, VMC).notes)
