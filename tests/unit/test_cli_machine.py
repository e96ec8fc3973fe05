"""`machine new`, `list`, `show`, `test-program`, and where a machine file is looked for."""

import io
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.identification import DIALECTS, excitation, rapids_program
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import CERTAIN, read_program
from gcodejerk.planning.move import plan_move

AXIS = "X velocity=36m/min acceleration=0.4g travel=-500:50"
PROGRAM = "G21 G90 G94\nG0 X0 Y0 Z0\nG0 X20\nG1 X30 F500\nM2\n"


def test_a_machine_from_options(command, tmp_path):
    code, out = command(
        "machine", "new", "--axis", AXIS, "--mode", "X frequency=30 damping=0.02", "-o", "m.yaml",
        "--controller", "haas", "--positioning", "independent", "--interval", "2ms",
        "--headroom", "1.5", "--name", "Old mill",
    )  # fmt: skip
    assert code == 0, out
    assert "m.yaml: axes X;" in out
    made = Machine.load(tmp_path / "m.yaml")
    x = made.axis("X")
    assert (made.name, made.controller, made.positioning) == ("Old mill", "haas", "independent")
    assert (made.interval, x.rapid.velocity, x.travel) == (0.002, 600.0, (-500.0, 50.0))
    assert x.limit.acceleration == pytest.approx(1.5 * x.rapid.acceleration)
    assert command("machine", "check", "m.yaml")[0] == 0
    assert "good" in command("machine", "check", "m.yaml")[1]


def test_a_machine_is_not_written_over(command, tmp_path):
    (tmp_path / "m.yaml").write_text("mine")
    code, out = command("machine", "new", "--axis", AXIS, "-o", "m.yaml")
    assert (code, "is there already" in out) == (1, True)
    assert (tmp_path / "m.yaml").read_text() == "mine"
    assert command("machine", "new", "--axis", AXIS, "-o", "m.yaml", "--force")[0] == 0


def test_without_modes_it_says_what_can_be_done(command, tmp_path):
    code, out = command("machine", "new", "--axis", AXIS, "-o", "m.yaml")
    assert code == 0
    assert "gcodejerk machine test-program --machine m.yaml" in out
    (tmp_path / "p.ngc").write_text(PROGRAM)
    code, out = command("process", "p.ngc", "--machine", "m.yaml")
    assert code == 0
    assert "0 rewritten" in out
    assert "gcodejerk machine test-program" in out


def test_a_machine_as_json(command):
    code, out = command("machine", "new", "--axis", AXIS, "--json")
    record = json.loads(out[: out.rindex("}") + 1])
    assert (code, record["axes"], record["modes_known"]) == (0, ["X"], False)
    assert Machine.loads(record["text"]).axis_names == ("X",)
    assert any("interval" in line for line in record["assumed"])


def test_nobody_is_asked_where_there_is_no_terminal(command):
    code, out = command("machine", "new")
    assert (code, "--axis" in out) == (2, True)


def test_questions(command, tmp_path, monkeypatch):
    import sys

    from gcodejerk.cli import new_machine

    # The runner's input is no terminal, and questions are for terminals only.
    class Terminal:
        stdin = type("Stdin", (), {"isatty": staticmethod(lambda: True)})
        stderr = property(lambda self: sys.stderr)

    monkeypatch.setattr(new_machine, "sys", Terminal())
    answers = [
        "Shed mill", "mach", "x", "fast", "1 g", "", "",  # a mistake is told, and asked again
        "36 m/min", "0.4 g", "50 m/s^3", "-5:5 mm", "30", "", "",
    ]  # fmt: skip
    code, out = command("machine", "new", "-o", "m.yaml", input="\n".join(answers) + "\n")
    assert code == 0, out
    assert "velocity of X is 'fast'" in out
    made = Machine.load(tmp_path / "m.yaml")
    assert (made.name, made.controller, made.axis("X").rapid.jerk) == ("Shed mill", "mach", 50000.0)
    assert made.axis("X").modes[0].frequency == 30.0


def test_questions_whose_answer_is_no_control_or_no_axis_are_asked_again(
    command, tmp_path, monkeypatch
):
    import sys

    from gcodejerk.cli import new_machine

    class Terminal:
        stdin = type("Stdin", (), {"isatty": staticmethod(lambda: True)})
        stderr = property(lambda self: sys.stderr)

    monkeypatch.setattr(new_machine, "sys", Terminal())
    axis = ["36 m/min", "0.4 g", "", "", ""]
    turning = ["3600 deg/min", "200 deg/s^2", "", "", ""]
    answers = ["Shed mill", "lnuxcnc", "linuxcnc", "x, q", "x, y; a", *axis, *axis, *turning]
    code, out = command("machine", "new", "-o", "m.yaml", input="\n".join(answers) + "\n")
    assert code == 0, out
    assert "did you mean 'linuxcnc'" in out
    assert "name them by their letters, of X Y Z" in out
    assert "A: rapid speed, as in 3600 deg/min" in out
    assert Machine.load(tmp_path / "m.yaml").axis_names == ("X", "Y", "A")


def test_the_shipped_machines(command):
    code, out = command("machine", "list")
    assert (code, "vmc" in out, "router" in out) == (0, True, True)
    rows = json.loads(command("machine", "list", "--json")[1])
    assert {"machine": "paper", "axes": {"Z": 1}}.items() <= next(
        row for row in rows if row["machine"] == "paper"
    ).items()


def test_a_machine_is_shown_as_it_is(command):
    code, out = command("machine", "show", "vmc")
    assert (code, out) == (0, find_machine("vmc").read_text(encoding="utf-8"))
    assert json.loads(command("machine", "show", "vmc", "--json")[1])["axes"]["Z"] == 4
    assert command("machine", "show", "vmx")[0] == 1


def test_json_of_commands_without_a_program(command):
    assert json.loads(command("machine", "check", "vmc", "--json")[1])["controller"] == "linuxcnc"
    rows = json.loads(command("controllers", "--json")[1])
    assert {row["controller"] for row in rows} >= {"linuxcnc", "fanuc", "csv"}


def made_in(folder):
    """A part in a folder below one that has a machine file."""
    (folder / "shop" / "parts").mkdir(parents=True)
    text = find_machine("router").read_text(encoding="utf-8")
    (folder / "shop" / "gcodejerk.yaml").write_text(text, encoding="utf-8")
    (folder / "shop" / "parts" / "p.ngc").write_text(PROGRAM)
    return "shop/parts/p.ngc"


def test_a_machine_file_above_the_program_is_found(command, tmp_path):
    part = made_in(tmp_path)
    code, out = command("inspect", part)
    assert code == 0
    assert f"machine: {Path('shop') / 'gcodejerk.yaml'}" in out


def test_the_environment_names_a_machine(command, tmp_path, monkeypatch):
    part = made_in(tmp_path)
    monkeypatch.setenv("GCODEJERK_MACHINE", "vmc")
    code, out = command("inspect", part, "--json")
    assert (code, json.loads(out)["machine"]) == (0, "vmc.yaml")
    code, out = command("inspect", part, "--json", "--machine", "drill")
    assert json.loads(out)["machine"] == "drill.yaml"


def test_no_machine_is_wrong_usage(command, tmp_path):
    (tmp_path / "p.ngc").write_text(PROGRAM)
    code, out = command("process", "p.ngc")
    assert (code, "machine new" in out) == (2, True)
    assert not (tmp_path / "p.jerk.ngc").exists()


def test_programs_of_two_machines_are_not_mixed(command, tmp_path):
    part = made_in(tmp_path)
    (tmp_path / "other").mkdir()
    shutil.copy(tmp_path / "shop" / "gcodejerk.yaml", tmp_path / "other")
    shutil.copy(tmp_path / part, tmp_path / "other" / "q.ngc")
    code, out = command("process", part, "other/q.ngc")
    assert code == 2
    assert "different machines" in " ".join(out.replace("│", " ").split())


def test_the_test_program(command, tmp_path):
    code, out = command("machine", "test-program", "--machine", "vmc", "-o", "ring.ngc")
    assert code == 0
    assert "ring.ngc: X " in out
    record = json.loads(command("machine", "test-program", "--machine", "vmc", "--json")[1])
    assert [one["axis"] for one in record["rapids"]] == ["X", "Y", "Z"]
    assert all(max(one["length"]) <= 50.0 for one in record["rapids"])
    text = (tmp_path / "ring.ngc").read_text()
    assert text.count("G0 ") == 3 * 4 * 3 * 2
    code, out = command("machine", "test-program", "-m", "vmc", "--axis", "A")
    assert (code, "has no axis 'A'" in out) == (1, True)
    code, out = command("machine", "test-program", "-m", "vmc", "--room", "0.5")
    assert (code, "too little" in out) == (1, True)


@pytest.mark.parametrize("dialect", DIALECTS)
def test_the_test_program_in_every_dialect_is_read_as_rapids_that_come_back(dialect):
    source = find_machine("vmc").read_text(encoding="utf-8")
    machine = Machine.loads(source.replace("dialect: linuxcnc", f"dialect: {dialect}"))
    text = rapids_program(machine, [excitation(machine, "X", 30.0, 3)], 2, 1.0)
    assert text.isascii()
    program = read_program(io.BytesIO(text.encode()), dialect=dialect)
    rapids = program.rapids
    assert len(rapids) == 12
    # From where nobody knows: none of them can ever be taken for certain and rewritten.
    assert (rapids.reason != CERTAIN).all()


def test_lengths_ring_everywhere_in_the_band():
    machine = Machine.load(find_machine("centre"))
    four, one = excitation(machine, "Z", 50.0, 4), excitation(machine, "Z", 50.0, 1)
    assert four.least > 0.4 > 2.0 * one.least
    for length, time in zip(four.length, four.time, strict=True):
        plan = plan_move({"Z": length}, machine, "conventional")
        assert plan.conventional_time == pytest.approx(time, rel=1e-9)


@pytest.mark.linuxcnc
@pytest.mark.skipif(shutil.which("rs274") is None, reason="rs274 (linuxcnc-uspace) is absent")
def test_linuxcncs_interpreter_comes_back_to_where_it_began(tmp_path):
    machine = Machine.load(find_machine("vmc"))
    rapids = [excitation(machine, axis, 25.0, 3) for axis in "XYZ"]
    (tmp_path / "ring.ngc").write_text(rapids_program(machine, rapids, 2, 0.5))
    done = subprocess.run(
        ["rs274", "-g", str(tmp_path / "ring.ngc")], input="", capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    ends = [
        [float(x) for x in line.split("STRAIGHT_TRAVERSE(")[1].rstrip(")").split(",")[:3]]
        for line in done.stdout.splitlines()
        if "STRAIGHT_TRAVERSE" in line
    ]
    assert len(ends) == 3 * 3 * 2 * 2
    assert np.allclose(ends[-1], 0.0)
    assert np.max(ends) <= 25.0 + 1e-9
    assert np.min(ends) >= -1e-9
    assert Path(tmp_path / "ring.ngc").read_text().isascii()


def test_a_configuration_from_standard_input(command):
    code, out = command("machine", "new", "-", input="$110=6000\n$120=500\n")
    assert code == 0, out
    assert "$110=6000 (<stdin>:1)" in out


def test_a_machine_file_from_standard_input(command):
    code, out = command("machine", "check", "-", input=find_machine("vmc").read_text())
    assert (code, "<stdin>: Small vertical" in out) == (0, True)
    code, out = command("machine", "check", "-", input="interval: fast\n")
    assert (code, "<stdin>:1:11: interval is 'fast'" in out) == (1, True)


@pytest.mark.parametrize(("key", "option"), [("controller", "lnuxcnc"), ("dialect", "fanc")])
def test_a_name_that_nothing_has_is_said_before_a_program_is_processed(
    command, tmp_path, key, option
):
    code, out = command("machine", "new", "--axis", AXIS, f"--{key}", option, "-o", "m.yaml")
    assert code == 2
    assert "did you mean" in out
    assert not (tmp_path / "m.yaml").exists()
    (tmp_path / "n.yaml").write_text(
        f"interval: 0.001\npositioning: linear\n{key}: {option}\n"
        "axes: {X: {rapid: {velocity: 500, acceleration: 5000}}}\n"
    )
    code, out = command("machine", "check", "n.yaml")
    assert code == 0
    place = f"n.yaml:3:{len(key) + 3}: "
    assert f"{place}warning: {key}: " in out
    assert "did you mean" in out
    (tmp_path / "part.nc").write_text(PROGRAM)
    assert command("process", "part.nc", "-m", "n.yaml")[0] == 1
    assert place in command("process", "part.nc", "-m", "n.yaml")[1]
    if key == "dialect":
        assert place in command("verify", "part.nc", "part.nc", "-m", "n.yaml")[1]
    instead = ("--controller", "grbl", "--dialect", "grbl")
    assert command("process", "part.nc", "-m", "n.yaml", *instead)[0] == 0


def test_a_number_that_no_machine_has_is_refused_with_where_it_comes_from(command, tmp_path):
    (tmp_path / "printer.cfg").write_text(
        "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: inf\n"
    )
    code, out = command("machine", "new", "printer.cfg", "-o", "m.yaml")
    assert code == 1
    assert "printer.cfg: axes.X.rapid.acceleration is 'inf'" in out
    assert "[printer] max_accel)" in out
    assert "m.yaml" not in out
    assert not (tmp_path / "m.yaml").exists()


def test_a_test_program_without_an_axis_to_move_is_refused(command, tmp_path):
    (tmp_path / "m.yaml").write_text(
        "interval: 0.001\npositioning: linear\naxes:\n  B: {type: rotary, rapid: {velocity: 90, "
        "acceleration: 3000, jerk: 3.0e+5}, modes: []}\n"
    )
    code, out = command("machine", "test-program", "-m", "m.yaml", "-o", "t.ngc")
    assert (code, "--axis B" in out) == (1, True)
    assert not (tmp_path / "t.ngc").exists()
    assert command("machine", "test-program", "-m", "m.yaml", "--axis", "B", "-o", "t.ngc")[0] == 0
