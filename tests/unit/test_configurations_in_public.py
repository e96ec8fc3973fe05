"""Configurations as they are found in public: what their own firmware makes of them."""

import re

import numpy as np
import pytest

from gcodejerk.errors import MachineError
from gcodejerk.machine import Machine
from gcodejerk.machine.sources import draft_of, recognise, text_of

REPORT = "echo:  M203 X300.00 Y200.00 Z5.00\necho:  M201 X3000 Y2000 Z100\n"
CONFIG_G = 'M550 P"Duet"\nM584 X0 Y1 Z2\nM203 X12000 Y6000 Z600\nM201 X3000 Y2000 Z100\n'


def made(folder, text, name, **beside):
    (folder / name).write_text(text)
    for other, content in beside.items():
        (folder / other.replace("__", ".")).write_text(content)
    draft = draft_of([str(folder / name)], folder)
    draft.settle()
    return Machine.loads(text_of(draft), str(folder / "new.yaml")), " ".join(draft.notes)


def rapid(machine, axis="X"):
    own = machine.axis(axis).rapid
    return own.velocity, own.acceleration


PRINTER = "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 3000\n"


def test_what_klipper_includes_behind_a_value_replaces_it(tmp_path):
    machine, _ = made(
        tmp_path, PRINTER + "[include own.cfg]\n", "printer.cfg",
        own__cfg="[printer]\nmax_accel: 8000\n",
    )  # fmt: skip
    assert rapid(machine) == (300.0, 8000.0)


def test_what_klipper_includes_in_front_of_a_value_gives_way(tmp_path):
    machine, _ = made(
        tmp_path, "[include own.cfg]\n" + PRINTER, "printer.cfg",
        own__cfg="[printer]\nmax_accel: 8000\n",
    )  # fmt: skip
    assert rapid(machine) == (300.0, 3000.0)


def test_a_comment_of_klipper_needs_no_blank_in_front(tmp_path):
    machine, _ = made(tmp_path, PRINTER.replace("3000", "3000#or more"), "printer.cfg")
    assert rapid(machine) == (300.0, 3000.0)


def test_includes_are_found_in_a_folder_whose_name_has_brackets(tmp_path):
    folder = tmp_path / "voron [2.4]"
    folder.mkdir()
    machine, notes = made(
        folder, PRINTER + "[include own*.cfg]\n", "printer.cfg",
        own__cfg="[printer]\nmax_accel: 8000\n",
    )  # fmt: skip
    assert rapid(machine) == (300.0, 8000.0)
    assert "not found" not in notes


def test_kalicos_limited_kinematics_have_limits_of_each_axis(tmp_path):
    text = PRINTER.replace("corexy", "limited_cartesian")
    machine, _ = made(tmp_path, text + "max_x_accel: 2000\nmax_y_velocity: 100\n", "printer.cfg")
    assert rapid(machine) == (300.0, 2000.0)
    assert rapid(machine, "Y") == (100.0, 3000.0)


def test_t_of_an_m204_without_p_is_that_of_retracts(tmp_path):
    machine, _ = made(tmp_path, REPORT + "echo:  M204 S500.00 T3000.00\n", "m503.txt")
    assert rapid(machine) == (300.0, 500.0)


def test_t_of_an_m204_with_p_is_that_of_travel(tmp_path):
    machine, _ = made(tmp_path, REPORT + "echo:  M204 P500.00 R800.00 T1000.00\n", "m503.txt")
    assert rapid(machine) == (300.0, 1000.0)


def test_a_report_with_limits_of_normal_and_stealth_mode_is_refused(tmp_path):
    text = (
        "echo:Maximum feedrates - normal (mm/s):\necho:  M203 X200.00 Y200.00 Z12.00\n"
        "echo:Maximum feedrates - stealth (mm/s):\necho:  M203 X100.00 Y100.00 Z12.00\n"
        "echo:  M201 X1000 Y1000 Z200\n"
    )
    with pytest.raises(MachineError, match="normal and for stealth") as refused:
        made(tmp_path, text, "m503.txt")
    assert refused.value.place.line == 3


@pytest.mark.parametrize("front", ["22:24:55.040 : ", "Recv: ", "16:42:55.538 > ", "log: -> "])
def test_a_report_in_a_terminals_own_lines(tmp_path, front):
    text = "".join(f"{front}{line}\n" for line in REPORT.splitlines())
    assert rapid(made(tmp_path, text, "m503.txt")[0]) == (300.0, 3000.0)


def test_ft_motion_that_is_on_is_said(tmp_path):
    assert "FT motion" in made(tmp_path, REPORT + "echo:  M493 S1 D0 X1 A40\n", "m503.txt")[1]
    assert "FT motion" not in made(tmp_path, REPORT + "echo:  M493 S0\n", "m503.txt")[1]


def test_a_report_in_inches_says_what_to_send(tmp_path):
    with pytest.raises(MachineError, match="inches") as refused:
        made(tmp_path, "echo:  G20 ; (in)\n" + REPORT, "m503.txt")
    assert "G21" in refused.value.remedy
    assert "M149" not in refused.value.remedy


def test_m201_1_is_another_code_than_m201(tmp_path):
    machine, _ = made(tmp_path, CONFIG_G + "M201.1 X500 Y500 Z50\n", "config.g")
    assert rapid(machine) == (200.0, 3000.0)


def test_s_of_a_duets_m204_counts_for_travel_too(tmp_path):
    assert rapid(made(tmp_path, CONFIG_G + "M204 S900\n", "config.g")[0]) == (200.0, 900.0)
    assert rapid(made(tmp_path, CONFIG_G + "M204 P500 T900\n", "config.g")[0]) == (200.0, 900.0)


def test_an_expression_in_config_g_is_no_number(tmp_path):
    with pytest.raises(MachineError, match=r"\{global\.speed\}") as refused:
        made(tmp_path, CONFIG_G + "M203 X{global.speed}\n", "config.g")
    assert refused.value.place.line == 5


def test_an_axis_that_m584_makes_turn_is_no_axis_in_mm(tmp_path):
    text = CONFIG_G + "M584 U3 R1\nM203 U3600\nM201 U500\n"
    machine, notes = made(tmp_path, text, "config.g")
    assert "U" not in machine.axis_names
    assert "U turns by M584" in notes


def test_files_that_config_g_calls_are_said(tmp_path):
    _, notes = made(tmp_path, CONFIG_G + 'M98 P"speeds.g"\n', "config.g")
    assert "config.g:5: speeds.g is called, and not read" in notes


def test_limits_below_a_condition_are_said(tmp_path):
    text = CONFIG_G + "if exists(global.fast)\n  ; more\n  M203 X18000\n"
    machine, notes = made(tmp_path, text, "config.g")
    assert rapid(machine) == (300.0, 3000.0)
    assert "config.g:7: M203 stands below 'if exists(global.fast)' of line 5" in notes


def test_a_shaper_of_rrf_that_no_machine_file_holds_is_said(tmp_path):
    assert "dynamic acceleration" in made(tmp_path, CONFIG_G + "M593 F50\n", "config.g")[1]
    assert "'custom'" in made(tmp_path, CONFIG_G + 'M593 P"custom" F50\n', "config.g")[1]
    assert "M593" not in made(tmp_path, CONFIG_G + 'M593 P"none" F50\n', "config.g")[1]


def test_an_ini_of_nothing_but_includes_is_linuxcncs(tmp_path):
    axis = "[AXIS_X]\nMAX_VELOCITY = 50\nMAX_ACCELERATION = 500\n"
    base = "[TRAJ]\nCOORDINATES = X\nLINEAR_UNITS = mm\n"
    assert recognise("#INCLUDE base.inc\n") == "linuxcnc"
    machine, _ = made(
        tmp_path, "[DISPLAY]\nDISPLAY = axis\n#INCLUDE base.inc\n", "mill.ini",
        base__inc=base + axis,
    )  # fmt: skip
    assert rapid(machine) == (50.0, 500.0)


def test_an_ini_of_linuxcnc_2_7_names_its_converter(tmp_path):
    text = (
        "[TRAJ]\nCOORDINATES = X Y\nLINEAR_UNITS = mm\n[AXIS_0]\nMAX_VELOCITY = 50\n"
        "MAX_ACCELERATION = 500\n"
    )
    with pytest.raises(MachineError, match=r"\[AXIS_0\]") as refused:
        made(tmp_path, text, "mill.ini")
    assert "update_ini" in refused.value.remedy
    assert refused.value.place.line == 5


def test_what_is_missing_of_an_axis_that_turns_is_asked_for_in_degrees(tmp_path):
    text = (
        "[TRAJ]\nCOORDINATES = X A\nLINEAR_UNITS = mm\n[AXIS_X]\nMAX_VELOCITY = 50\n"
        "MAX_ACCELERATION = 500\n"
    )
    with pytest.raises(MachineError, match="velocity of A") as refused:
        made(tmp_path, text, "mill.ini")
    assert "'A velocity=3600deg/min acceleration=200deg/s^2'" in refused.value.remedy


def test_fluidncs_other_kinematics_are_said(tmp_path):
    axes = "axes:\n  x:\n    max_rate_mm_per_min: 5000\n    acceleration_mm_per_sec2: 200\n"
    assert "corexy" in made(tmp_path, "kinematics:\n  corexy:\n" + axes, "a.yaml")[1]
    assert "kinematics" not in made(tmp_path, "kinematics:\n  Cartesian:\n" + axes, "b.yaml")[1]


@pytest.mark.parametrize(
    ("line", "said"),
    [("", "0.5 (Klipper's own): short rapids take up to 6 %"),
     ("minimum_cruise_ratio: 0.8\n", "0.8: short rapids take up to 34 %"),
     ("minimum_cruise_ratio: 0\n", None),
     ("max_accel_to_decel: 600\n", "max_accel_to_decel is 600: short rapids take up to 34 %"),
     ("max_accel_to_decel: 600\nminimum_cruise_ratio: 0.5\n", "ratio is 0.5: short rapids"),
     ("max_accel_to_decel: 3000\n", None),
     ("max_accel_to_decel: 9000\n", None)],
)  # fmt: skip
def test_klippers_cruise_ratio_is_said(tmp_path, line, said):
    _, notes = made(tmp_path, PRINTER + line, "printer.cfg")
    assert (said in notes) if said else ("short rapids" not in notes)
    if said and "to_decel is" in said:
        assert "set it to max_accel (SET_VELOCITY_LIMIT ACCEL_TO_DECEL=3000)" in notes


def alone(length, speed, acceleration, ratio):
    """Time of one move of Klipper's from rest to rest, by the squares of speeds that it plans with.

    Both passes of its look-ahead over a single move: what it may gain and lose is 2 d a, and of a
    second budget, 2 d a (1 - r), the half bounds the peak.
    """
    gain, slower = 2.0 * length * acceleration, 2.0 * length * acceleration * (1.0 - ratio)
    peak = min(speed**2, (0.0 + gain) / 2.0, (0.0 + slower) / 2.0)
    ramps = peak / (2.0 * acceleration)
    assert length - 2.0 * ramps >= (ratio - 1e-12) * length
    return 2.0 * ramps / (peak**0.5 / 2.0) + (length - 2.0 * ramps) / peak**0.5


@pytest.mark.parametrize("ratio", [0.1, 0.37, 0.5, 0.8, 0.95])
def test_what_klippers_cruise_ratio_costs_is_what_its_look_ahead_makes_of_a_move(tmp_path, ratio):
    _, notes = made(tmp_path, f"{PRINTER}minimum_cruise_ratio: {ratio}\n", "printer.cfg")
    said = float(re.search(r"up to (\d+) % longer", notes)[1])
    longer = [
        alone(length, 300.0, 3000.0, ratio) / alone(length, 300.0, 3000.0, 0.0) - 1.0
        for length in np.geomspace(0.01, 3000.0, 400)
    ]
    assert 100.0 * max(longer) == pytest.approx(said, abs=0.5)
    assert longer[0] == pytest.approx(max(longer))
    assert longer[-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("number", ["1e3", "5,000", "5000,0", "nan", ""])
def test_a_setting_of_grbl_is_a_whole_number_or_none(tmp_path, number):
    with pytest.raises(MachineError, match=r"\$110 is ") as refused:
        made(tmp_path, f"$100=80\n$110={number}\n$120=500\n", "dump.txt")
    assert refused.value.place.line == 2


@pytest.mark.parametrize("number", ["0", "-5"])
def test_a_rate_of_grbl_that_stands_still_is_refused_by_its_line(tmp_path, number):
    with pytest.raises(MachineError, match=rf"\$120 is {number}, expected") as refused:
        made(tmp_path, f"$110=5000\n$120={number}\n", "dump.txt")
    assert refused.value.place.line == 2


def test_settings_of_grbl_that_are_no_numbers_do_not_matter(tmp_path):
    text = "$74=My Net (ssid)\n$110 = 6000.000 (x max rate)\n$120=500\n"
    assert rapid(made(tmp_path, text, "dump.txt")[0]) == (100.0, 500.0)


def test_rates_of_a_30i_are_behind_m_or_i(tmp_path):
    metric = "%\nN01420Q1A1M30000.0A2M24000.0\nN01620Q1A1P64A2P64\n%\n"
    machine, _ = made(tmp_path, metric, "cnc-para.txt")
    assert rapid(machine) == (500.0, 500.0 / 0.064)
    assert machine.axis("Y").rapid.velocity == 400.0
    inch = metric.replace("M30000.0", "I1000.0").replace("%\n", "%\nN01320Q1A1I10.A2M5.\n", 1)
    inch = inch.replace("N01420", "N01321Q1A1I-10.A2M-5.\nN01420")
    machine, _ = made(tmp_path, inch, "inch.txt")
    assert machine.axis("X").rapid.velocity == pytest.approx(25400 / 60)
    assert machine.axis("X").travel == (-254.0, 254.0)
    assert machine.axis("Y").travel == (-5.0, 5.0)


@pytest.mark.parametrize("bits", ["00000001", "1"])
def test_rates_of_a_fanuc_machine_in_inch_are_refused(tmp_path, bits):
    text = f"N01001P{bits}\nN01420 A1 P1200 A2 P1200\nN01620 A1 P64 A2 P64\n"
    with pytest.raises(MachineError, match="INM") as refused:
        made(tmp_path, text, "cnc-para.txt")
    assert refused.value.place.line == 2
    made(tmp_path, text.replace(f"P{bits}", "P00000010"), "cnc-para.txt")


@pytest.mark.parametrize("number", ["1.2.3", "30,000", "3e4"])
@pytest.mark.parametrize("form", ["N01420 A1 P{}", "1420 X{}", "1420: X={}"])
def test_a_rate_of_fanuc_is_a_plain_number(tmp_path, form, number):
    with pytest.raises(MachineError, match="expected a number") as refused:
        made(tmp_path, f"N01620 A1 P64\n{form.format(number)}\n", "list.txt")
    assert refused.value.place.line == 2


def test_travel_that_is_an_expression_is_left_out(tmp_path):
    text = CONFIG_G + "M208 X0:200 Z{global.height} S0\nM208 Z0 S1\n"
    machine, notes = made(tmp_path, text, "config.g")
    assert machine.axis("X").travel == (0.0, 200.0)
    assert machine.axis("Z").travel is None
    assert "config.g:5: Z of M208 is '{global.height}'" in notes


def test_a_table_of_a_calibration_is_no_spectrum(tmp_path):
    (tmp_path / "calibration_data_x.csv").write_text(
        "freq,psd_x,psd_y,psd_z,psd_xyz,zv(52.6),mzv(54.2)\n5.0,1,0,0,1,1.000,1.000\n"
    )
    with pytest.raises(MachineError, match="no spectrum to judge by") as refused:
        draft_of([str(tmp_path / "calibration_data_x.csv")], tmp_path)
    assert "TEST_RESONANCES" in refused.value.remedy
