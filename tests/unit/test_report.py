"""The JSON report: its schema, its numbers, and strict JSON."""

import gzip
import io
import json
import re
from importlib.resources import files
from pathlib import Path

import jsonschema
import pytest
from rich.console import Console

from gcodejerk.batch import reports
from gcodejerk.machine import Machine, find_machine
from gcodejerk.planning.move import plan_move
from gcodejerk.reasons import Reason
from gcodejerk.report import columns
from gcodejerk.report.move_record import conventional_motion, move_record, stream_csv
from gcodejerk.report.records import dump, process_record
from gcodejerk.report.tables import move_tables, rapids_table
from gcodejerk.rewrite.pipeline import process

SCHEMA = json.loads(files("gcodejerk.report").joinpath("report.schema.json").read_text())
PLATE = Path(__file__).parents[2] / "samples" / "plate.ngc"


def report_of(data, machine):
    result = process(data, machine, name="part.nc")
    blocks = [
        data[a:b].decode()
        for a, b in zip(result.program.rapids.begin, result.program.rapids.end, strict=True)
    ]
    return json.loads(dump(process_record(result, machine, "part.jerk.nc", blocks)))


@pytest.mark.parametrize("name", ["vmc", "router", "drill", "paper"])
def test_report_of_a_program_keeps_the_schema(name):
    record = report_of(PLATE.read_bytes(), Machine.load(find_machine(name)))
    jsonschema.validate(record, SCHEMA)
    assert len(record["rapids"]) == record["summary"]["rapids"]
    assert record["summary"]["planned"] + record["summary"]["left"] == record["summary"]["rapids"]
    assert {r["reason"] for r in record["rapids"] if r["reason"]} <= {str(r) for r in Reason}


def test_report_of_a_program_without_rapids_keeps_the_schema():
    record = report_of(b"G21 G90\nG1 X1 F100\nM2\n", Machine.load(find_machine("vmc")))
    jsonschema.validate(record, SCHEMA)
    assert record["summary"]["worst_residual"] is None


def test_schema_refuses_a_planned_rapid_without_a_time():
    record = report_of(PLATE.read_bytes(), Machine.load(find_machine("vmc")))
    planned = next(r for r in record["rapids"] if r["status"] == "planned")
    planned["time"] = None
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(record, SCHEMA)


def test_report_of_the_papers_case_holds_the_papers_numbers():
    plan = plan_move({"Z": 1.0}, Machine.load(find_machine("paper")), time=0.040, T1=0.001)
    record = move_record(plan)
    jsonschema.validate(json.loads(dump(record)), SCHEMA)
    rapid = record["rapids"][0]
    assert [s["duration"] for s in rapid["segments"]] == pytest.approx([0.001, 0.019, 0.019, 0.001])
    assert rapid["segments"][0]["jerk"] == pytest.approx(3846153.8, rel=1e-7)
    assert rapid["peak"]["Z"]["velocity"] == pytest.approx(38.4615, rel=1e-5)
    (mode,) = rapid["residual"]
    assert mode["profile_acceleration"] == pytest.approx(5696.8, abs=0.05)
    assert mode["conventional_profile_acceleration"] == pytest.approx(13209.3, abs=0.05)
    assert mode["acceleration"] == pytest.approx(5680, abs=1.0)
    assert mode["conventional_acceleration"] == pytest.approx(13170, abs=1.0)


def test_stream_of_a_plan_has_the_contracts_columns_and_exact_ends():
    plan = plan_move({"Z": 1.0, "X": -2.5}, Machine.load(find_machine("vmc")))
    rows = stream_csv(plan).decode().splitlines()
    assert rows[0] == "t,X,Y,Z"
    assert rows[1] == "0,0,0,0"
    assert rows[-1] == f"{plan.time:.10g},-2.5,0,1"
    assert len(rows) == 2 + round(plan.time / 0.001)


def test_independent_positioning_reports_segments_for_each_axis():
    text = (
        find_machine("vmc").read_text().replace("positioning: linear", "positioning: independent")
    )
    plan = plan_move({"X": 30.0, "Z": 2.0}, Machine.loads(text))
    record = move_record(plan)
    jsonschema.validate(json.loads(dump(record)), SCHEMA)
    segments = record["rapids"][0]["segments"]
    assert set(segments) == {"X", "Z"}
    assert sum(s["duration"] for s in segments["Z"]) < sum(s["duration"] for s in segments["X"])


@pytest.mark.parametrize("machine", ["vmc", "router"])
def test_report_of_a_large_program_says_the_same_line_by_line(machine, monkeypatch):
    machine = Machine.load(find_machine(machine))
    program = b"G21 G90 G94 G17 G40 G64\nG0 X0 Y0 Z0\nF600\n" + b"".join(
        b"G0 X-%d Y-%d\nG1 Z-3\nG0 Z0 ; \xe9\n" % (5 * (k % 7), k % 3) for k in range(40)
    )
    result, source = process(program, machine), io.BytesIO(program)
    whole = dump(reports.record_of(result, machine, "out", source))
    monkeypatch.setattr(reports, "FEW", 10)
    monkeypatch.setattr(columns, "AT_ONCE", 17)
    monkeypatch.setattr(columns, "REMEMBERED", 5)
    plain, squeezed = io.BytesIO(), io.BytesIO()
    reports.write_report(plain, result, machine, "out", source)
    with columns.packed(squeezed) as file:
        reports.write_report(file, result, machine, "out", source)
    # As text, in which 0.0 and -0.0 differ.
    assert json.dumps(json.loads(plain.getvalue())) == json.dumps(json.loads(whole))
    assert gzip.decompress(squeezed.getvalue()) == plain.getvalue()
    assert plain.getvalue().count(b"\n") == len(result.plans) + 2


AXIS_A = """axes:
  A:
    {kind}
    resolution: 1.0e-3
    rapid: {{velocity: 100, acceleration: 1000}}
    modes: [{{frequency: 30, damping: 0.02, participation: 0.5}}]
"""


KINDS = {"linear": "type: linear", "rotary": "wrap: none"}


def machine_with(kind):
    text = find_machine("vmc").read_text().replace("controller: linuxcnc", "controller: csv")
    return Machine.loads(text.replace("axes:\n", AXIS_A.format(kind=KINDS[kind]), 1), "m.yaml")


def shown(table):
    out = Console(file=io.StringIO(), width=140)
    out.print(table)
    return out.file.getvalue()


PROGRAM_A = b"G21 G90 G94\nG1 X0 A0 F10\nG0 A20.\nM2\n"


@pytest.mark.parametrize(
    ("kind", "letters", "length"),
    [("linear", ["B", "C"], "20.000"), ("rotary", ["A", "B", "C"], "20.000 deg")],
)
def test_what_turns_the_machine_file_says(kind, letters, length):
    record = report_of(PROGRAM_A, machine_with(kind))
    jsonschema.validate(record, SCHEMA)
    assert record["rotary"] == letters
    assert re.search(rf"A20 +{length}  ", shown(rapids_table(record)))


def test_a_move_is_in_the_unit_that_the_machine_file_says():
    for kind, unit in (("linear", "[mm/s]"), ("rotary", "[deg/s]")):
        plan = plan_move({"A": 20.0}, machine_with(kind))
        assert unit in shown(move_tables(move_record(plan), conventional_motion(plan))[0])


def test_in_reports_of_before_letters_say_what_turns():
    record = report_of(PROGRAM_A, machine_with("rotary"))
    del record["rotary"]
    jsonschema.validate(record, SCHEMA)
    assert "20.000 deg" in shown(rapids_table(record))
