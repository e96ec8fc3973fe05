"""Outputs in which nothing was rewritten: ours where they were written, and nobody's elsewhere."""

import pytest

from gcodejerk.batch import copies
from gcodejerk.batch.copies import is_copy, remember_copy
from gcodejerk.planning.solution_cache import VARIABLE

STILL = b"G21 G90\nG1 X%d F100\nM2\n"
"""A program without rapids."""
MOVES = b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1.\nG1 X5 F100\nG0 X40\nM2\n"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"


def process(command, *arguments):
    return command("process", "a.nc", "-m", "vmc", *arguments)


@pytest.mark.parametrize("output", [(), ("-o", "b.nc"), ("--output-dir", "out")])
@pytest.mark.parametrize("then", [STILL % 2, MOVES], ids=["still", "moves"])
def test_a_copy_gives_way_when_its_program_has_changed(command, tmp_path, output, then):
    for text in (STILL % 1, then, STILL % 3):
        (tmp_path / "a.nc").write_bytes(text)
        code, out = process(command, *output)
        assert code == 0, out


def test_an_edited_copy_does_not(command, tmp_path):
    (tmp_path / "a.nc").write_bytes(STILL % 1)
    assert process(command)[0] == 0
    edited = (tmp_path / "a.jerk.nc").read_bytes() + b"(by hand)\n"
    (tmp_path / "a.jerk.nc").write_bytes(edited)
    (tmp_path / "a.nc").write_bytes(STILL % 2)
    code, out = process(command)
    assert (code, "carries no stamp" in out) == (1, True)
    assert (tmp_path / "a.jerk.nc").read_bytes() == edited


def test_the_same_bytes_elsewhere_do_not(command, tmp_path):
    (tmp_path / "a.nc").write_bytes(STILL % 1)
    (tmp_path / "own.nc").write_bytes(STILL % 1)
    assert process(command)[0] == 0
    (tmp_path / "a.nc").write_bytes(STILL % 2)
    code, out = process(command, "-o", "own.nc")
    assert (code, "carries no stamp" in out) == (1, True)
    assert (tmp_path / "own.nc").read_bytes() == STILL % 1


def test_without_a_place_to_remember_everything_works(command, tmp_path, monkeypatch):
    (tmp_path / "file").write_bytes(b"")
    for folder in ("", str(tmp_path / "file")):
        monkeypatch.setenv(VARIABLE, folder)
        (tmp_path / "a.nc").write_bytes(STILL % 1)
        assert process(command, "--force")[0] == 0
        (tmp_path / "a.nc").write_bytes(STILL % 2)
        assert process(command)[0] == 1


def test_what_was_remembered_first_is_forgotten_first(tmp_path, monkeypatch, cache):
    monkeypatch.setattr(copies, "MOST", 4)
    names = [str(tmp_path / f"{k}.nc") for k in range(4)]
    for name in names:
        (tmp_path / name).write_bytes(b"G1 X1\n")
    for k in (0, 1, 0, 2):
        remember_copy(names[k])
    assert [is_copy(name) for name in names] == [True, True, True, False]
    remember_copy(names[3])
    assert [is_copy(name) for name in names] == [False, False, True, True]
    assert not is_copy(str(tmp_path / "nothing.nc"))
    assert len((cache / "copies-1.txt").read_bytes().splitlines()) == 2
