"""The cache of solution_cache: kept, shared, and never in the way."""

import os
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from gcodejerk.planning import solution_cache
from gcodejerk.planning.solution_cache import cache_file, read_solutions, write_solutions


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.setenv(solution_cache.VARIABLE, str(tmp_path / "cache"))
    return cache_file()


def test_what_was_written_is_read(file):
    solved = {bytes([k]): bytes(k) for k in range(200)}
    write_solutions(solved, file)
    assert read_solutions([*solved, b"unknown"], file) == solved


def test_more_keys_than_a_query_takes_are_read(file):
    solved = {k.to_bytes(4, "big"): b"x" for k in range(3 * solution_cache.AT_A_TIME + 1)}
    write_solutions(solved, file)
    assert read_solutions(list(solved), file) == solved


def test_an_empty_variable_means_no_cache(monkeypatch):
    monkeypatch.setenv(solution_cache.VARIABLE, "")
    assert cache_file() is None
    write_solutions({b"a": b"b"}, None)
    assert read_solutions([b"a"], None) == {}


def test_without_the_variable_the_users_cache_directory_is_used(monkeypatch, tmp_path):
    monkeypatch.delenv(solution_cache.VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_file().name == f"solutions-{solution_cache.VERSION}.sqlite"
    if sys.platform == "linux":
        assert cache_file().parent == tmp_path / "gcodejerk"


@pytest.mark.parametrize(
    "content", [b"", b"no database at all" * 100, b"SQLite format 3\0" + bytes(99)]
)
def test_a_file_that_is_no_database_is_no_obstacle_and_is_replaced(file, content):
    file.parent.mkdir()
    file.write_bytes(content)
    assert read_solutions([b"a"], file) == {}
    write_solutions({b"a": b"1"}, file)
    write_solutions({b"a": b"1"}, file)
    assert read_solutions([b"a"], file) == {b"a": b"1"}


def test_a_database_with_another_table_is_no_obstacle(file):
    file.parent.mkdir()
    with sqlite3.connect(file) as base:
        base.execute("CREATE TABLE solution_cache (something TEXT)")
    assert read_solutions([b"a"], file) == {}
    write_solutions({b"a": b"1"}, file)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written_is_no_obstacle(file):
    file.parent.mkdir(mode=0o500)
    write_solutions({b"a": b"1"}, file)
    assert read_solutions([b"a"], file) == {}


def test_a_folder_that_cannot_be_is_no_obstacle(tmp_path, monkeypatch):
    (tmp_path / "taken").write_bytes(b"a file")
    monkeypatch.setenv(solution_cache.VARIABLE, str(tmp_path / "taken"))
    write_solutions({b"a": b"1"}, cache_file())
    assert read_solutions([b"a"], cache_file()) == {}


def test_a_huge_file_begins_anew(file, monkeypatch):
    write_solutions({b"a": bytes(5000)}, file)
    monkeypatch.setattr(solution_cache, "MOST_BYTES", 4000)
    write_solutions({b"b": b"2"}, file)
    assert read_solutions([b"a", b"b"], file) == {b"b": b"2"}


def test_runs_at_the_same_time_lose_nothing(file):
    script = (
        "import sys\n"
        "from pathlib import Path\n"
        "from gcodejerk.planning.solution_cache import write_solutions\n"
        "own = int(sys.argv[1])\n"
        "for k in range(40):\n"
        "    write_solutions({bytes([own, k]): bytes([k])}, Path(sys.argv[2]))\n"
    )
    runs = [
        subprocess.Popen([sys.executable, "-c", script, str(own), str(file)]) for own in range(4)
    ]
    assert [run.wait() for run in runs] == [0] * 4
    keys = [bytes([own, k]) for own in range(4) for k in range(40)]
    assert len(read_solutions(keys, file)) == 160
    assert [p.name for p in Path(file).parent.iterdir()] == [file.name]
