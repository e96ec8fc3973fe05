"""Controller `csv`: one row an interval, the ends as the program gives them."""

import csv
import io

import pytest

from gcodejerk import Machine, plan_move, process, verify

MACHINE = Machine.loads(
    """
interval: 0.002
positioning: linear
axes:
  X:
    resolution: 0.001
    rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 22, damping: 0.02}]
  Z:
    resolution: 0.001
    rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 30, damping: 0.02}]
  A:
    wrap: none
    resolution: 0.01
    rapid: {velocity: 90, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 30, damping: 0.02, participation: 1}]
"""
)


def table(program, machine=MACHINE):
    """The header and the rows of each block's stream, as text."""
    result = process(program, machine, controller="csv")
    header, *rows = csv.reader(io.StringIO(result.output.decode()))
    blocks = {}
    for row in rows:
        blocks.setdefault(int(row[0]), []).append(row[1:])
    return header, blocks, result


def test_the_header_names_the_machine_s_axes():
    assert table(b"G21 G90 G94\nG1 X0 Z0 A0 F9\nG0 X3\n")[0] == ["block", "t", "X", "Z", "A"]


def test_there_is_one_row_an_interval_from_zero_to_the_time():
    _, blocks, result = table(b"G21 G90 G94\n\nG1 X0 Z0 A0 F9\nG0 X3.5 Z-7\nG1 X4\nX5\nG0 A40\n")
    assert sorted(blocks) == [4, 7]
    for rows, count in zip(blocks.values(), result.plans.counts, strict=True):
        assert [float(row[0]) for row in rows] == pytest.approx(
            [k * 0.002 for k in range(count + 1)]
        )
        assert rows[0][0] == "0"


def test_the_first_and_the_last_row_are_the_program_s_own_numbers():
    _, blocks, _ = table(
        b"G21 G90 G94\nG1 X0.1234567 Z-.00005 A0 F9\nG0 X9.87654321 Z2 A-33.333333\n"
    )
    first, *inner, last = blocks[3]
    assert first[1:] == ["0.1234567", "-0.00005", "0.00"]
    assert last[1:] == ["9.87654321", "2.000", "-33.333333"]
    for row in inner:
        assert [len(x.split(".")[1]) for x in row[1:]] == [3, 3, 2]


def test_an_axis_that_stands_keeps_its_position_and_an_unknown_one_is_nan():
    _, blocks, _ = table(b"G21 G90 G94\nG1 X0 Z1.23456 F9\nG0 X3\n")
    assert {row[2] for row in blocks[3]} == {"1.23456"}
    assert {row[3] for row in blocks[3]} == {"nan"}


def test_inches_and_increments_become_positions_in_mm():
    _, blocks, _ = table(b"G20 G91 G94\nG90 G1 X1 Z0 A0 F9\nG91 G0 X-.5 Z.1\nZ.1\n")
    assert float(blocks[3][0][1]) == 25.4
    assert [float(x) for x in blocks[3][-1][1:3]] == pytest.approx([12.7, 2.54])
    assert [float(x) for x in blocks[4][-1][1:3]] == pytest.approx([12.7, 5.08])


def test_the_rows_are_the_planned_positions():
    _, blocks, _ = table(b"G21 G90 G94\nG1 X0 Z0 A0 F9\nG0 X12.5 Z-5\n")
    plan = plan_move({"X": 12.5, "Z": -5.0}, MACHINE)
    for k, axis in ((1, "X"), (2, "Z")):
        assert [float(row[k]) for row in blocks[3]] == pytest.approx(
            plan.positions[axis].tolist(), abs=1e-9
        )


def test_a_short_move_of_few_steps_has_more_decimals():
    _, blocks, _ = table(b"G21 G90 G94\nG1 X0 Z0 A0 F9\nG0 X20 Z0.005\n")
    z = [row[2] for row in blocks[3]]
    assert z[0] == "0.000"
    assert z[-1] == "0.005"
    assert {len(x.split(".")[1]) for x in z[1:-1]} == {6}


def test_a_program_without_rapids_gives_the_header_alone():
    assert process(b"G21 G90\nM2\n", MACHINE, controller="csv").output == b"block,t,X,Z,A\n"


def test_a_diameter_is_written_as_a_radius():
    lathe = Machine.loads(
        "interval: 0.002\npositioning: linear\naxes:\n"
        "  X: {diameter: true, resolution: 0.001, "
        "rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}, "
        "modes: [{frequency: 30, damping: 0.02}]}\n"
    )
    _, blocks, _ = table(b"G21 G90 G94 G7\nG1 X10 F9\nG0 X30\n", lathe)
    assert [float(blocks[3][k][1]) for k in (0, -1)] == [5.0, 15.0]


def test_the_library_verifies_what_it_wrote_from_bytes_and_from_a_file_of_any_name(tmp_path):
    program = b"G21 G90 G94\nG1 X0 Z0 A0 F9\nG0 X3\nG0 Z5\nM2\n"
    output = process(program, MACHINE, controller="csv").output
    found = verify(program, output, MACHINE, controller="csv")
    assert (found.ok, found.rewritten, found.confirmed) == (True, 2, 2)
    (tmp_path / "table.txt").write_bytes(output)
    assert verify(program, tmp_path / "table.txt", MACHINE).rewritten == 2
    rows = output.splitlines(keepends=True)
    damaged = verify(program, b"".join(rows[:20] + rows[21:]), MACHINE)
    assert [str(one.kind) for one in damaged.violations] == ["duration"]


@pytest.mark.parametrize(
    ("dialect", "program", "reason"),
    [
        ("linuxcnc", b"G21 G90 G94 G64\nG0 X0 Z0\nG0 X3\nG1 Z-1\nM2\n", "feed to restore unknown"),
        (
            "siemens",
            b"G71 G90 G94 G64 F500\nG1 X0 Z0\nG0 X3\nM30\n",
            "unit of F unknown, or not that of lengths",
        ),
        (
            "fanuc",
            b"G21 G90 G94 G64 G40 G49 G69 G15\nG0 X0. Z0. A0.\nG0 X9. A40.\nM30\n",
            "linear and rotary axes move together",
        ),
    ],
)
def test_what_f_means_is_asked_for_streams_in_the_program_alone(dialect, program, reason):
    in_place = process(program, MACHINE, controller="fanuc", dialect=dialect)
    lost = [rapid.reason for rapid in in_place.rapids].count(reason)
    assert lost > 0
    result = process(program, MACHINE, controller="csv", dialect=dialect)
    assert result.planned == in_place.planned + lost
    assert result.verification.ok
    assert result.verification.confirmed == result.planned
    assert verify(program, result.output, MACHINE, dialect=dialect, controller="csv").ok
