"""What a report says of rapids that are left alone: length and time, as far as known."""

import gzip
import json

import pytest

from gcodejerk import Machine, find_machine, plan_move

PROGRAM = "G21 G90 G94 G17 G64\nG0 X0 Y0 Z0\nG1 X1 F600\nG0 Z1000\nG1 X2\nG0 Z900\nM2\n"


def test_a_rapid_that_is_left_at_last_adds_no_time(command, tmp_path):
    (tmp_path / "lone.nc").write_text(PROGRAM)
    assert command("process", "lone.nc", "-m", "vmc", "--report", "lone.json")[0] == 0
    report = json.loads((tmp_path / "lone.json").read_text())
    late, planned = report["rapids"][1:]
    assert late["reason"] == "the control would not play it as planned"
    total = report["summary"]
    assert total["rapid_time"] == planned["time"]
    assert total["conventional_time"] == planned["conventional_time"]
    assert total["rapid_time_all"] == total["conventional_time_all"]
    assert late["conventional_time"] > 0.0
    own = planned["time"] + late["conventional_time"]
    assert total["rapid_time_all"] == pytest.approx(own, abs=1e-8)


KNOWN = """G21 G90 G94 G17 G64
G0 X0 Y0 Z0
G1 X1 F600
/G0 Z-3
G1 Z0
G0 X1.01
G1 X2
G0 X30
M2
"""


@pytest.mark.parametrize("few", [2000, 0])
@pytest.mark.parametrize("report", ["known.json", "known.json.gz"])
def test_length_and_time_of_a_rapid_that_is_left_alone_are_told_where_they_are_known(
    command, tmp_path, report, few, monkeypatch
):
    """In a report of many rapids, too, which is written as it is made."""
    monkeypatch.setattr("gcodejerk.batch.reports.FEW", few)
    (tmp_path / "known.nc").write_text(KNOWN)
    assert command("process", "known.nc", "-m", "vmc", "--report", report)[0] == 0
    text = (tmp_path / report).read_bytes()
    rapids = json.loads(gzip.decompress(text) if report.endswith(".gz") else text)["rapids"]
    unknown, deleted, short, planned = rapids
    assert (unknown["length"], unknown["conventional_time"]) == (None, None)
    vmc = Machine.load(find_machine("vmc"))
    assert deleted["reason"] == "block delete"
    assert deleted["length"] == 3.0
    usual = plan_move({"Z": 3.0}, vmc).conventional_time
    assert deleted["conventional_time"] == pytest.approx(usual, abs=1e-9)
    assert short["reason"] == "shorter than minimum_length"
    assert short["length"] == pytest.approx(0.01)
    assert short["conventional_time"] > 0.0
    assert planned["status"] == "planned"
    for left in (deleted, short):
        assert (left["time"], left["residual"], left["segments"]) == (None, None, None)


def test_inspect_shows_them(command, tmp_path):
    (tmp_path / "known.nc").write_text(KNOWN)
    _, shown = command("inspect", "known.nc", "-m", "vmc")
    row = next(line for line in shown.splitlines() if "block delete" in line)
    assert "3.000" in row
