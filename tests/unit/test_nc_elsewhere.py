"""Subprograms in other files: which file a call means, and who refuses what."""

import io
import json

import numpy as np
import pytest

from gcodejerk import Machine
from gcodejerk.machine import MachineFileError
from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

HOME = dict.fromkeys("XYZ", 0.0)
STARTS = {
    "siemens": Start(positions=HOME, offsets={"G54": HOME}, startup="G17 G710 G90 G94 G40 G64 G54"),
    "fanuc": Start(positions=HOME, decimal_point="calculator", startup="G17 G21 G90 G40 G94"),
    "linuxcnc": Start(positions=HOME, startup="G17 G21 G90 G40 G64 G94"),
}
MAIN = b"F100. G0 X1. Y1.\nM98 P1000\nG0 X2. Y1.\nM30\n"
SUB = b"O1000\nG1 X5. F100.\nM99\n"


def read(text, dialect, files):
    """Certain rapids by line: start and end in X; what both readers make of it."""
    start = STARTS[dialect]
    start = type(start)(**{n: getattr(start, n) for n in start.__slots__} | {"subprograms": files})
    program = read_program(io.BytesIO(text), dialect=dialect, start=start)
    rapids, found = program.rapids, Findings(9)
    rows = np.flatnonzero(rapids.reason == CERTAIN)
    confirmed = confirm(io.BytesIO(text), dialect, start, rapids, rows, found)
    assert not found.violations
    assert dialect == "linuxcnc" or confirmed == len(rows)
    ways = {int(rapids.line[i]): (rapids.start[i, 0], rapids.target[i, 0]) for i in rows}
    return ways, program


@pytest.mark.parametrize(
    "files",
    [
        {"a/any.txt": SUB},
        {"O1000.NC": SUB.removeprefix(b"O1000\n")},
        {"1000": b"%\n" + SUB.removeprefix(b"O1000\n") + b"%\n"},
        {"all.nc": b"%\nO0999\nM99\n" + SUB.replace(b"\n", b"\r\n") + b"O1001 (NEXT)\nM99\n%\nX\n"},
        {"a.nc": SUB, "b.nc": SUB},
    ],
    ids=["by number", "by name", "tape", "among others", "twice the same"],
)
def test_a_call_finds_its_number(files):
    ways, program = read(MAIN, "fanuc", files)
    assert ways == {1: (0.0, 1.0), 3: (5.0, 2.0)}
    assert len(program.subprograms) == 1
    assert program.rapids.line.tolist() == [1, 3]


@pytest.mark.parametrize(
    "files",
    [
        {},
        {"a.nc": SUB, "b.nc": SUB.replace(b"5.", b"6.")},
        {"O1000.nc": b"O1001\nM99\n"},
        {"a.nc": SUB.removesuffix(b"M99\n")},
        {"a.nc": SUB.replace(b"M99", b"M99 P10")},
        {"a.nc": b"O1000\nWHILE[#1 LT 2] DO1\nM99\n"},
        {"a.nc": b"O1000\nM98 P1001\nM99\n"},
        {"own.nc": MAIN + SUB},
    ],
    ids=[
        "none",
        "two",
        "another number",
        "no end",
        "goes elsewhere",
        "open loop",
        "calls more",
        "-",
    ],
)
def test_what_is_not_certain_is_not_followed(files):
    text = MAIN
    if "own.nc" in files:
        # a copy of the program itself is no other file
        ways, program = read(MAIN + SUB, "fanuc", files)
        assert (ways[3], program.subprograms) == ((5.0, 2.0), ())
        return
    assert list(read(text, "fanuc", files)[0]) == [1]


def test_what_the_program_defines_itself_is_its_own():
    ways, program = read(MAIN + SUB, "fanuc", {"a.nc": SUB.replace(b"5.", b"6.")})
    assert ways[3] == (5.0, 2.0)
    assert program.subprograms == ()


def test_names_of_siemens_are_those_of_files_or_heads():
    text = b"F100 G0 X1\nL54\nG0 X2\nPOCKETS(3,4) P2\nG0 X3\nM30\n"
    files = {
        "l54.spf": b"G1 X7 F100\nM17\n",
        "x.arc": b"%_N_POCKETS_SPF\n;$PATH=/_N_SPF_DIR\nPROC POCKETS(REAL DEEP,REAL WIDE)\n"
        b"G91 G1 X=DEEP F100\nG90\nRET\n%_N_OTHER_MPF\nG0 X9\nM30\n",
        "POCKETS.MPF": b"G0 X8\nM30\n",
    }
    ways, program = read(text, "siemens", files)
    assert ways == {1: (0.0, 1.0), 3: (7.0, 2.0), 5: (8.0, 3.0)}
    assert set(program.subprograms) == {"l54.spf", "x.arc"}


def test_a_name_that_the_control_has_is_not_replaced():
    text = b"G0 X1 Z5\nCYCLE81(5,0,1,-3)\nG0 X2\nM30\n"
    assert read(text, "siemens", {"CYCLE81.SPF": b"G1 X7 F100\nM17\n"})[1].subprograms == ()


def test_a_problem_in_another_file_is_named_there():
    text = b"G0 X1.\nM98 P1000\nG0 X2.\nM30\n"
    found = read(text, "fanuc", {"sub/a.nc": b"\nO1000\nG1 X5. F9.\nG999\nM99\n"})[1].findings
    problem = next(f for f in found if "G999" in f.message)
    assert problem.line is None
    assert (problem.place.file, problem.place.line) == ("sub/a.nc", 4)
    loss = next(f for f in found if "in force is unknown" in f.message)
    assert loss.line is None
    assert "line 4 of sub/a.nc (G999)" in loss.message


def test_o_words_find_files_of_their_names():
    text = b"F100 G0 X1\no<spot> call [3]\nG0 X2\no100 call\nG0 X3\nM2\n"
    files = {
        "lib/spot.ngc": b"G0 X99\no<spot> sub\nG1 X#1 F100\no<spot> endsub\nM2\n",
        "100.ngc": b"o100 sub\nG1 X8\no100 endsub\n",
    }
    ways, program = read(text, "linuxcnc", files)
    assert ways == {1: (0.0, 1.0), 3: (3.0, 2.0), 5: (8.0, 3.0)}
    assert program.subprograms == ("lib/spot.ngc", "100.ngc")
    two = {**files, "b/spot.ngc": b"o<spot> sub\nG1 X4 F9\no<spot> endsub\n"}
    assert list(read(text, "linuxcnc", two)[0]) == [1]
    assert list(read(text, "linuxcnc", {"Spot.ngc": files["lib/spot.ngc"]})[0]) == [1]


MACHINE = """
interval: 0.001
positioning: linear
controller: fanuc
axes:
  X: {rapid: {velocity: 300, acceleration: 3000, jerk: 1.0e+5}, modes: [{frequency: 30, damping: 0.02}]}
program: {startup: G17 G21 G90 G40 G94 G54, decimal_point: calculator, start: {X: 0}%s}
"""  # noqa: E501
PART = b"G0 X10.\nM98 P1000\nG0 X30.\nM30\n"


@pytest.fixture
def shop(tmp_path, monkeypatch):
    (tmp_path / "subs").mkdir()
    (tmp_path / "subs" / "O1000.nc").write_bytes(b"O1000\nG1 X55. F100.\nM99\n")
    (tmp_path / "part.nc").write_bytes(PART)
    (tmp_path / "m.yaml").write_text(MACHINE % "")
    (tmp_path / "own.yaml").write_text(MACHINE % ", subprograms: subs")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_an_output_is_proven_with_the_texts_that_it_was_made_with(shop, command):
    run = command
    given = ("-m", "m.yaml", "--subprograms", "subs")
    made = run("process", "part.nc", *given, "-o", "out.nc", "--report", "r.json")
    assert made[0] == 0, made
    assert "followed into 1 file of subs (O1000.nc)" in made[1]
    used = json.loads((shop / "r.json").read_text())["subprograms"]
    assert [one["file"] for one in used] == ["O1000.nc"]
    assert len(used[0]["sum"]) == 16
    assert run("verify", "part.nc", "out.nc", *given)[0] == 0
    # the machine file may name the folder as well, and then it is another machine file
    assert run("verify", "part.nc", "out.nc", "-m", "own.yaml")[0] == 0
    assert run("verify", "part.nc", "out.nc", "-m", "m.yaml")[0] == 1
    (shop / "subs" / "O1000.nc").write_bytes(b"O1000\nG1 X56. F100.\nM99\n")
    code, said = run("verify", "part.nc", "out.nc", *given)
    assert code == 1
    assert "stamped for another machine file" in said


def test_the_sum_of_the_texts_is_part_of_the_settings(shop):
    before = Machine.load("own.yaml").settings_hash
    assert before != Machine.load("m.yaml").settings_hash
    (shop / "subs" / "O1000.nc").write_bytes(b"O1000\nM99\n")
    assert Machine.load("own.yaml").settings_hash != before


def test_a_folder_that_is_not_there_is_named_with_its_place(shop, command):
    run = command
    (shop / "m.yaml").write_text(MACHINE % ", subprograms: nope")
    with pytest.raises(MachineFileError, match=r"m\.yaml:7:.*'nope', which is no folder"):
        Machine.load("m.yaml")
    code, said = run("process", "part.nc", "-m", "own.yaml", "--subprograms", "nope", "-o", "-")
    assert code == 1
    assert "'nope', which is no folder" in said


def test_cycles_are_not_written_out_beside_other_files(shop, command):
    run = command
    code, said = run("process", "part.nc", "-m", "own.yaml", "--expand-cycles", "-o", "-")
    assert code == 1
    assert "--expand-cycles and subprograms of other files" in said


def test_cycles_are_written_out_where_all_calls_are(shop, command):
    (shop / "own.ngc").write_text(
        "G21 G90 G94 G64 G17 G98 F100\nG0 X0 Y0 Z5\no<row> call [3]\nM2\n"
    )
    (shop / "lib").mkdir()
    (shop / "lib" / "row.ngc").write_text(
        "o<row> sub\nG81 X#1 Z-3 R2\nX[#1*2]\nG80\no<row> endsub\nM2\n"
    )
    options = ("own.ngc", "-m", "vmc", "--subprograms", "lib", "--expand-cycles")
    code, said = command("process", *options)
    assert code == 1
    assert "add --unroll" in said
    code, said = command("process", *options, "--unroll")
    assert (code, "2 cycles written out; 1 loop or call written out" in said) == (0, True), said
    assert "followed into 1 file of lib (row.ngc)" in said
    code, said = command("verify", "own.ngc", "own.jerk.ngc", *options[1:5])
    assert (code, "1 loop or call written out, 2 cycles written out" in said) == (0, True), said
