"""``dialect: auto`` finds the dialect, says why, or refuses."""

import io
from pathlib import Path

import pytest

from gcodejerk import Machine, ProgramError, process
from gcodejerk.machine import find_machine
from gcodejerk.nc import AUTO, read_program
from gcodejerk.nc.dialects import detect
from gcodejerk.nc.dialects.detect import detect_dialect

SHARED = Path(__file__).resolve().parents[2].parent / "shared"


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        (b"o100 sub\nG0 X1\no100 endsub\n", "linuxcnc"),
        (b"#<depth> = 3\nG0 X1\n", "linuxcnc"),
        (b"(Post Processor: grbl_post)\nG0 X1\n", "grbl"),
        (b"$H\nG0 X1\n", "grbl"),
        (b"; generated for Klipper\nG0 X1\n", "klipper"),
        (b"SET_VELOCITY_LIMIT ACCEL=3000\nG0 X1\n", "klipper"),
        (b"; FLAVOR:Marlin\nG0 X1\n", "marlin"),
        (b"%_N_PART_MPF\n;$PATH=/_N_MPF_DIR\nG0 X1\n", "siemens"),
        (b'N30 MSG("ROUGH")\nG0 X1\n', "siemens"),
        (b"%PART G71 *\nN10 G00 X+1*\n", "heidenhain-iso"),
        (b"%\nO1000 (HAAS VF2)\nG0 X1.\n", "haas"),
        (b"%\nO1000\nG187 P3\nG0 X1.\n", "haas"),
        (b"%\nO1000\nG5.1 Q1\nG0 X1.\n", "fanuc"),
        (b"%\nO1000\nG28 U0 W0\nG50 S2500\nG0 X1.\n", "fanuc-lathe-a"),
        (b"(FANUC)\nG28 U0 W0\n", "fanuc-lathe-a"),
        (b"%\nO1\nN10G90G5.1Q1\nN70IF[#101GT10.]GOTO100\n", "fanuc"),
        (b'N30MSG("A")\nG0X1\n', "siemens"),
        (b"(Post Processor: mach3_mach4_post)\nG0 X1\n", "mach"),
    ],
)
def test_the_dialect_is_found(text, dialect):
    found, why = detect_dialect(text, "part.nc")
    assert found.name == dialect
    assert "line" in why


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"G21 G90\nG0 X1\nM30\n", "cannot be told"),
        (b"%\nO1000\nG21 G90\nG0 X1.\nM30\n%\n", "fanuc, haas and mach"),
        (b"M82\nM104 S200\nG0 X1\n", "klipper: printer codes"),
        (b"(FANUC OR SIEMENS)\nG0 X1\n", "several dialects"),
        (b"0 BEGIN PGM PART MM\n1 L X+1 FMAX\n", "Klartext"),
        (b"(O1000 SUB)\nG0 X1\n", "cannot be told"),
    ],
)
def test_what_is_not_sure_is_refused(text, words):
    with pytest.raises(ProgramError, match=words):
        detect_dialect(text, "part.nc")


def test_the_choice_is_told_with_its_reason():
    program = b"(Post Processor: grbl_post)\nG90 G21\nG0 X1\nG0 X2\n"
    read = read_program(io.BytesIO(program), dialect=AUTO)
    assert read.dialect == "grbl"
    assert read.findings[0].message == "read as grbl: a comment names grbl (line 1)"
    machine = Machine.load(find_machine("vmc"))
    result = process(program, machine, dialect="auto", controller="grbl")
    assert result.verification.ok
    assert any("read as grbl" in note for note in result.notes)


@pytest.mark.skipif(not SHARED.exists(), reason="../shared is not here: no real programs to read")
def test_a_real_program_is_never_taken_for_another_dialect():
    posts = {"mach3_mach4": "mach", "uccnc": "mach", "centroid": "mach"}
    sure = 0
    for path in sorted((SHARED / "hosts" / "nc").glob("*.ngc")):
        post = path.stem.split("__")[1]
        try:
            found, _ = detect_dialect(path.read_bytes(), path.name)
        except ProgramError:
            continue
        sure += 1
        assert found.name == posts.get(post, post), path.name
    assert sure > 30


def test_no_pattern_runs_over_line_ends():
    """Beginning anew at every one of many line ends, such a pattern took minutes for 60 KB."""
    patterns = [e.pattern for e in detect.CODE] + [pattern for pattern, _ in detect.LATHE]
    patterns += [detect._KLARTEXT, detect._O_PROGRAM, detect._INCREMENTS]
    assert len(patterns) > 20
    assert not [p.pattern for p in patterns if b"\\s" in p.pattern]
