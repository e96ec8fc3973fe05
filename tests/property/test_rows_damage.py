"""Damage to files of rows is found: by their sum, and without one by what the numbers mean."""

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gcodejerk import Machine, process, verify

AXES = {
    name: {
        "rapid": {"velocity": 500, "acceleration": 4000, "jerk": 120000},
        "limit": {"velocity": 500, "acceleration": 4400, "jerk": 1.5e6},
        "modes": [{"frequency": f, "damping": 0.02}],
    }
    for name, f in (("X", 27.3), ("Y", 41.9))
}
OPTIONS = {
    "counts_per_unit": {"X": 10000, "Y": 10000},
    "fanuc_distance": "general",
    "confirmed": ["acs-pvspline", "pmac-colon"],
    "isx90": 1000,
}
NAMES = {"galil": {"X": "A", "Y": "B"}, "fanuc15": {"X": "1", "Y": "2"}}
PROGRAM = (
    b"G21 G90 G94 G17 G40 G49 G80 G54\nG1 X0. Y0. F600.\nG0 X120.5\nG0 X20. Y-33.3\nG0 Y5.\nM2\n"
)
CONTROLLERS = ("acs", "csp", "csv", "elmo", "fanuc15", "galil", "json", "pmac", "ros2")
MADE = {}


def made(controller, positioning="linear"):
    """A machine and a file of rows, made once."""
    key = controller, positioning
    if key not in MADE:
        names = NAMES.get(controller, {"X": "0", "Y": "1"})
        machine = Machine.from_dict(
            {
                "interval": 0.001,
                "positioning": positioning,
                "controller": controller,
                "axes": AXES,
                "controller_options": OPTIONS | {"axis_names": names},
            }
        )
        form = "pvt" if controller == "csv" else "stream"
        result = process(PROGRAM, machine, form=form)
        assert result.planned == 3
        MADE[key] = machine, result.output
    return MADE[key]


@pytest.mark.parametrize("controller", sorted(set(CONTROLLERS) - {"csv"}))
@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_any_changed_byte_is_found(controller, data):
    machine, output = made(controller)
    at = data.draw(st.integers(0, len(output) - 1))
    new = data.draw(st.integers(0, 255))
    assume(output[at] != new)
    damaged = output[:at] + bytes([new]) + output[at + 1 :]
    # Where it is no file of rows any more, it is no such program either.
    assert not verify(PROGRAM, damaged, machine).ok


@pytest.mark.parametrize("controller", sorted(set(CONTROLLERS) - {"csv"}))
@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_a_cut_file_is_found(controller, data):
    machine, output = made(controller)
    end = data.draw(st.integers(1, len(output) - 1))
    assert not verify(PROGRAM, output[:end], machine).ok


@pytest.mark.parametrize("positioning", ["linear", "independent"])
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_changed_number_of_a_table_is_found(positioning, data):
    """A table has no sum: what is found is what the numbers mean."""
    machine, output = made("csv", positioning)
    header, *rows = output.decode().splitlines()
    k = data.draw(st.integers(0, len(rows) - 1))
    column = data.draw(st.integers(0, len(header.split(",")) - 1))
    row = rows[k].split(",")
    by = data.draw(st.sampled_from([1.0, -1.0])) * data.draw(st.sampled_from([1e-4, 0.01, 3.0]))
    row[column] = f"{float(row[column]) + by:.9f}" if column else str(int(row[0]) + 1)
    assume(column == 0 or row != rows[k].split(","))
    damaged = "\n".join([header, *rows[:k], ",".join(row), *rows[k + 1 :]]) + "\n"
    assert not verify(PROGRAM, damaged.encode(), machine).ok


@pytest.mark.parametrize("positioning", ["linear", "independent"])
@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_rows_that_are_dropped_swapped_or_doubled_are_found(positioning, data):
    machine, output = made("csv", positioning)
    header, *rows = output.decode().splitlines()
    k = data.draw(st.integers(0, len(rows) - 2))
    how = data.draw(st.sampled_from(["drop", "swap", "double"]))
    if how == "drop":
        changed = rows[:k] + rows[k + 1 :]
    elif how == "swap":
        changed = [*rows[:k], rows[k + 1], rows[k], *rows[k + 2 :]]
    else:
        changed = [*rows[: k + 1], *rows[k:]]
    damaged = "\n".join([header, *changed]).encode() + b"\n"
    assert not verify(PROGRAM, damaged, machine).ok


def test_rows_of_another_program_are_found():
    machine, output = made("csv")
    other = PROGRAM.replace(b"X120.5", b"X121.5")
    assert not verify(other, output, machine).ok
    assert not verify(PROGRAM.replace(b"G0 Y5.", b"G1 Y5."), output, machine).ok


def test_rows_for_another_machine_are_found():
    _, output = made("csv")
    axes = {name: axis | {"limit": {"velocity": 90}} for name, axis in AXES.items()}
    slow = Machine.from_dict(
        {"interval": 0.001, "positioning": "linear", "controller": "csv", "axes": axes}
    )
    kinds = {str(v.kind) for v in verify(PROGRAM, output, slow).violations}
    assert "velocity limit" in kinds


# A table without a sum may end behind any rapid.
@pytest.mark.parametrize("controller", sorted(set(CONTROLLERS) - {"csv"}))
def test_a_file_that_ends_behind_any_line_is_found(controller):
    machine, output = made(controller)
    ends = [k + 1 for k, byte in enumerate(output) if byte == ord("\n")]
    for end in ends[:-1][:: max(1, len(ends) // 40)]:
        assert not verify(PROGRAM, output[:end], machine).ok, end
