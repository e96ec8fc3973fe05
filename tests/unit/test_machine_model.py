import math
import pickle

import numpy as np
import pytest
import yaml

from gcodejerk.errors import MachineError
from gcodejerk.machine import Limits, Machine, MachineFileError, find_machine

MILL = """\
name: Mill
interval: 0.001
positioning: linear
axes:
  Z:
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
    modes: [{name: rocking, frequency: 30, damping: 0.02}]
  Y:
    rapid: {velocity: 300, acceleration: 2000}
modes: [{name: sway, frequency: 12, damping: 0.05, participation: {Z: 1.0, Y: -0.4}}]
"""


@pytest.fixture
def mill():
    return Machine.loads(MILL, "mill.yaml")


def test_axes_stand_in_the_usual_order_whatever_the_file_says(mill):
    assert mill.axis_names == ("Y", "Z")


def test_axis_is_found_by_its_letter(mill):
    assert mill.axis("Z").rapid == Limits(600.0, 5000.0, 5e5)


def test_an_axis_that_the_machine_lacks_is_named_with_those_it_has(mill):
    with pytest.raises(MachineError, match=r"'Mill' has no axis 'A', it has Y, Z"):
        mill.axis("A")


def test_modes_are_labelled_with_the_axes_that_excite_them(mill):
    assert [(label, mode.name) for label, mode in mill.all_modes()] == [
        ("Z", "rocking"),
        ("Y+Z", "sway"),
    ]


def test_participation_is_found_by_axis_and_zero_elsewhere(mill):
    (sway,) = mill.modes
    assert sway.participation == (("Y", -0.4), ("Z", 1.0))
    assert (sway.participation_of("Y"), sway.participation_of("X")) == (-0.4, 0.0)


def test_machine_can_be_a_key_and_cross_a_process_border(mill):
    assert {mill: 1}[pickle.loads(pickle.dumps(mill))] == 1


def test_settings_hash_has_eight_hex_digits_and_does_not_depend_on_the_file_name(mill):
    assert len(mill.settings_hash) == 8
    int(mill.settings_hash, 16)
    assert Machine.loads(MILL, "copy.yaml").settings_hash == mill.settings_hash


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("frequency: 30", "frequency: 30.000001"),
        ("0.001", "0.002"),
        ("linear", "independent"),
        ("name: Mill", "name: Mull"),
        ("velocity: 300", "velocity: 301"),
    ],
)
def test_settings_hash_changes_with_every_setting(mill, old, new):
    assert Machine.loads(MILL.replace(old, new, 1)).settings_hash != mill.settings_hash


def test_a_mode_without_a_name_is_called_by_its_frequency():
    text = MILL.replace("name: rocking, ", "")
    assert Machine.loads(text).axis("Z").modes[0].name == "30 Hz"


def test_a_machine_without_a_name_is_called_like_its_file():
    assert Machine.loads(MILL.replace("name: Mill\n", ""), "shop/big.yaml").name == "big"


def test_limit_defaults_to_rapid_and_its_jerk_to_ten_times(mill):
    assert mill.axis("Z").limit == Limits(600.0, 5000.0, 5e6)


def test_without_any_jerk_the_limit_is_infinite(mill):
    assert mill.axis("Y").rapid.jerk == mill.axis("Y").limit.jerk == math.inf


def test_each_entry_of_limit_defaults_by_itself():
    text = MILL.replace("acceleration: 2000}", "acceleration: 2000}\n    limit: {jerk: 7.0e+4}")
    assert Machine.loads(text).axis("Y").limit == Limits(300.0, 2000.0, 7e4)


@pytest.mark.parametrize("name", ["vmc", "router", "centre", "drill"])
def test_a_dictionary_is_read_like_the_file_that_holds_it(name):
    path = find_machine(name)
    values = yaml.safe_load(path.read_text())
    assert Machine.from_dict(values, str(path)) == Machine.load(path)


def test_a_dictionary_may_hold_numbers_and_tuples_of_numpy():
    values = yaml.safe_load(MILL)
    values["interval"] = np.float64(0.001)
    values["axes"]["Z"]["modes"] = tuple(values["axes"]["Z"]["modes"])
    assert Machine.from_dict(values) == Machine.loads(MILL)


def test_all_that_is_wrong_with_a_dictionary_is_told_without_lines():
    values = yaml.safe_load(MILL)
    values["axes"]["Z"]["rapid"]["velocity"] = "fast"
    values["interval"] = -1
    with pytest.raises(MachineFileError) as wrong:
        Machine.from_dict(values, "mine")
    assert len(wrong.value.problems) == 2
    assert "mine: axes.Z.rapid.velocity is 'fast'" in str(wrong.value)


def test_what_yaml_cannot_hold_is_no_machine():
    with pytest.raises(MachineError, match="expected what YAML can hold"):
        Machine.from_dict({"interval": object()})


def test_a_machine_is_shown_in_one_short_line(mill):
    assert repr(mill) == "<Machine 'Mill': Y Z, linuxcnc>"
