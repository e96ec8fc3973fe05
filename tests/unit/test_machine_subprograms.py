"""The folder of subprograms: what is read, what is refused, and what its sum tells."""

import os

import pytest

from gcodejerk.errors import MachineError
from gcodejerk.machine import subprograms
from gcodejerk.machine.subprograms import load_subprograms


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "drill").mkdir()
    (tmp_path / "O1000.nc").write_bytes(b"O1000\nM99\n")
    (tmp_path / "drill" / "L54.SPF").write_bytes(b"G0 Z5\nM17\n")
    (tmp_path / ".hidden").write_bytes(b"O9\nM99\n")
    return tmp_path


def test_files_are_known_by_their_names_within_the_folder(folder):
    found = load_subprograms(str(folder))
    assert found.files == {"O1000.nc": b"O1000\nM99\n", "drill/L54.SPF": b"G0 Z5\nM17\n"}


def test_the_sum_changes_with_every_name_and_byte_and_with_nothing_else(folder):
    first = load_subprograms(str(folder)).digest
    (folder / ".hidden").write_bytes(b"other")
    assert load_subprograms(folder.name, folder.parent).digest == first
    (folder / "O1000.nc").rename(folder / "O1001.nc")
    renamed = load_subprograms(str(folder)).digest
    (folder / "O1001.nc").write_bytes(b"O1000\nM98\n")
    assert len({first, renamed, load_subprograms(str(folder)).digest}) == 3


@pytest.mark.parametrize(
    ("limit", "value", "problem"),
    [
        ("MOST_FILES", 1, "more than 1 files"),
        ("MOST_TOGETHER", 12, "of subprograms holds more than"),
        ("MOST_BYTES", 9, "'O1000.nc' in the folder"),
    ],
)
def test_what_is_too_much_is_refused_and_not_left_out(folder, monkeypatch, limit, value, problem):
    """Were a file left out, another of the same number would be taken for the one called."""
    monkeypatch.setattr(subprograms, limit, value)
    with pytest.raises(MachineError, match=problem) as refused:
        load_subprograms(str(folder))
    assert "name a folder that holds nothing but subprograms" in str(refused.value)


def test_what_is_no_folder_is_refused(folder):
    for name in ("O1000.nc", "missing"):
        with pytest.raises(MachineError, match="which is no folder"):
            load_subprograms(name, folder)


def test_names_may_be_of_old_controls(folder):
    # Memory dumps have them in Latin-1; the sum of the folder ended with a traceback.
    name = b"\xdcBUNG.nc"
    (folder / os.fsdecode(name)).write_bytes(b"O2000\nM99\n")
    assert load_subprograms(str(folder)).files[os.fsdecode(name)] == b"O2000\nM99\n"
