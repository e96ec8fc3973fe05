"""Controller `linuxcnc-hal`: two files that belong together, and what `verify` makes of damage."""

import hashlib
import io
import re
from pathlib import Path

import numpy as np
import pytest

from gcodejerk import EmitError, Machine, process, verify
from gcodejerk.cli import main
from gcodejerk.emit import load_controller
from gcodejerk.machine import find_machine
from gcodejerk.verification import verify_files

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "golden" / "hal_position" / "machine.yaml").read_text().replace("0.005", "0.001")
MACHINE = Machine.loads(TEXT)
PROGRAM = (
    b"G21 G90 G17 G40 G94 G64\nG0 X0 Z0\nG1 X1 F600\nG0 X11 Z-5\nG91\nG0 Z2\nG0 X-3\nG90\n"
    b"G1 X5 F300\nG0 X100\nM2\n"
)
FORMS = ("adaptive-feed", "position")


def pair(form, program=PROGRAM, **options):
    result = process(program, MACHINE, form=form, **options)
    return result.output, result.beside


def judged(output, beside, program=PROGRAM):
    return verify(program, output, MACHINE, controller="linuxcnc-hal", beside=beside)


def samples(beside):
    """Numbers of each rapid, by its number."""
    out = {}
    for line in beside.decode().splitlines()[1:]:
        if line.startswith("rapid"):
            rows = out.setdefault(int(line.split()[1]), [])
        else:
            rows.append(float(line))
    return {number: np.array(rows) for number, rows in out.items()}


@pytest.mark.parametrize("form", FORMS)
def test_the_program_asks_for_the_rapids_that_stand_beside_it(form):
    output, beside = pair(form)
    asked = [
        int(n)
        for n in re.findall(rb"^M6[78] E3 Q\[?([1-9][0-9]*)(?:\+.*\])?$", output, re.MULTILINE)
    ]
    assert asked == list(samples(beside)) == [2, 3, 4, 5]
    assert judged(output, beside).ok


def test_increments_of_ten_decimals_add_up():
    """Five of them, each rounded to nine: the last point was past the end."""
    program = (
        b"G21 G91 G94 G64\nG90 G0 X0 Y0 Z0\nG91\nG0 X-1.1 Y-1\nG1 Z-.1 F10\nG0 Z.5\n"
        b"G0 Z-.4 X1.1 Y1\nG1 Z-.1 F10\nG0 Z.5\nM2\n"
    )
    made = process(program, Machine.load(find_machine("vmc")), controller="linuxcnc-hal")
    assert made.planned == 3
    assert b"G0 Z-0.0000002598 X0.0000007145 Y0.0000006496" in made.output
    assert made.verification.ok


def test_stream_means_adaptive_feed():
    assert pair("stream") == pair("adaptive-feed")
    assert load_controller("linuxcnc-hal").in_form("stream").form == "adaptive-feed"
    with pytest.raises(EmitError, match="cannot write --as pvt"):
        process(PROGRAM, MACHINE, form="pvt")


def test_shares_of_the_way_end_at_the_end():
    for rows in samples(pair("position")[1]).values():
        assert rows[-1] == 1.0
        assert (np.diff(rows) >= 0.0).all()


def test_speeds_add_up_to_the_way():
    output, beside = pair("adaptive-feed")
    feeds = [float(f) for f in re.findall(rb"F([0-9.]+)\nG0 [XZ][^\n]*\nG0 F", output)]
    lengths = [np.hypot(10, 5), 2.0, 3.0, 95.0]
    for rows, feed, length in zip(samples(beside).values(), feeds, lengths, strict=True):
        assert rows[-1] == 0.0
        assert rows.max() == 1.0
        moved = np.sum(0.5 * (rows + np.append(0.0, rows[:-1]))) * 1e-3 * feed / 60.0
        assert moved == pytest.approx(length, abs=1e-5)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_other_lines_are_kept_whatever_their_ends(form, end):
    program = PROGRAM.replace(b"\n", end)
    output, beside = pair(form, program)
    assert output.count(end) == output.count(b"\n")
    assert judged(output, beside, program).ok


DAMAGES = {
    "a sample": lambda o, b: (o, b.replace(b"\n0.1", b"\n0.2", 1)),
    "a rapid is missing": lambda o, b: (o, b[: b.index(b"rapid 3")] + b[b.index(b"rapid 4") :]),
    "a rapid too many": lambda o, b: (o, b + b[b.index(b"rapid 5") :]),
    "the order of rapids": lambda o, b: (o, b.replace(b"rapid 3 ", b"rapid 4 ", 1)),
    "the displacement": lambda o, b: (o, b.replace(b"rapid 2 4", b"rapid 2 5", 1)),
    "the number asked for": lambda o, b: (re.sub(rb"(E3 Q\[?)3\b", rb"\g<1>4", o), b),
    "the sum": lambda o, b: (re.sub(rb"M152 P[0-9]", b"M152 P9", o), b),
    "no M152": lambda o, b: (re.sub(rb"M152 [^\n]*\n", b"", o), b),
    "the end": lambda o, b: (o.replace(b"G0 X11 Z-5\n", b"G0 X11.001 Z-5\n"), b),
    "another form": lambda o, b: (
        o,
        b.replace(b"adaptive-feed", b"POSITION")
        .replace(b"position", b"adaptive-feed")
        .replace(b"POSITION", b"position"),
    ),
    "another interval": lambda o, b: (o, b.replace(b" 0.001\n", b" 0.002\n", 1)),
    "no samples": lambda o, b: (o, None),
    "no file of samples": lambda o, b: (o, b"block,t,X\n"),
    "text in the samples": lambda o, b: (o, b.replace(b"\n0.1", b"\nx.1", 1)),
    "a backward sample": lambda o, b: (o, b.replace(b"\n0.5", b"\n0.0", 1)),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("damage", DAMAGES)
def test_verify_finds(form, damage):
    output, beside = DAMAGES[damage](*pair(form))
    found = judged(output, beside)
    assert not found.ok


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda b: b"", "no file of samples: it is empty"),
        (lambda b: b.replace(b"\n", b"\r\n"), "its lines end with CR LF"),
        (lambda b: b"\xef\xbb\xbf" + b, r"begins with b'\\xef\\xbb\\xbfgcodejerk streams 1"),
        (lambda b: b.replace(b"\n0.1", b"\nnan", 1), "was changed since"),
        (lambda b: b[: len(b) // 2], "not the one that was written with this program"),
        (lambda b: b[:-1], "not the one that was written with this program"),
        (lambda b: pair("position", PROGRAM.replace(b"X100", b"X90"))[1], "not the one that was"),
    ],
)
def test_verify_says_what_became_of_the_file_of_samples(damage, says):
    output, beside = pair("position")
    first = judged(output, damage(beside)).violations[0]
    assert str(first.kind) == "samples"
    assert re.search(says, first.problem), first.problem


def test_samples_of_ways_are_asked_for_where_no_coordinate_system_is_turned():
    """R of G54 is kept by the control: the drives would go along the unturned way."""
    output, beside = pair("position")
    asks = b"M68 E3 Q[3+1000000*[ABS[#[5210+20*#5220]]]]"
    assert output.count(asks) == 1
    found = judged(output.replace(asks, b"M68 E3 Q3"), beside).violations
    assert any(f"expected '{asks.decode()}'" in v.problem for v in found), found


def test_samples_are_asked_for_where_the_machine_stands_at_their_start():
    """An absolute rapid says where its axes begin; one in increments begins where it stands."""
    inches = PROGRAM.replace(b"G0 X100", b"G0 X100\nG20\nG0 X1.5")
    output, beside = pair("position", inches)
    asks = [line for line in output.splitlines() if line.startswith(b"M68 E3 Q[")]
    turned = b"000000*[ABS[#[5210+20*#5220]]"
    assert asks[0] == b"M68 E3 Q[2+1" + turned + b"+ABS[#5420-1]+ABS[#5422]]]"
    assert asks[2] == b"M68 E3 Q[4+1" + turned + b"]]"
    assert asks[4] == b"M68 E3 Q[6+1" + turned + b"+ABS[#5420-3.937007874]]]"
    assert judged(output, beside, inches).ok
    for wrong in (b"", b"+ABS[#5420-2]", b"+ABS[#5421-1]", b"+ABS[#5420-1]]*[0"):
        found = judged(output.replace(b"+ABS[#5420-1]", wrong), beside, inches).violations
        assert any("expected 'M68 E3 Q[2" in v.problem for v in found), (wrong, found)


BOTH = (
    b"M67 E3 Q2",
    b"m 068 e +3.0 q1",
    b"Q2 E3 M67",
    b"M68 E[1+2] Q2",
    b"M66 P3 L3 Q1",
    b"M[60+7] E3 Q2",
    b"M67 E2.6 Q2",
    b"M+68. E3 Q2",
    b"M66.99999 E3 Q2",
    b"m066.0 P+2.5 L3 Q1",
)
TAKEN = [
    *((form, line) for form in FORMS for line in BOTH),
    ("adaptive-feed", b"M52 P0"),
    ("adaptive-feed", b"M 52 P1"),
    ("position", b"M66 P1 L3 Q1"),
    ("position", b"#1 = [#5399 + 1]"),
    ("position", b"(debug, came #5399)"),
    ("position", b"#1 = ##2"),
    ("position", b"M98 P100"),
    ("position", b"M97.99999 P100"),
    ("position", b"#1 = #+5399"),
    ("position", b"#1 = #5398.99999"),
    ("adaptive-feed", b"M52.00001 P0"),
]


@pytest.mark.parametrize(("form", "line"), TAKEN)
def test_programs_that_say_what_the_form_says_are_refused(form, line):
    program = PROGRAM.replace(b"G1 X5 F300\n", line + b"\nG1 X5 F300\n")
    with pytest.raises(EmitError, match="no stream of linuxcnc-hal can stand") as caught:
        process(program, MACHINE, form=form)
    assert caught.value.place.line == 9
    # Nor does the proof let such an output pass.
    output, beside = pair(form)
    found = judged(output.replace(b"G1 X5 F300", line + b"\nG1 X5 F300"), beside, program)
    assert [v.original_line for v in found.violations if "no stream may stand" in v.problem] == [9]


@pytest.mark.parametrize("end", [b"M99", b"m 099 (again)", b"/M99"])
def test_a_program_that_leads_back_to_a_caller_is_told_what_helps(end):
    program = PROGRAM.replace(b"M2\n", end + b"\nM2\n")
    assert process(program, MACHINE, form="adaptive-feed").planned
    with pytest.raises(EmitError) as caught:
        process(program, MACHINE, form="position")
    problem, _, remedy = str(caught.value).partition(": no stream")
    assert problem.endswith("M99 leads back to a caller, which may use #5399")
    assert "M98" not in str(caught.value)
    assert (
        "end the program with M2 or M30 if no other one calls it, or process with --as adapt"
        in (remedy)
    )


OWN = (
    b"M67 E2.4 Q3",
    b"M67 E2 Q3",
    b"M68 E30 Q1",
    b"(M67 E3 Q2)",
    b"; M52 P0",
    b"M62 P3",
    b"#<m67> = 5",
)


@pytest.mark.parametrize(
    ("form", "line"),
    [*((form, line) for form in FORMS for line in OWN), ("adaptive-feed", b"M66 P13 L0")],
)
def test_other_outputs_and_inputs_are_the_programs_own(form, line):
    program = PROGRAM.replace(b"G1 X5 F300\n", line + b"\nG1 X5 F300\n")
    output, beside = pair(form, program)
    assert judged(output, beside, program).ok


@pytest.mark.parametrize("form", FORMS)
def test_samples_that_were_changed_together_with_their_sum_are_judged_by_what_they_play(form):
    """Who writes the sum anew still has to keep the limits and the ends."""
    output, beside = pair(form)
    rows = beside.splitlines(keepends=True)
    middle = len(rows) - len(samples(beside)[5]) // 2
    rows[middle] = b"%.12f\n" % (float(rows[middle]) * 0.98)
    changed = b"".join(rows)
    digest = hashlib.blake2b(changed, digest_size=6).digest()
    sums = (int.from_bytes(digest[:3], "big"), int.from_bytes(digest[3:], "big"))
    output = re.sub(rb"M152 [^\n]*", b"M152 P%08d Q%08d" % sums, output)
    kinds = {str(v.kind) for v in judged(output, changed).violations}
    assert kinds & {"acceleration limit", "jerk limit", "backwards or past the end"}


def test_a_program_without_its_samples_is_refused_by_name():
    output, _ = pair("position")
    machine = MACHINE
    found = verify_files(io.BytesIO(PROGRAM), io.BytesIO(output), machine)
    assert "no file of samples beside" in found.violations[0].problem


def test_machines_and_programs_that_it_cannot_serve_are_refused():
    with pytest.raises(EmitError, match="positioning: independent"):
        process(PROGRAM, Machine.loads(TEXT.replace("linear", "independent")))
    with pytest.raises(EmitError, match="read as fanuc"):
        process(PROGRAM, MACHINE, dialect="fanuc")


def run(capsys, monkeypatch, *arguments):
    monkeypatch.setattr("sys.argv", ["gcodejerk", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    return ended.value.code, out, err


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "part.ngc").write_bytes(PROGRAM)
    (tmp_path / "m.yaml").write_text(TEXT)
    return tmp_path


def test_both_files_appear_together_and_are_verified(folder, capsys, monkeypatch):
    part, machine = folder / "part.ngc", folder / "m.yaml"
    for form in FORMS:
        code, out, _ = run(capsys, monkeypatch, "process", part, "-m", machine, "--as", form)
        assert code == 0
        assert "part.jerk.ngc.streams" in out
        written = [folder / name for name in ("part.jerk.ngc", "part.jerk.ngc.streams")]
        assert tuple(path.read_bytes() for path in written) == pair(form)
        done = folder / "part.jerk.ngc"
        code, out, _ = run(capsys, monkeypatch, "verify", part, done, "-m", machine)
        assert (code, "nothing else changed" in out) == (0, True)
    (folder / "part.jerk.ngc.streams").unlink()
    code, out, _ = run(capsys, monkeypatch, "verify", part, done, "-m", machine)
    assert (code, "no file of samples" in out) == (1, True)


def test_standard_output_cannot_hold_two_files(folder, capsys, monkeypatch):
    part, machine = folder / "part.ngc", folder / "m.yaml"
    code, out, err = run(capsys, monkeypatch, "process", part, "-m", machine, "-o", "-")
    assert (code, out) == (2, "")
    assert "writes two files" in err
    code, _, _ = run(capsys, monkeypatch, "process", part, "-m", machine, "--check")
    assert code == 3
    assert sorted(p.name for p in folder.iterdir()) == ["m.yaml", "part.ngc"]


def test_in_place_and_folders_keep_the_samples_beside_the_program(folder, capsys, monkeypatch):
    part, machine = folder / "part.ngc", folder / "m.yaml"
    out = folder / "out"
    assert run(capsys, monkeypatch, "process", part, "-m", machine, "--output-dir", out)[0] == 0
    assert sorted(p.name for p in out.iterdir()) == ["part.ngc", "part.ngc.streams"]
    assert run(capsys, monkeypatch, "process", part, "-m", machine, "--in-place")[0] == 0
    assert part.read_bytes() == (out / "part.ngc").read_bytes()
    assert (folder / "part.ngc.streams").read_bytes() == (out / "part.ngc.streams").read_bytes()


def test_a_file_of_somebody_elses_is_not_replaced(folder, capsys, monkeypatch):
    (folder / "part.jerk.ngc.streams").write_text("mine")
    part, machine = folder / "part.ngc", folder / "m.yaml"
    code, _, err = run(capsys, monkeypatch, "process", part, "-m", machine)
    assert (code, "was not written by gcodejerk" in err) == (1, True)
    assert not (folder / "part.jerk.ngc").exists()
    assert (folder / "part.jerk.ngc.streams").read_text() == "mine"
