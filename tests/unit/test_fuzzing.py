"""The fuzzing harnesses keep running, and what they have caught stays caught."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

FUZZ = Path(__file__).parents[1] / "fuzz"


def load(name):
    spec = importlib.util.spec_from_file_location(name, FUZZ / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


PARTS = 4
"""Of the inputs, for as many cores."""


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize(("name", "runs"), [("fuzz_reader", 80), ("fuzz_process", 60)])
def test_a_harness_finds_nothing_in_a_few_hundred_inputs(name, runs, part, request):
    check = load(name).load()
    seeds = load("engine").seeds()
    assert len(seeds) >= 10
    runs *= 8 if request.config.getoption("--long") else 1
    drawn = list(load("mutation").drawn(seeds, runs, most=3000))
    for data in [*seeds, *drawn][part::PARTS]:
        check(data, timed=False)


@pytest.mark.parametrize("name", ["fuzz_reader", "fuzz_process"])
def test_a_saved_input_can_be_replayed(name, tmp_path):
    (tmp_path / "saved").write_bytes(b"G21 G90 G64\nG0 X0\nG0 X5\nM2\n")
    done = subprocess.run(
        [sys.executable, FUZZ / f"{name}.py", "--replay", tmp_path / "saved"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def test_a_broken_law_is_saved_and_told(tmp_path, capsys):
    def profile(data):
        assert b"G0" not in data

    assert load("engine").blind(profile, 0.001, 1, tmp_path)
    (saved,) = tmp_path.iterdir()
    assert b"G0" in saved.read_bytes()
    assert "promises broken" in capsys.readouterr().out
