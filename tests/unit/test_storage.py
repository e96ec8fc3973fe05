"""Columns on disk hold what columns in memory do, and leave nothing behind."""

import gc
import io
import os
import tempfile
import tracemalloc

import numpy as np
import pytest

from gcodejerk import Machine, find_machine, storage
from gcodejerk.batch.reports import write_report
from gcodejerk.report.page.document import page_html
from gcodejerk.rewrite.pipeline import Settings, process_file


@pytest.fixture
def few(monkeypatch):
    """Columns are on disk from eight rows on."""
    monkeypatch.setattr(storage, "MANY", 8)
    monkeypatch.setattr(storage, "AT_ONCE", 5)


def test_a_column_that_grows_by_one_value_for_many_rows_keeps_it_once(few):
    for second in (np.broadcast_to(np.float64(2.5), 9), np.full(9, 2.5)):
        column = storage.Growing(np.float64, once=True)
        column.extend(np.broadcast_to(np.float64(2.5), 7))
        column.extend(second)
        finished = column.finish()
        assert finished.tolist() == [2.5] * 16
        assert finished.strides == (0,)


def test_a_column_that_is_no_more_of_one_value_keeps_all_rows(few):
    column = storage.Growing(np.float64, once=True)
    for value, rows in ((2.5, 9), (2.5, 4), (-0.0, 3), (0.0, 6)):
        column.extend(np.broadcast_to(np.float64(value), rows))
    finished = column.finish()
    assert finished.tolist() == [2.5] * 13 + [0.0] * 9
    assert np.signbit(finished).tolist() == [False] * 13 + [True] * 3 + [False] * 6


def _holes(rapids):
    """Holes at 64 places, again and again; one G0 that is left alone for each row of them."""
    lines = ["G21 G90 G94 G17 G40 G49 G64", "G0 Z5", "G0 X-10 Y-10", "F600"]
    for k in range(rapids // 2):
        lines += [f"G0 X{-10 - 5 * (k % 8):.3f} Y{-10 - 5 * (k // 8 % 8):.3f}", "G1 Z-3", "G0 Z5"]
        lines += ["G0 A5"] if k % 64 == 63 else []
    return "\n".join([*lines, "M2", ""]).encode()


def _processed(program, machine, controller, full=True):
    """Output and reports."""
    source, target, report = io.BytesIO(program), io.BytesIO(), io.BytesIO()
    result = process_file(source, target, machine, Settings(controller=controller), "part.nc")
    write_report(report, result, machine, None, source)
    page = page_html(result, machine, None, source, 0) if full else ""
    return target.getvalue(), report.getvalue(), page, result.edits.tolist(), result.hunks.tolist()


@pytest.mark.usefixtures("few")
def test_columns_on_disk_are_those_in_memory():
    values = np.arange(60.0).reshape(20, 3)
    index = np.array([19, 0, 0, 7, 3, 3, 12, 1, 19, 2, 5])
    kept = storage.kept(values)
    assert storage.kept(kept) is kept
    np.testing.assert_array_equal(kept, values)
    np.testing.assert_array_equal(storage.gathered(kept, index), values[index])
    np.testing.assert_array_equal(
        storage.made(lambda part: values[part] + 1.0, values.shape), values + 1.0
    )
    column = storage.column((20, 2), np.nan)
    column[[3, 17]] = 4.0
    storage.release()
    assert np.flatnonzero(np.isfinite(column).all(axis=1)).tolist() == [3, 17]


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("alike", [0, 3, 13, 40])
@pytest.mark.parametrize("once", [False, True])
@pytest.mark.parametrize("width", [0, 2])
def test_a_growing_column_is_what_it_was_given(alike, once, width):
    rows = np.random.default_rng(4).integers(0, 99, (40, width) if width else 40)
    rows[:alike] = rows[0]
    growing = storage.Growing(np.int64, width, once=once)
    for begin, end in [(0, 1), (1, 1), (1, 9), (9, 21), (21, 22), (22, 40)]:
        growing.extend(rows[begin:end])
    assert len(growing) == 40
    out = growing.finish()
    np.testing.assert_array_equal(out, rows)
    assert (out.strides[0] == 0) == (once and alike == 40)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("room", [0, 100, 200, 300])
def test_where_the_disk_is_full_columns_are_in_memory(room, monkeypatch):
    class Full(io.FileIO):
        def write(self, data):
            if self.tell() + len(data) > room:
                raise OSError(28, "no space left")
            return super().write(data)

    def full(buffering):
        handle, name = tempfile.mkstemp()
        os.close(handle)
        file = Full(name, "r+")
        os.unlink(name)
        return file

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    rows = np.arange(60)
    rows[:12] = 0
    for once in (False, True):
        growing = storage.Growing(np.int64, once=once)
        for begin in range(0, 60, 6):
            growing.extend(rows[begin : begin + 6])
        np.testing.assert_array_equal(growing.finish(), rows)
    np.testing.assert_array_equal(storage.kept(rows), rows)
    assert storage.column(60, 2.0).tolist() == [2.0] * 60


@pytest.mark.usefixtures("few")
@pytest.mark.skipif(os.name == "nt", reason="files have names there until they are closed")
def test_a_column_on_disk_has_no_name(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    before = len(storage._maps)
    column = storage.column((20, 2), 1.0)
    assert len(storage._maps) == before + 1
    assert list(tmp_path.iterdir()) == []
    del column
    assert len(storage._maps) == before


@pytest.mark.parametrize("controller", ["linuxcnc", "grbl", "csv"])
def test_outputs_and_reports_do_not_depend_on_where_columns_are(controller, monkeypatch):
    machine = Machine.load(find_machine("vmc"))
    program = _holes(2100 if controller == "grbl" else 300)
    before = _processed(program, machine, controller)
    monkeypatch.setattr(storage, "MANY", 20)
    monkeypatch.setattr(storage, "AT_ONCE", 70)
    assert _processed(program, machine, controller) == before


def test_next_to_nothing_of_each_rapid_stays_in_memory(monkeypatch):
    machine = Machine.load(find_machine("vmc"))
    monkeypatch.setattr(storage, "MANY", 100)
    monkeypatch.setattr(storage, "AT_ONCE", 50)
    settings, held = Settings(controller="grbl"), []
    for rapids in (250, 250, 750):  # the first fills what is remembered for good
        with tempfile.TemporaryFile() as source, tempfile.TemporaryFile() as target:
            source.write(_holes(rapids))
            if held:
                tracemalloc.start()
            result = process_file(source, target, machine, settings, "part.nc")
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0])
            tracemalloc.stop()
            assert len(result.plans) > rapids
    assert (held[2] - held[1]) / 500 < 100.0  # bytes a rapid; in memory they are 600
