"""Totals of a report: what is left alone behind its design lasts as long as it did."""

import json

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
