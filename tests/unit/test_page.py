"""The page to look at: what it says, what it holds, and that nothing of a program is markup."""

import base64
import hashlib
import html
import io
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc.feed_moves import feed_moves
from gcodejerk.reasons import CERTAIN, EXPLAINED, REASONS, Reason
from gcodejerk.report.page import columns, document
from gcodejerk.report.page.columns import Figures, chosen_rapids
from gcodejerk.report.page.document import MARK, page_html
from gcodejerk.report.page.text import script_data
from gcodejerk.rewrite.pipeline import Settings, process, process_file

ROOT = Path(__file__).parents[2]
VMC_TEXT = find_machine("vmc").read_text()
VMC = Machine.loads(VMC_TEXT)
PLATE = (ROOT / "samples" / "plate.ngc").read_bytes()
HEAD = b"G21 G90 G94 G17 G64 P0.01\nG1 X0 Y0 Z0 F200\n"
TAIL = b"G1 Z0 F200\nM2\n"
TYPES = {"u1": np.uint8, "u2": np.uint16, "i4": np.int32, "f4": np.float32, "f8": np.float64}


def page_of(data, machine=VMC, name="part.nc", **options):
    result = process(data, machine, name=name, **options)
    text = page_html(result, machine, "part.jerk.nc", io.BytesIO(data), len(result.output))
    return result, text


def data_of(page):
    return json.loads(re.search(r'<script type="application/json"[^>]*>(.*?)</script>', page)[1])


def unpacked(column):
    return np.frombuffer(base64.b64decode(column["data"]), dtype=TYPES[column["type"]])


def said(page):
    """The text of a page without its scripts."""
    bare = re.sub(r"<(script|style)\b.*?</\1>", "", page, flags=re.DOTALL)
    return html.unescape(re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", bare)))


@pytest.fixture(scope="module")
def plate():
    return page_of(PLATE)


def test_page_says_what_changed_in_one_sentence_and_three_figures(plate):
    result, page = plate
    text = said(page)
    assert (
        "19 of 26 rapids were rewritten in the same time: the worst vibration that one of them "
        "leaves falls from 469 to 35.8 µm (7.6 % of today's), and 9.7 s of waiting" in text
    )
    assert page.count('<div class="figure">') == 3
    assert "839 bytes" in text
    assert f"{len(result.output) / 1000:.1f} kB" in text
    assert "19 of 19 rewritten rapids confirmed by a second reading" in text
    assert all(note in text for note in result.notes)


def test_reasons_stand_with_their_remedies_most_rapids_first(plate):
    text = said(plate[1]).split("What helps")[1]
    first, second = (text.index(str(r)) for r in (Reason.CANNED_CYCLE, Reason.START_UNKNOWN))
    assert first < second
    assert "--expand-cycles writes them out" in text


def test_columns_hold_what_the_result_holds(plate):
    result, page = plate
    rapids = data_of(page)["rapids"]
    assert unpacked(rapids["line"]).tolist() == result.program.rapids.line.tolist()
    planned = unpacked(rapids["reason"]) == CERTAIN
    assert planned.sum() == 19
    for name, own in (("after", result.residual), ("before", result.conventional_residual)):
        assert unpacked(rapids[name])[planned] == pytest.approx(own[planned].max(axis=1), rel=1e-6)
        assert np.isnan(unpacked(rapids[name])[~planned]).all()
    ends = np.column_stack([unpacked(column) for column in rapids["end"]])
    assert np.array_equal(ends, result.program.rapids.target[:, :3], equal_nan=True)
    saved = unpacked(rapids["waited"])[planned] - unpacked(rapids["waits"])[planned]
    assert saved.sum() == pytest.approx(9.7, abs=0.05)


def test_each_different_profile_is_kept_once(plate):
    result, page = plate
    curves = data_of(page)["rapids"]["curves"]
    after = unpacked(curves["after"])
    assert len(after) == 19
    kept = len(unpacked(curves["profiles"]["first"])) - 1
    assert kept < 2 * 19
    ways = result.plans.displacement[result.plans.planned]
    same = [k for k in range(19) if np.array_equal(ways[k], ways[0])]
    assert len({after[k] for k in same}) == 1


def test_nothing_but_its_own_scripts_may_run_and_nothing_is_fetched(plate):
    page = plate[1]
    assert page.startswith(MARK)
    policy = html.unescape(re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1])
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    scripts = re.findall(r"<script>(.*?)</script>", page, flags=re.DOTALL)
    styles = re.findall(r"<style>(.*?)</style>", page, flags=re.DOTALL)
    assert (len(scripts), len(styles)) == (2, 1)
    for text in scripts + styles:
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in policy
    assert not re.search(r'(?:src|href|action)="(?!#|data:,)', page)
    assert not re.search(r"\sstyle=|\son\w+=", re.sub(r"<script.*", "", page, flags=re.DOTALL))
    assert "Copyright (c) 2022 Leon Sorokin" in page


def test_text_from_outside_is_never_markup():
    evil = "</script><script>alert(1)</script><!-- \u202e\xb5 \u2028 &quot;'\""
    block = "G0 Z1 (" + evil.replace("(1)", "1") + ")"
    machine = replace(VMC, name=evil, source=evil)
    result, page = page_of(HEAD + block.encode() + b"\n" + TAIL, machine, name=f"/x/{evil}.nc")
    assert result.planned == 1
    assert page.count("</script") == 3
    assert page.count("<script") == 3
    assert page.count("<!--") == 1
    shown = data_of(page)["rapids"]["block"]
    assert shown == [block.replace("\u202e", "\ufffd").replace("\u2028", "\ufffd")]
    assert "\u202e" not in page
    assert evil.replace("\u202e", "\ufffd").replace("\u2028", "\ufffd") in said(page)


def test_bytes_that_are_no_utf8_and_names_that_are_none_are_shown():
    name = "teil\udcfc.nc"
    _, page = page_of(HEAD + b"G0 Z1 (10 \xb5m)\n" + TAIL, name=name)
    page.encode("utf-8")
    assert data_of(page)["rapids"]["block"] == ["G0 Z1 (10 µm)"]
    assert "teil\\udcfc.nc" in said(page)
    assert script_data({"a": "</x>&\u2028"}) == '{"a":"\\u003c/x\\u003e\\u0026\\u2028"}'


def test_a_program_in_inches_is_shown_in_inches():
    _, page = page_of(b"G20 G90 G94 G17 G64\nG1 X0 Y0 Z0 F20\nG0 Z1.\nM2\n")
    unit = data_of(page)["unit"]
    assert (unit["length"], unit["small"]) == ("in", "thou")
    text = said(page)
    assert "thou" in text
    assert "µm" not in text.split("Before it runs")[0]


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"G21 G90 G1 X0 F100\nM2\n", "has no rapids"),
        (b"G21 G91\nG0 X1\nM2\n", "Its only rapid was not rewritten"),
    ],
)
def test_pages_of_programs_that_stay_as_they_are(data, says):
    _, page = page_of(data)
    assert says in said(page)
    assert "unchanged" in said(page)


def test_page_of_a_program_that_sets_its_control():
    case = ROOT / "tests" / "golden" / "settings_smoothieware"
    machine = Machine.load(case / "machine.yaml")
    _, page = page_of((case / "in.ngc").read_bytes(), machine, form="parameters")
    assert "The control is set at 4 places" in said(page)
    rapids = data_of(page)["rapids"]
    assert np.isnan(unpacked(rapids["after"])).all()
    assert np.nanmax(unpacked(rapids["before"])) > 0.0


def test_axes_on_their_own_have_a_profile_each():
    text = VMC_TEXT.replace("positioning: linear", "positioning: independent")
    result, page = page_of(
        HEAD + b"G0 X30 Y20\nG0 Z5\n" + TAIL, Machine.loads(text), controller="csv"
    )
    assert result.planned == 2
    curves = data_of(page)["rapids"]["curves"]
    assert unpacked(curves["first"]).tolist() == [0, 2, 3]
    assert unpacked(curves["axis"]).tolist() == [0, 1, 2]


def test_rotary_axes_and_cycles_are_on_the_page():
    axis = (
        "  A:\n    wrap: none\n    rapid: {velocity: 60, acceleration: 300}\n"
        "    limit: {acceleration: 360, jerk: 4.0e+5}\n"
        "    modes: [{frequency: 20, damping: 0.02, participation: 0.5}]\n"
    )
    machine = Machine.loads(VMC_TEXT.replace("axes:\n", "axes:\n" + axis))
    program = HEAD.replace(b"Z0", b"Z0 A0") + b"G0 A90\nG81 X9 Y9 Z-5 R2 F100\nG80\n" + TAIL
    result, page = page_of(program, machine, controller="csv")
    assert data_of(page)["rotary"] == ["A", "B", "C"]
    assert result.planned == 1
    result, page = page_of(program.replace(b"G0 A90\n", b""), VMC, expand_cycles=True)


def test_a_long_program_shows_what_leaves_the_most(monkeypatch):
    monkeypatch.setattr(document, "MOST_RAPIDS", 5)
    monkeypatch.setattr(columns, "CURVE_BYTES", 60)
    monkeypatch.setattr(document, "MOST_LINES", 10)
    result, page = page_of(PLATE)
    assert "the 5 rapids that leave the most, of 26 rapids" in said(page)
    assert "not all of its feed moves" in said(page)
    data = data_of(page)
    worst = np.sort(Figures.of(result).after[result.plans.planned])[-5:]
    assert np.sort(unpacked(data["rapids"]["after"])) == pytest.approx(worst, rel=1e-6)
    assert unpacked(data["feed"]).size == 0
    curves = data["rapids"]["curves"]
    assert curves["full"]
    assert unpacked(curves["first"])[-1] < 5


def test_ten_thousand_different_rapids_with_long_blocks_make_less_than_five_megabytes(request):
    # The page grows with its rapids, up to bounds: a third of them shows it.
    many = 10_000 if request.config.getoption("--long") else 3_333
    lines = [HEAD.decode()]
    for k in range(many):
        x, y = 400.0 * math.sin(k) ** 2, 300.0 * math.sin(1.3 * k) ** 2
        lines.append(f"G0 X{-x:.4f} Y{-y:.4f} ({'long ' * 30})\nG1 Z{-k % 9}\n")
    data = "".join(lines).encode() + b"M2\n"
    settings = Settings(profile="conventional")
    result = process_file(io.BytesIO(data), None, VMC, settings, "part.nc")
    page = page_html(result, VMC, None, io.BytesIO(data), 0)
    rapids = data_of(page)["rapids"]
    assert rapids["count"] == many
    assert max(map(len, rapids["block"])) == columns.LONGEST_TEXT
    assert 200 * many < len(page) < 450 * many
    # what is not in this page: curves up to their bound, planned and today's
    curves = sum(len(c["data"]) for c in rapids["curves"]["profiles"].values())
    assert len(page) - curves + columns.CURVE_BYTES * 4 / 3 < 5e6


def test_the_rapids_of_a_page_keep_the_order_of_the_file():
    nothing = np.full(4, np.nan)
    after = np.array([3.0, np.nan, 5.0, 1.0])
    figures = Figures(nothing, after, nothing, nothing, np.zeros(4, int), nothing, nothing)
    assert chosen_rapids(figures, 2).tolist() == [0, 2]
    assert chosen_rapids(figures, 4).tolist() == [0, 1, 2, 3]


def test_every_reason_has_a_meaning_and_a_remedy():
    assert list(EXPLAINED) == list(Reason)
    for told in EXPLAINED.values():
        assert told.means
        assert 10 < len(told.remedy) < 300
        assert told.remedy.count("`") % 2 == 0


SIEMENS = {"controller": "siemens", "dialect": "siemens"}
SIEMENS_HEAD = b"G710 G40 G90 G94 G17 G64\nG1 X0 Y0 Z0 F200\n"


@pytest.mark.parametrize(
    ("reason", "before", "after", "options"),
    [
        (Reason.BLOCK_DELETE, b"/G0 X30\n", b"G0 X30\n", {}),
        (Reason.EXPRESSION, b"#1=#5003\nG0 X#1\n", b"#1=[90/7]\nG0 X#1\n", {}),
        (Reason.FRAME_CHANGE, b"G0 G54 X30\n", b"G54\nG0 X30\n", {}),
        (Reason.CUTTER_COMPENSATION, b"G41 D1\nG0 X30\n", b"G40\nG0 X30\n", {}),
        (Reason.FEED_SCALED, b"M52\nG0 X30\n", b"M52\nM52 P0\nG0 X30\n", {}),
        (Reason.LOOK_AHEAD, b"G103 P1\nG0 X30.\n", b"G103 P1\nG103\nG0 X30.\n",
         {"controller": "haas", "dialect": "haas"}),
        (Reason.DECIMAL_POINT, b"G0 X30\n", b"G0 X30.\n",
         {"controller": "fanuc", "dialect": "fanuc"}),
        (Reason.OTHER_WORDS, b"G0 X30. M5\n", b"M5\nG0 X30.\n",
         {"controller": "fanuc", "dialect": "fanuc"}),
        (Reason.FEED_GROUP, b"FGROUP(X,Y)\nG0 X30.\n", b"FGROUP(X,Y)\nFGROUP()\nG0 X30.\n",
         SIEMENS),
        (Reason.COMPRESSED, b"COMPON\nG0 X30.\n", b"COMPON\nCOMPOF\nG0 X30.\n", SIEMENS),
        (Reason.FEED_UNIT, b"G70\nG0 X3.\n", b"G700\nG0 X3.\n", SIEMENS),
    ],
)  # fmt: skip
def test_the_remedy_of_a_reason_helps(reason, before, after, options):
    head = SIEMENS_HEAD if options is SIEMENS else HEAD
    codes = process(head + before + TAIL, VMC, **options).plans.reason
    assert REASONS[codes[0]] is reason
    assert process(head + after + TAIL, VMC, **options).plans.reason.tolist() == [CERTAIN]


@pytest.mark.parametrize(
    ("reason", "line", "key", "options"),
    [
        (Reason.BEAM, b"M3 S100\nG0 X30\n", "spindle: mill\n",
         {"controller": "grbl", "dialect": "grbl"}),
        (Reason.NOT_PLAYED, b"G0 X30\n",
         "controller_options: {max_acceleration: {X: 5040, Y: 3780, Z: 6300}}\n", {}),
    ],
)  # fmt: skip
def test_the_remedy_in_the_machine_file_helps(reason, line, key, options):
    low = "controller_options: {max_acceleration: {X: 4000, Y: 3000, Z: 5000}}\n"
    without = VMC_TEXT + (low if reason is Reason.NOT_PLAYED else "")
    head = HEAD.replace(b" G64 P0.01", b"") if reason is Reason.BEAM else HEAD
    codes = process(head + line + TAIL, Machine.loads(without), **options).plans.reason
    assert REASONS[codes[0]] is reason
    helped = process(head + line + TAIL, Machine.loads(VMC_TEXT + key), **options)
    assert helped.plans.reason.tolist() == [CERTAIN]


def arc(block, plane="G17"):
    program = f"G21 G90 {plane} G94\nG0 X1 Y0 Z0\n{block}\nM2\n".encode()
    moves = list(feed_moves(io.BytesIO(program), dialect="linuxcnc"))
    return np.array(moves[-1][1])


@pytest.mark.parametrize(
    ("block", "plane", "centre", "middle"),
    [
        ("G3 X-1 I-1 F9", "G17", (0, 0, 0), (0, 1, 0)),
        ("G2 X-1 I-1 F9", "G17", (0, 0, 0), (0, -1, 0)),
        ("G2 X-1 R1 F9", "G17", (0, 0, 0), (0, -1, 0)),
        ("G3 X0 Y1 R-1 F9", "G17", (1, 1, 0), (1.7071, 1.7071, 0)),
        ("G2 X0 Y-1 R1 F9", "G17", (0, 0, 0), (0.7071, -0.7071, 0)),
        ("G3 X-1 I-1 F9", "G18", (0, 0, 0), (0, 0, -1)),
    ],
)
def test_arcs_are_drawn_around_their_centre(block, plane, centre, middle):
    points = arc(block, plane)
    assert np.linalg.norm(points - centre, axis=1) == pytest.approx(1.0)
    nearest = np.linalg.norm(points - middle, axis=1).min()
    assert nearest < 0.1


def test_what_is_not_known_of_an_arc_is_its_chord():
    assert arc("G2 X5 Y5 R0.01 F9").tolist() == [[5.0, 5.0, 0.0]]
    program = b"G21 G90 G17\nG2 X1 Y1 I1 F9\nG1 X2\nM2\n"
    moves = list(feed_moves(io.BytesIO(program), dialect="linuxcnc"))
    assert np.isnan(moves[0][0]).all()


def test_process_writes_a_page_and_replaces_no_other(command, tmp_path):
    (tmp_path / "plate.ngc").write_bytes(PLATE)
    arguments = ("process", "plate.ngc", "-m", "vmc", "--report", "r.html")
    assert command(*arguments)[0] == command(*arguments)[0] == 0
    assert (tmp_path / "r.html").read_text(encoding="utf-8").startswith(MARK)
    (tmp_path / "r.html").write_text("<!doctype html>\n<title>mine</title>")
    code, out = command(*arguments)
    assert (code, "was not written by gcodejerk" in out) == (1, True)
    code, out = command(*arguments[:-1], "r.pdf")
    assert (code, ".html to look at" in out) == (2, True)
    assert not (tmp_path / "r.pdf").exists()
