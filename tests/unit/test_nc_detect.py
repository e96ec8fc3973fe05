"""``dialect: auto`` finds the dialect, says why, or refuses."""

import io
from dataclasses import replace
from pathlib import Path

import pytest

from gcodejerk import Machine, ProgramError, process
from gcodejerk.errors import EmitError
from gcodejerk.machine import find_machine
from gcodejerk.nc import AUTO, read_program
from gcodejerk.nc.dialects import detect
from gcodejerk.nc.dialects.any_mill import MEMBERS
from gcodejerk.nc.dialects.detect import detect_dialect
from gcodejerk.verification import verify

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
        (b"N10 G40 G17 G90\nN20 G3 X-22.3 Y19.7 CR=4. F250\nN30 G0 Z5\n", "siemens"),
        (b"N10 G90\nN20 G0 X=IC(5) Y20\n", "siemens"),
        (b"%PART G71 *\nN10 G00 X+1*\n", "heidenhain-iso"),
        (b"N10 G00 X+1*\nN20 G15 H30 R5*\n", "heidenhain-iso"),  # an arc around a pole
        (b"%\nO1000 (HAAS VF2)\nG0 X1.\n", "haas"),
        (b"%\nO1000\nG187 P3\nG0 X1.\n", "haas"),
        (b"%\nO1000\nG5.1 Q1\nG0 X1.\n", "fanuc"),
        (b"%\nO1000\nG28 U0 W0\nG50 S2500\nG0 X1.\n", "fanuc-lathe-a"),
        (b"(FANUC)\nG28 U0 W0\n", "fanuc-lathe-a"),
        (b"%\nO1\nN10G90G5.1Q1\nN70IF[#101GT10.]GOTO100\n", "fanuc"),
        (b'N30MSG("A")\nG0X1\n', "siemens"),
        (b"(Post Processor: mach3_mach4_post)\nG0 X1\n", "mach"),
        (b"(uccnc_post --no-show-editor)\nG0 X1\n", "uccnc"),
        (b";Post Processor: centroid_post\nG0 X1\n", "centroid"),
        (b"(EdingCNC)\nG0 X1\n", "edingcnc"),
        (b"; PlanetCNC TNG\nG0 X1\n", "planetcnc"),
        (b"(MASSO G3)\nG0 X1\n", "masso"),
        (b"%\nO1000 (MELDAS)\nG0 X1.\n", "mitsubishi"),
        (b"%\nO1000 (MAZAK VCN-530)\nG0 X1.\n", "mazatrol-eia"),
        (b"%\nO1000 (SYNTEC 22MA)\nG0 X1.\n", "syntec"),
        (b"$PART.MIN%\nO1000\nG15 H1\nG0 X1.\n", "okuma"),
        (b"%PART\n; FAGOR 8065\nG0 X1\n", "fagor"),
        (b"; for a Duet\nM453\nG0 X1\n", "duet"),
        (b"0 BEGIN PGM PART MM\n1 L X+1 FMAX\n", "klartext"),
        (b"BEGIN PGM PART INCH\nL X+1 FMAX\n", "klartext"),
        (b"%\nO1000\nT0101\nG50 S2500\nG0 X1.\n", "fanuc-lathe-a"),
        (b"%O1200(PART)\nG92 S500\nG97 S300 M3\nG90 G0 X1.\n", "fanuc-lathe-b"),
        (b"(made for LinuxCNC)\n(keeps compatibility with Mach3)\nG0 X1\n", "linuxcnc"),
    ],
)
def test_the_dialect_is_found(text, dialect):
    found, why = detect_dialect(text, "part.nc")
    assert found.name == dialect
    assert "line" in why


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        (b"%\r\nO1000\r\nG90 G0 X1.\r\n", "iso-mill"),
        # macro B is the language of both, tape or not
        (b"O1000\nG0 X1.\nIF [#1 GT 2.] GOTO 10\nN10 M30\n", "iso-mill"),
        (b"G0 X1.\nWHILE[#1 LT 2.]DO1\n#1=#1+1.\nEND1\n", "iso-mill"),
        (b"%\n\nO1000 (PART)\nG90 G0 X1.\n", "iso-mill"),
        # peck drilling in a column, and a comment of how the spindle turns, on a mill
        (b"%\nO1000\nG90 G0 X1. Y2.\nG73 Z-3. R1. Q.5 F90.\nG80\n", "iso-mill"),
        (b"%\nO1000 (SQUARE)\nM3 S1000 (TURN SPINDLE ON)\nG0 X1. Y2.\n", "iso-mill"),
        (b"(Exported by a program)\nG90 G0 X1\n", "rs274"),
        # nothing tells any mill's control from another
        (b"G21 G90 G17\nG0 X1.5 Y2.\n", "any-mill"),
        (b"; roughing\nG90 G0 X1\n", "rs274"),
        (b"G21\r\nG90\r\nG0 X1\r\n", "rs274"),
        (b"G0 X1.23456 Y2\n", "rs274"),
        (b"G17 G91.1 G90\nG0 X1.\n", "rs274"),
    ],
)
def test_what_several_read_alike_is_read_so(text, dialect):
    found, why = detect_dialect(text, "part.nc")
    assert found.name == dialect
    assert "alike" in why
    with pytest.raises(ProgramError, match="cannot be told"):
        detect_dialect(text, "part.nc", lathe=True)


def test_commands_of_other_programs_are_none_of_grbls():
    """An editor's own lines begin with a $, too."""
    text = b"%\n$AddRegPart 1 X2.925\n$Inches (Alarm)\n{$HOLES1=8}\nG0 X1.\n"
    with pytest.raises(ProgramError, match="cannot be told"):
        detect_dialect(text, "part.nc")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"G21 G90\nG0 X1\nM30\n", "cannot be told"),
        (b"G21\nG90\nG0 X1\nL20\nCALLSUB(5)\n", "cannot be told"),
        (b"O1000\nG21 G90\nG0 X1.\nM30\n", "cannot be told"),
        (b"%\nO1000\nG21 G90\nT0101\nG96 S100\nG0 X1.\nM30\n%\n", "cannot be told"),
        (b"%\nO1000\nG0 X50. Z2.\nG73 P10 Q20\nG80\n", "cannot be told"),
        (b"%\nO1000 (TURN OD)\nG0 X50. Z2.\n", "cannot be told"),
        (b"%\nO1000 (Y AXIS LATHE)\nG0 X50. Y2.\nG71 U2. R1.\n", "cannot be told"),
        (b"M82\nM104 S200\nG0 X1\n", "klipper: printer codes"),
        (b"(FANUC OR SIEMENS)\nG0 X1\n", "several dialects"),
        (b"(MAZAK)\nT0101\nG50 S2000\nG0 X1.\n", "lathe"),
        (b"(FANUC)\nG15 H1\nG0 X1.\n", "several dialects"),
        # what a tool or a part is called says nothing of the control
        (b"(MITSUBISHI APMT 1604, AREA CENTROID X5)\nO1000\nG0 X1.\n", "cannot be told"),
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


COMMON = b"G21 G90 G17 G94 F300.\nM5\nG0 X0. Y0. Z5.\nG1 X3.\nG0 X90. Y40.\nG1 Z1.\nM2\n"


@pytest.mark.parametrize("controller", [member.name for member in MEMBERS])
def test_what_any_mill_reads_is_written_as_the_control_that_runs_it_has_it(controller):
    machine = replace(Machine.load(find_machine("vmc")), controller=controller)
    result = process(COMMON, machine, dialect="auto")
    assert result.program.dialect == "any-mill"
    assert result.planned == 1
    assert result.verification.ok
    assert verify(COMMON, result.output, machine).ok
    own = process(COMMON, machine, dialect=controller)

    def points(made):
        return [line for line in made.splitlines() if line.startswith((b"G1 ", b"G4", b"G0 F"))]

    # Its points, and how they begin and end, are those of the control's own language.
    assert points(result.output) == points(own.output)
    damaged = result.output.replace(points(own.output)[5], points(own.output)[4], 1)
    assert not verify(COMMON, damaged, machine).ok


def test_what_any_mill_reads_is_not_written_for_other_controls():
    with pytest.raises(EmitError, match="any-mill") as refused:
        process(COMMON, Machine.load(find_machine("vmc")), controller="siemens", dialect="auto")
    assert "--dialect" in refused.value.remedy


@pytest.mark.skipif(not SHARED.exists(), reason="../shared is not here: no real programs to read")
def test_a_real_program_is_never_taken_for_another_dialect():
    posts = {"mach3_mach4": "mach"}
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


def test_what_stands_far_behind_in_a_line_tells_nothing():
    near, far = b"G0 X1" + b" " * 200 + b"G187 P1\n", b"G0 X1" + b" " * 300 + b"G187 P1\n"
    assert detect_dialect(b"%\nO1000\n" + near, "part.nc")[0].name == "haas"
    assert detect_dialect(b"%\nO1000\n" + far, "part.nc")[0].name == "iso-mill"


@pytest.mark.parametrize("part", ["LID FOR MACH3 BOX", "LINUXCNC BOX", "GRBL ENCLOSURE"])
def test_a_comment_may_name_the_part_and_not_the_control(part):
    # Read as Mach's, X100 of a Fanuc was 100 mm instead of 0.1, and the tool plunged.
    body = b"G21 G90 G54\nN2 G0 X100 Y50\nN4 G1 Z-5 F100\nN6 G0 Z20\nM30\n"
    tape = b"%%\nO1234 (%s)\n" % part.encode() + body + b"%\n"
    with pytest.raises(ProgramError, match="iso-mill: a % and a program number"):
        detect_dialect(tape, "part.nc")
    named = b"(%s)\n" % part.encode() + body
    dialect, _ = detect_dialect(named, "part.nc")
    assert dialect.name in part.lower()
    for control in ("fanuc", "haas", "siemens"):
        with pytest.raises(ProgramError, match=f"the machine's control reads {control}") as no:
            detect_dialect(named, "part.nc", control=control)
        assert f"--dialect {control}" in no.value.remedy
    assert detect_dialect(named, "part.nc", control="linuxcnc")[0] is dialect
    with pytest.raises(ProgramError, match="fanuc-lathe-a: a tool with its offset"):
        detect_dialect(named.replace(b"N2", b"T0101\nN2"), "part.nc")


@pytest.mark.parametrize("sign", [b"G21\nG90\n", b"(made with care)\nG21 G90\n"])
def test_what_controls_on_a_pc_read_alike_is_not_read_so_for_a_machining_centre(sign):
    program = sign + b"G0 X100 Y50\nG1 Z-5 F100\nG0 Z20\nM30\n"
    assert detect_dialect(program, "part.nc")[0].name == "rs274"
    with pytest.raises(ProgramError, match="the machine's control reads haas"):
        detect_dialect(program, "part.nc", control="haas")
    machine = replace(Machine.load(find_machine("vmc")), dialect="auto")
    assert process(program, machine).program.dialect == "rs274"
    with pytest.raises(ProgramError, match="the machine's control reads haas"):
        process(program, machine, controller="haas")
