from pathlib import Path

import numpy as np
import pytest

from gcodejerk.errors import MachineError
from gcodejerk.machine import LINUXCNC, Machine, find_machine
from gcodejerk.machine.find import shipped_machines


def test_five_machines_and_the_papers_example_are_shipped():
    assert list(shipped_machines()) == ["centre", "drill", "paper", "router", "vmc", "vmc33"]


@pytest.mark.parametrize("name", sorted(shipped_machines()))
def test_a_shipped_machine_is_found_by_name_and_read_without_findings(name):
    machine = Machine.load(find_machine(name))
    assert machine.axis_names == (("Z",) if name == "paper" else ("X", "Y", "Z"))
    assert machine.all_modes()


@pytest.mark.parametrize("name", sorted(shipped_machines()))
def test_every_number_of_a_shipped_machine_has_a_comment_beside_it(name):
    for line in find_machine(name).read_text(encoding="utf-8").splitlines():
        value = line.partition("#")[0]
        if any(c.isdigit() for c in value) and not value.startswith(("schema", "  profile")):
            assert "#" in line, line


@pytest.mark.parametrize("path", ["mill.yaml", "./mill", "shop/mill", "C:\\mill", "mill.yml"])
def test_a_path_is_taken_as_it_is(path):
    assert find_machine(path) == Path(path)


def test_an_unknown_name_is_refused_with_the_shipped_ones_and_the_nearest():
    with pytest.raises(MachineError) as caught:
        find_machine("vcm")
    assert str(caught.value) == (
        "no machine is called 'vcm', shipped are centre, drill, paper, router, vmc, vmc33; "
        "did you mean 'vmc'?\n"
        "  for a file of your own give its path and suffix, for example ./vcm.yaml"
    )


def test_one_millimetre_on_the_z_axis_of_the_paper_takes_exactly_40_ms():
    rapid = Machine.load(find_machine("centre")).axis("Z").rapid
    T1 = (1.0 / (2.0 * rapid.jerk)) ** (1.0 / 3.0)
    time = 4.0 * T1
    assert time == pytest.approx(0.040, rel=1e-12)
    assert rapid.jerk * T1 == pytest.approx(rapid.acceleration, rel=1e-12)


def test_modes_of_the_paper_are_those_of_its_section_2():
    modes = Machine.load(find_machine("centre")).axis("Z").modes
    assert modes == Machine.load(find_machine("vmc")).axis("Z").modes
    assert [mode.frequency for mode in modes] == [30.0, 50.0, 90.0, 110.0]
    strongest = max(modes, key=lambda mode: mode.participation_of("Z"))
    assert strongest.frequency == 30.0


def test_a_machine_on_linuxcnc_has_the_rapids_of_linuxcnc():
    on_linuxcnc = set()
    for name in shipped_machines():
        machine = Machine.load(find_machine(name))
        if machine.controller == "linuxcnc":
            on_linuxcnc.add(name)
            assert machine.planner == LINUXCNC
            assert all(np.isinf(axis.rapid.jerk) for axis in machine.axes)
        # The worked example has a mode without damping, as the paper's formulas have it.
        assert len(machine.warnings) == (name == "paper")
    assert on_linuxcnc == {"router", "vmc"}
