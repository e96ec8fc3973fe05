"""`gcodejerk compare`: the table, the figures in JSON, the pictures, and what is refused."""

import json
import struct
import sys
import xml.etree.ElementTree as ET
import zlib
from importlib.resources import files

import jsonschema
import numpy as np
import pytest

from gcodejerk.machine import find_machine
from gcodejerk.studies.comparison import CONTENDERS

SCHEMA = json.loads(files("gcodejerk.report").joinpath("compare.schema.json").read_text())


@pytest.fixture
def run(command, monkeypatch):
    """The command compare."""
    monkeypatch.setenv("COLUMNS", "120")
    return lambda *arguments: command("compare", *arguments)


def rows(said):
    """The table's rows by name, as words."""
    table = said.split("residual: largest")[0]
    lines = [line.split() for line in table.splitlines() if line.strip()]
    return {line[0]: line[1:] for line in lines if line[0] in CONTENDERS}


def pixels(path):
    """Width, height and the unpacked samples of an 8-bit PNG."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        if data[at + 4 : at + 8] == b"IDAT":
            packed += data[at + 8 : at + 8 + length]
        at += 12 + length
    width, height = struct.unpack(">II", data[16:24])
    return width, height, zlib.decompress(packed)


def test_the_table_has_everyone_and_fits_a_terminal(run):
    code, said = run("-m", "paper", "Z=1")
    assert code == 0
    table = rows(said)
    assert set(table) == set(CONTENDERS)
    assert table["conventional"][:5] == ["40.0", "never", "50.00", "5000", "5e+05"]
    assert table["conventional"][5] == "371.77"
    assert table["condition3"][5] == "160.33"
    assert table["condition1"][0] == "*"
    assert table["zv"][:2] == ["56.7", "56.7"]
    head = " ".join(said.split("───")[0].split())
    assert "[mm/s^2] [mm/s^3] [um] [um] [um] [um]" in head
    assert max(len(line) for line in said.splitlines()) <= 120
    assert "condition1 (acceleration 10 x, jerk 10 x)" in said
    assert "notch-ramp" in said
    assert "of the laws: trapezoidal (jerk steps)" in said
    assert "made for 30 Hz with damping 0 (--shaper-damping)" in said
    assert "the controller's own G0 never settles" in said


def test_what_the_user_gains_is_the_last_word(run):
    code, said = run("-m", "centre", "Z=1")
    assert code == 0
    assert "shortest is settled 64 ms after the start" in said.splitlines()[-2]
    assert "the controller's own G0 is settled after 1.6 s" in said.splitlines()[-2]
    assert "leaves 345.25 um after 40 ms" in said.splitlines()[-1]


def test_figures_and_picture_are_files_of_their_own(run, tmp_path):
    code, said = run("-m", "paper", "Z=-1", "--json", "c.json", "--plot", "c.png")
    assert code == 0
    assert "conventional" in said
    assert sorted(p.name for p in tmp_path.iterdir()) == ["c.json", "c.png"]
    record = json.loads((tmp_path / "c.json").read_text())
    jsonschema.validate(record, SCHEMA)
    assert record["machine"] == "paper.yaml"
    assert record["move"] == {"Z": -1.0}
    assert record["time"] == record["conventional_time"] == 0.04
    zv = next(p for p in record["profiles"] if p["profile"] == "zv")
    assert zv["time"] == pytest.approx(0.0567, abs=5e-5)
    assert set(zv["worst_band"]) == {"0.05", "0.10"}


def test_json_on_standard_output_is_nothing_else(run):
    code, said = run("-m", "paper", "Z=1", "--time", "0.05", "--json", "-")
    assert code == 0
    record = json.loads(said)
    assert record["time"] == 0.05
    assert [p["profile"] for p in record["profiles"]] == list(CONTENDERS)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (("-m", "paper", "Z=1"), "a.png"),
        (("-m", "centre", "x=2", "Y=-5"), "b.PNG"),
        (("-m", "router", "X=2"), "c.png"),
        (("-m", "drill", "Z=3", "--shaper-damping", "mode"), "d.png"),
    ],
)
def test_a_picture_shows_something(run, tmp_path, arguments, name):
    assert run(*arguments, "--plot", name)[0] == 0
    width, height, samples = pixels(tmp_path / name)
    assert width > 2000
    assert height > 1900
    counts = np.bincount(np.frombuffer(samples, dtype=np.uint8), minlength=256)
    assert (counts > 200).sum() > 100


def test_a_picture_as_svg_names_what_it_shows(run, tmp_path, monkeypatch):
    import matplotlib as mpl

    monkeypatch.setitem(mpl.rcParams, "svg.fonttype", "none")
    assert run("-m", "paper", "Z=1", "--plot", "c.svg")[0] == 0
    root = ET.parse(tmp_path / "c.svg").getroot()
    text = " ".join("".join(e.itertext()) for e in root.iter() if e.tag.endswith("text"))
    for words in (
        "Z 1 mm — Worked example of the paper",
        "(a) acceleration of Z",
        "(b) position of Z",
        "(c) spectrum of (a)",
        "(d) vibration after arrival",
        "(e) spectrum of (d), Hann window of 400 ms",
        "(f) residual of a mode of any frequency (Z 1 mm, participation 1)",
        "settled: below 1 µm",
        "time [ms]",
        "natural frequency [Hz]",
        "residual [µm]",
        "mm/s²",
        "rocking 30 Hz",
        "conventional",
        "optimal",
        "shortest",
        "zv",
        "all others: condition1, condition2,",
        "never settles",
        "settled at 56.7 ms",
    ):
        assert words in text


def test_a_picture_as_pdf(run, tmp_path):
    assert run("-m", "paper", "Z=1", "--plot", "c.pdf")[0] == 0
    assert (tmp_path / "c.pdf").read_bytes().startswith(b"%PDF-")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("Q=1",), 1, "has no axis 'Q', it has Z"),
        (("Z=0",), 1, "no axis moves"),
        (("Z=nan",), 1, "expected a length"),
        (("Z",), 2, "is not AXIS=LENGTH"),
        (("Z=1", "z=2"), 2, "axis Z stands twice"),
        ((), 2, "AXIS=LENGTH"),
        (("Z=1", "--time", "0.01"), 1, "allow at least 0.03 s"),
        (("Z=1", "--time", "-1"), 2, "expected more than zero"),
        (("Z=1", "--time", "soon"), 2, "--time"),
        (("Z=1", "--plot", "c.gif"), 2, "a figure is one of .png, .svg, .pdf"),
        (("Z=1", "--plot", "-"), 2, "a figure is one of .png, .svg, .pdf"),
        (("Z=1", "--plot", "no/c.png"), 1, "cannot be written"),
        (("Z=1", "--json", "no/c.json", "--plot", "c.png"), 1, "cannot be written"),
        (("Z=1", "--json", "c.png", "--plot", "c.png"), 2, "two files"),
        (("Z=1", "--shaper-damping", "1"), 2, "a ratio from 0 to below 1, or the word mode"),
        (("Z=1", "--shaper-damping", "nan"), 2, "a ratio from 0 to below 1"),
        (("Z=1", "--shaper-damping", "much"), 2, "a ratio from 0 to below 1"),
    ],
)
def test_what_is_refused_leaves_nothing(run, tmp_path, arguments, code, message):
    status, said = run("-m", "paper", *arguments)
    assert status == code
    words = " ".join(said.replace("│", " ").split())
    assert message in words
    assert not list(tmp_path.iterdir())


def test_shapers_are_made_for_the_damping_that_is_asked_for(run):
    code, said = run("-m", "centre", "Z=1", "--shaper-damping", "mode")
    assert code == 0
    assert "made for 30 Hz with damping 0.02" in said
    code, said = run("-m", "centre", "Z=1", "--shaper-damping", "0.01")
    assert "made for 30 Hz with damping 0.01" in said


def test_without_matplotlib_the_remedy_is_named_and_nothing_is_written(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    code, said = run("-m", "paper", "Z=1", "--json", "c.json", "--plot", "c.png")
    assert code == 1
    assert "pip install 'gcodejerk[figures]'" in said
    assert not list(tmp_path.iterdir())
    assert run("-m", "paper", "Z=1", "--json", "c.json")[0] == 0


@pytest.mark.parametrize("missing", ["scipy", "clarabel", "daqp"])
def test_without_the_solver_the_rest_is_shown_with_the_remedy(run, tmp_path, monkeypatch, missing):
    for name in [n for n in sys.modules if n.split(".")[0] == missing] or [missing]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, missing, None)
    code, said = run("-m", "paper", "Z=1", "--plot", "c.png", "--json", "c.json")
    assert code == 0
    assert rows(said)["optimal"] == ["**", *["-"] * 9]
    assert rows(said)["condition3"][-1] == "-"
    assert "optimal, shortest: needs gcodejerk[science]" in said
    assert "pip install 'gcodejerk[science]'" in said
    jsonschema.validate(json.loads((tmp_path / "c.json").read_text()), SCHEMA)
    assert pixels(tmp_path / "c.png")[0] > 2000


def test_axes_on_their_own_are_compared_too(run, tmp_path):
    text = find_machine("centre").read_text(encoding="utf-8")
    text = text.replace("positioning: linear", "positioning: independent")
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    code, said = run("-m", "own.yaml", "X=6", "Z=1", "--json", "c.json", "--plot", "c.png")
    assert code == 0
    assert "made for 55 Hz with damping 0, 30 Hz with damping 0" in said
    record = json.loads((tmp_path / "c.json").read_text())
    jsonschema.validate(record, SCHEMA)
    assert record["positioning"] == "independent"
    assert set(record["profiles"][0]["segments"]) == {"X", "Z"}


def test_a_measured_spectrum_is_compared_and_drawn(run, tmp_path):
    lines = [f"{f},{1.0 / ((1 - (f / 40) ** 2) ** 2 + 0.01)}\n" for f in range(10, 121, 10)]
    (tmp_path / "x.csv").write_text("".join(lines))
    (tmp_path / "m.yaml").write_text(
        "interval: 0.001\npositioning: linear\naxes:\n"
        "  X: {rapid: {velocity: 300, acceleration: 3000, jerk: 5.0e+5}, spectrum: x.csv}\n"
    )
    code, said = run("-m", "m.yaml", "X=2", "--json", "c.json", "--plot", "c.png")
    assert code == 0
    assert rows(said)["conventional"][1] == "never"
    record = json.loads((tmp_path / "c.json").read_text())
    jsonschema.validate(record, SCHEMA)
    assert [r["mode"] for r in record["profiles"][0]["residual"]] == ["spectrum x.csv"]
    assert pixels(tmp_path / "c.png")[0] > 2000


def test_a_rotary_axis_is_told_in_degrees(run, tmp_path):
    (tmp_path / "m.yaml").write_text(
        "interval: 0.001\npositioning: linear\naxes:\n  A: {type: rotary, rapid: {velocity: 90, "
        "acceleration: 3000, jerk: 3.0e+5}, modes: [{frequency: 40, damping: 0.03, "
        "participation: 1}]}\n"
    )
    code, said = run("-m", "m.yaml", "A=2", "--plot", "c.png")
    assert code == 0
    assert "[deg/s^2]" in said
    assert "[um]" in said  # at the tool: participation is in mm for each degree
