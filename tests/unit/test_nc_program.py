"""The program as read: each rapid with its reason, its line end, its modes, its feed."""

import io
import math

import numpy as np
import pytest

from gcodejerk import Machine, find_machine, process, verify
from gcodejerk.axes import AXES
from gcodejerk.errors import ProgramError
from gcodejerk.nc import CERTAIN, DIALECTS, REASONS, Start, read_program, trace
from gcodejerk.reasons import Reason

HEAD = b"G21 G90 G94 G17 G40 G0 X0 Y0 Z0 A0\n"


def read(text, **options):
    return read_program(io.BytesIO(text), **options)


def last(text, start=None):
    """Reason (None: certain) and target of the last rapid behind a plain head."""
    rapids = read(HEAD + text, start=start or Start()).rapids
    reason = int(rapids.reason[-1])
    return None if reason == CERTAIN else REASONS[reason], rapids.target[-1]


def end(text, start=None):
    """Positions X, Y, Z behind a plain head."""
    *_, (_, positions, _) = trace(io.BytesIO(HEAD + text), start=start or Start())
    return [None if math.isnan(p) else round(p, 9) for p in positions[:3]]


def test_rapid_after_g91_moves_by_increments():
    assert end(b"G0 X10 Y5\nG91 X2\nX3 Y-1\n") == [15, 4, 0]


def test_positions_are_kept_in_mm_whatever_the_unit():
    assert end(b"G20 X1\nG21 Y1\n") == [25.4, 1, 0]


def test_x_is_halved_under_diameter():
    assert end(b"G7 X10\nG91 X4\nG8 X1\n") == [8, 0, 0]


def test_a_cycle_along_a_diameter_returns_to_an_unknown_place():
    # LinuxCNC 2.9 halves X and the depth, not R: measured.
    assert end(b"G7 G19 G0 X-1\nG99 G81 Z-0.5 X-15 R2 F9\nG80\n")[0] is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b"G0 X1\n", None),
        (b"X1 (from G0 in force)\n", None),
        (b"G0 X1 M3 S100 F200 G91 G64 P0.1\n", None),
        (b"M2\nG0 X1\n", Reason.AFTER_END),
        (b"/G0 X1\n", Reason.BLOCK_DELETE),
        (b"o1 if [#1]\nG0 X1\n", Reason.SUBPROGRAM),
        (b"G0 X1 X2\n", Reason.NOT_UNDERSTOOD),
        (b"G0 G1 X1\n", Reason.NOT_UNDERSTOOD),
        (b"G0 X1 (no end\n", Reason.NOT_UNDERSTOOD),
        (b"G0 X1 P5\n", Reason.NOT_UNDERSTOOD),
        (b"G0 X#1\n", Reason.EXPRESSION),
        (b"#1=2 G0 X1\n", Reason.EXPRESSION),
        (b"G81 X1 Z-1 R1 F100\n", Reason.CANNED_CYCLE),
        (b"G53 X1\n", Reason.FRAME_CHANGE),
        (b"G28\n", Reason.FRAME_CHANGE),
        (b"G30 X1\n", Reason.FRAME_CHANGE),
        (b"G43 H1 Z1\n", Reason.FRAME_CHANGE),
        (b"G54 X1\n", Reason.FRAME_CHANGE),
        (b"G41 D1 X1\n", Reason.CUTTER_COMPENSATION),
        (b"G10 L2 P1 R30\nG0 X1 Y1\nX2 Y2\n", Reason.ROTATION),
        (b"X0\n", Reason.NO_MOTION),
        (b"M98 P1\nG21 G0 G40 X1\n", Reason.DISTANCE_MODE_UNKNOWN),
        (b"M98 P1\nG90 G0 G40 X1\n", Reason.UNITS_UNKNOWN),
        (b"M6 T1\nG0 Z5\n", Reason.START_UNKNOWN),
        (b"G0 X1 M6 T1\n", Reason.START_UNKNOWN),
        (b"G0 X1 M64 P1\n", Reason.OTHER_WORDS),
        (b"G0 X1\nG1 X2\n", Reason.FEED_UNKNOWN),
        (b"F100\nG0 X1\nG1 X2\n", None),
        (b"G0 X1\nG1 X2 F5\n", None),
    ],
    ids=lambda value: value.decode().strip() if isinstance(value, bytes) else str(value),
)
def test_reason(text, reason):
    assert last(text)[0] == reason


def test_bare_g0_is_no_rapid():
    assert len(read(b"G21 G90\nG0\nM2\n").rapids) == 0


def test_line_that_is_not_understood_is_found_with_its_column():
    finding = read(HEAD + b"N120 G0 X10 Y4..2\nM2\n").findings[0]
    assert (finding.line, finding.place.column) == (2, 14)
    assert "'4..2' is not a number" in finding.message


def test_tool_change_leaves_no_position_known():
    assert end(b"T1 M6\n") == [None, None, None]


def test_axis_named_absolutely_is_known_again():
    assert end(b"T1 M6\nG0 Z5\n") == [None, None, 5]


def test_increment_from_an_unknown_position_stays_unknown():
    assert end(b"T1 M6\nG91 G0 Z5\n") == [None, None, None]


def test_loop_of_unknown_length_leaves_only_what_it_names_unknown():
    assert end(b"G1 X3 F100\nT1 G90\no1 while [#1]\nG21 #2=3\no1 endwhile\n") == [3, 0, 0]
    text = b"o1 repeat [#1]\nG17 G40 G90 G21 G0 X1\no1 endrepeat\n"
    assert end(text) == [None, 0, 0]


def test_subprogram_runs_where_it_is_called():
    body = b"o1 sub\nG0 X5\no1 endsub\n"
    assert end(body) == [0, 0, 0]
    assert end(body + b"o1 call\n") == [5, 0, 0]
    assert end(b"o1 call\n") == [None, None, None]


def test_block_delete_keeps_what_both_cases_share():
    assert end(b"/G0 X5 Y0\n") == [None, 0, 0]


def test_cutter_compensation_leaves_its_plane_unknown_until_restated():
    assert end(b"G41 D1\nG1 X5 Y5 Z5 F1\nG40\n") == [None, None, 5]
    assert end(b"G41 D1\nG1 X5 Y5 Z5 F1\nG40\nG0 X1\n") == [1, None, 5]


def test_g92_names_the_position():
    assert end(b"G0 X5\nG92 X1\nG0 Y7\n") == [1, 7, 0]


def test_g92_cancelled_is_known_only_if_the_start_was_stated():
    assert end(b"G0 X5\nG92 X1\nG92.1\n") == [None, None, None]
    known = Start(positions=dict.fromkeys(AXES, 0.0))
    assert end(b"G0 X5\nG92 X1\nG92.1\n", known) == [5, 0, 0]


def test_known_tool_length_shifts_z():
    known = Start(positions={"Z": 0.0}, tool_lengths={1: 12.5})
    assert end(b"G0 Z20\nG43 H1\n", known)[2] == 7.5
    assert end(b"G0 Z20\nG43 H2\n", known)[2] is None


def test_g43_1_takes_the_axis_words_from_the_motion():
    assert end(b"G0 Z20\nG43.1 Z5\n")[2] is None


def test_known_offsets_turn_g53_into_a_program_position():
    known = Start(positions={"X": 0.0}, offsets={"G54": {"X": 100.0}, "G55": {"X": 40.0}})
    assert end(b"G53 G0 X110\n", known)[0] == 10
    assert end(b"G0 X5\nG55\n", known)[0] == 65
    rapids = read(HEAD + b"G0 X5\n", start=known).rapids
    assert rapids.offset[-1, 0] == 100
    assert math.isnan(rapids.offset[-1, 1])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"G0 Z10\nG98 G81 X1 Y1 Z-1 R2 F9\n", [1, 1, 10]),
        (b"G0 Z10\nG99 G81 X1 Y1 Z-1 R2 F9\nX5\n", [5, 1, 2]),
        (b"G0 Z10\nG99 G81 X1 Y1 Z-1 R2 F9\nG98 X2\n", [2, 1, 10]),
        (b"G0 Z10\nG98 G81 X1 Y1 Z-1 R12 F9\n", [1, 1, 12]),
        (b"G0 Z10\nG91 G98 G81 X1 Y1 Z-1 R-5 L3 F9\n", [3, 3, 10]),
        (b"G0 Y10\nG18 G98 G81 X1 Y-1 R2 F9\n", [1, 10, 0]),
        (b"G0 Z10\nG81 X1 Y1 Z-1 R2 F9\n", [1, 1, None]),
    ],
)
def test_cycle_ends_at_r_or_where_the_series_began(text, expected):
    assert end(text) == expected


def test_axis_words_after_g80_are_not_understood():
    assert end(b"G80\nX3\n")[0] is None


def test_feed_is_forgotten_with_its_unit_and_its_mode():
    for change in (b"G20", b"G93", b"G95"):
        rapids = read(HEAD + b"F100\n" + change + b"\nG0 X1\n").rapids
        assert math.isnan(rapids.feed[-1])


def test_columns_of_a_rapid_tell_what_is_in_force_after_its_block():
    rapids = read(b"G20 G64 P0.01 Q0.02\nG91 G0 X1 F7 G93\r\nG1 X1 F1\n").rapids
    assert rapids.inch[0]
    assert rapids.incremental[0]
    assert rapids.distance_stated[0]
    assert (rapids.feed_mode[0], rapids.feed[0], rapids.path[0]) == (93, 7, 64)
    assert (rapids.path_p[0], rapids.path_q[0]) == (0.01, 0.02)
    assert rapids.terminator[0] == 2
    assert rapids.words[0] == 1


def test_exact_stop_is_path_62():
    assert read(HEAD + b"G61.1 G0 X1\n").rapids.path[-1] == 62


def test_startup_codes_count_as_stated():
    program = read(b"G0 X1\nX2\nM2\n", start=Start(startup="G21 G90 G94 G64 P0.01"))
    assert program.findings == ()
    assert program.rapids.distance_stated.all()


def test_assumed_distance_and_feed_modes_are_found():
    distance, feed = read(b"G21 G0 X1\nX2\nM2\n").findings
    assert (distance.line, "G90 is assumed" in distance.message) == (2, True)
    assert (feed.line, "G94 is assumed" in feed.message) == (2, True)
    # Of what a mill of Fanuc's begins in nothing is assumed, and the rapid is left alone for it.
    told = read_program(io.BytesIO(b"G90 G21 G0 X0.\nX1.\nG1 X2. F9.\n"), dialect="fanuc").findings
    assert not [each for each in told if "is assumed" in each.message]


@pytest.mark.parametrize("fast", [True, False])
def test_a_unit_that_nobody_stated_is_not_guessed(fast):
    program = read(b"G90 G0 X1\nX2\n" + b"X3\nX4\n" * 30 + b"M2\n", fast=fast)
    assert {REASONS[r] for r in program.rapids.reason.tolist()} == {Reason.UNITS_UNKNOWN}
    (finding,) = program.findings
    assert finding.line == 1
    assert "program.startup" in finding.message
    assert "G21 or G20" in finding.message


def test_the_user_may_say_what_the_unit_is():
    rapids = read(b"G0 X1\nX2\n", start=Start(startup="G20")).rapids
    assert rapids.target[-1, 0] == pytest.approx(50.8)


def test_percent_opens_and_closes_a_program():
    program = read(b"%\r\nG21 G90 G0 X1\r\nX2\r\n%\r\nG0 X3\r\n")
    assert program.insert_at == 3
    assert program.newline == b"\r\n"
    assert REASONS[program.rapids.reason[-1]] is Reason.AFTER_END


def test_stamp_is_found_only_in_a_comment():
    assert read(b"G21\n(gcodejerk stamp 1)\nM2\n").stamp == 2
    assert read(b"G21\n; GCODEJERK STAMP 1\nM2\n").stamp == 2
    assert read(b"G21\n(see gcodejerk stamp)\nM2\n").stamp is None


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "is empty"),
        (b"G0 X1\0\n", "0x00"),
        (b"\xff\xfeG\x000\x00", "UTF-16"),
        (b"G\x000\x00 \x00X\x001\x00\n\x00", "UTF-16"),
        (b"G0 X1\n" + b"X1" * 40_000, "more than 65536 bytes"),
        (b"G0 X1\n" + b"X1" * 40_000 + b"\nM2\n", "more than 65536 bytes"),
    ],
)
def test_what_is_no_program_is_refused(data, message):
    with pytest.raises(ProgramError, match=message) as caught:
        read(data, name="part.nc")
    assert caught.value.place.file == "part.nc"
    assert caught.value.remedy


def test_endless_line_is_refused_without_reading_it_all():
    class Endless(io.RawIOBase):
        given = 0

        def read(self, size=-1):
            self.given += size
            return b"x" * size

    file = Endless()
    with pytest.raises(ProgramError, match="bytes"):
        read_program(file)
    assert file.given < 2_000_000


def test_numbers_beyond_any_machine_are_not_understood():
    assert last(b"G0 X1000000000000\n")[0] is Reason.NOT_UNDERSTOOD


@pytest.mark.parametrize("block", [b"G0 X1 M90 M3\n", b"G0 X1 M3 M90\n"])
def test_an_unknown_m_word_beside_a_known_one_is_found(block):
    assert any("does not know" in f.message for f in read(HEAD + block).findings)


@pytest.mark.parametrize(
    "words", ["M600 M3", "M3 M600", "M999 M6 M5", "M1.5 M30", "M-1 M8", "G999 M3"]
)
def test_a_code_beside_one_that_is_not_known_is_no_way_out(words):
    program = read_program(io.BytesIO(f"G21 G90 G0 X0\n{words}\nG0 X5\nM2\n".encode()))
    assert program.rapids.reason[-1] != CERTAIN
    assert any("not know" in f.message or "refuse" in f.message for f in program.findings)


def test_code_that_is_no_number_leaves_its_mode_unknown():
    assert last(b"G9..1 X1\nG0 X5\n")[0] is Reason.NOT_UNDERSTOOD


def test_progress_tells_the_bytes_read():
    told = []
    data = HEAD + b"X1 Y1\n" * 200_000
    program = read(data, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == program.size == len(data)
    assert len(told) > 1


def test_chunks_cut_anywhere_give_the_same_rapids(monkeypatch):
    data = HEAD + b"".join(b"G0 X%d\r\nG1 Z-1 F9\nY%d (c)\n" % (k, k) for k in range(300))
    whole = read(data).rapids
    monkeypatch.setattr("gcodejerk.nc.text.chunks.CHUNK", 777)
    parts = read(data).rapids
    for name in ("line", "begin", "end", "terminator", "reason", "target", "feed_needed"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))


def test_plane_that_has_no_axes_here_is_no_bug():
    text = b"%X G71 *\nG20 G90 *\nG2 X1 Y1 R5 *\nG0 X1 *\nG41 X2 *\nG0 Y5 *\n"
    rapids = read(text, dialect="heidenhain-iso").rapids
    assert not (rapids.reason == CERTAIN).any()


@pytest.mark.parametrize(
    "lines",
    [
        # K0 stores the cycle and drills nothing; every position that follows drills.
        b"G81 X1. Y1. Z-5. R2. F100 K0\n",
        b"G81 X1. Y1. Z-5. R9.\nG20\n",
        b"G81 X1. Y1. Z5. R2.\n",
        b"/G81 X1. Y1. Z-5. R2.\n",
        b"G81 X1. Y1. Z-5. R2.\nX1. X2.\n",
    ],
)
def test_a_cycle_that_may_be_in_force_makes_no_position_a_rapid(lines):
    data = b"G21 G90 G17 G94 G64 F100\nG0 X0. Y0. Z9.\n" + lines + b"X5. Y5.\nX6.\nX7. Y9.\nM30\n"
    rapids = read_program(io.BytesIO(data), dialect="fanuc", start=Start()).rapids
    later = rapids.line > 2 + lines.count(b"\n")
    assert not (later & (rapids.reason == CERTAIN)).any()


@pytest.mark.parametrize("word", [b"G" + b"9" * 400, b"M" + b"9" * 3999, b"G1." + b"0" * 3999])
@pytest.mark.parametrize("dialect", sorted(set(DIALECTS) - {"klartext"}))
@pytest.mark.parametrize("after", [b"", b"M99\n"])
def test_code_of_more_digits_than_a_number_has_is_a_block_that_is_not_understood(
    word, dialect, after
):
    """With M99 the whole program is looked through for what the last pass may have left on."""
    program = b"G21 G90\nG0 X0. Y0.\nG1 X1. F9.\n? %s\nG0 X5.\n%s" % (word, after)
    machine = Machine.load(find_machine("vmc"))
    result = process(program, machine, dialect=dialect)
    assert result.planned == 0
    assert verify(program, result.output, machine, dialect=dialect).ok


@pytest.mark.parametrize("front", [0, 37, 99, 100, 250_000])
@pytest.mark.parametrize("end", [b"", b"\n", b"\nG0 X5\n"])
def test_a_number_without_end_is_refused_with_its_place(front, end):
    lines = b"G1 X1\n" * (front // 6) + b" " * (front % 6)
    read(lines + b"N" + b"1" * 3999 + b" X2" + end)
    with pytest.raises(ProgramError, match="4000 digits") as caught:
        read(lines + b"N" + b"1" * 4000 + b" X2" + end)
    place = caught.value.place
    assert (place.line, place.column) == (front // 6 + 1, front % 6 + 2)
    with pytest.raises(ProgramError, match="4000 digits"):
        read(lines + b"1" * 4000)
