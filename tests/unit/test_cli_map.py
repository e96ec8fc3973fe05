"""`gcodejerk map`: the table, the pictures, the summary, and what it refuses."""

import csv
import struct
import sys
import xml.etree.ElementTree as ET
import zlib

import numpy as np
import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.motion.amplitudes import undamped_amplitude
from gcodejerk.motion.residual import residual_acceleration

MOVE = ("--axis", "Z", "--length", "1")


@pytest.fixture
def run(command):
    """The command map."""
    return lambda *arguments: command("map", *arguments)


def table(path):
    """Header and columns of a CSV file."""
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=float).T


def condition3(T1, T):
    """Switch times and jerk steps of 1 mm, from the table of the conditions."""
    R = (T / 2 - T1) / T1
    J1 = 6.0 / (T1**2 * T * (2 * R + 1))  # noqa: N806
    return [0.0, T1, T / 2, T - T1, T], [J1, -J1 - J1 / R, 0.0, J1 + J1 / R, -J1]


def pixels(path):
    """An 8-bit PNG's samples, unfiltered far enough to count what differs."""
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


def test_the_table_is_the_formula_at_every_point(run, tmp_path):
    code, said = run("-m", "centre", *MOVE, "-o", "map.csv")
    assert (code, "rocking" in said) == (0, True)
    header, (T1, T, A) = table(tmp_path / "map.csv")
    assert header == ["T1", "T_SUM", "amplitude"]
    assert (T1 < T / 2).all()
    assert (T1 > 0).all()
    # Multiples of the command interval, each point once.
    np.testing.assert_allclose(np.stack([T1, T]) * 1e3 % 1.0 % (1 - 1e-6), 0.0, atol=1e-5)
    assert len(np.unique(np.round(np.stack([T1, T]) * 1e3), axis=1).T) == len(T1) > 1000
    for k in range(0, len(T1), 37):
        expected = residual_acceleration(*condition3(T1[k], T[k]), 30.0, 0.02)
        assert A[k] == pytest.approx(float(expected), rel=1e-8)
    here = np.isclose(T, 0.040) & np.isclose(T1, 0.001)
    assert A[here] == pytest.approx(5313.6, abs=0.06)


def test_the_table_goes_to_standard_output_too(run, tmp_path):
    code, said = run("-m", "paper", *MOVE, "-o", "-")
    assert code == run("-m", "paper", *MOVE, "-o", "map.csv")[0] == 0
    assert said == (tmp_path / "map.csv").read_text()


@pytest.mark.parametrize("condition", ["I", "ii"])
def test_the_table_of_another_condition_and_another_mode(run, tmp_path, condition):
    code, _ = run("-m", "paper", *MOVE, "--condition", condition, "--mode", 1, "-o", "m.csv")
    assert code == 0
    _, (T1, T, A) = table(tmp_path / "m.csv")
    np.testing.assert_allclose(
        A, undamped_amplitude(condition.upper(), 1.0, T1, T, 30.0), rtol=1e-6, atol=1e-3
    )


def test_a_mode_is_named_or_counted(run, tmp_path):
    for mode, file in (("column", "a.csv"), ("3", "b.csv")):
        assert run("-m", "centre", *MOVE, "--mode", mode, "-o", file)[0] == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    _, (T1, T, A) = table(tmp_path / "a.csv")
    expected = residual_acceleration(*condition3(T1[500], T[500]), 90.0, 0.03)
    assert A[500] == pytest.approx(float(expected), rel=1e-8)


def test_all_modes_are_their_worst_displacement(run, tmp_path):
    assert run("-m", "centre", *MOVE, "--mode", "all", "-o", "all.csv")[0] == 0
    header, (T1, T, D) = table(tmp_path / "all.csv")
    assert header == ["T1", "T_SUM", "displacement"]
    modes = Machine.load(find_machine("centre")).axis("Z").modes
    for k in (0, 700, 1500):
        worst = max(
            m.participation_of("Z") / (2 * np.pi * m.frequency) ** 2
            * float(residual_acceleration(*condition3(T1[k], T[k]), m.frequency, m.damping))
            for m in modes
        )  # fmt: skip
        assert D[k] == pytest.approx(worst, rel=1e-8)


def test_the_grid_is_the_users_where_one_is_given(run, tmp_path):
    assert run("-m", "paper", *MOVE, "-o", "m.csv", "--points", 9, "--longest", 0.12)[0] == 0
    _, (T1, T, _) = table(tmp_path / "m.csv")
    np.testing.assert_allclose(np.unique(T), np.linspace(0.016, 0.120, 9))
    assert len(np.unique(T1)) <= 9


def test_a_long_move_has_a_table_of_moderate_size(run, tmp_path):
    assert run("-m", "centre", "--axis", "Z", "--length", 1500, "-o", "m.csv")[0] == 0
    _, (_, T, _) = table(tmp_path / "m.csv")
    assert 300 < len(np.unique(T)) <= 1001


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (("-m", "paper", *MOVE), "a.png"),
        (("-m", "router", "--axis", "X", "--length", "-20", "--condition", "II"), "b.PNG"),
        (("-m", "drill", "--axis", "z", "--length", 2, "--condition", "I", "--mode", 1), "c.png"),
        (("-m", "centre", "--axis", "Z", "--length", 1500), "d.png"),
        (("-m", "centre", *MOVE, "--longest", 0.03), "e.png"),
    ],
)
def test_a_picture_is_a_png_that_shows_something(run, tmp_path, arguments, name):
    code, said = run(*arguments, "-o", name, "--points", 90)
    assert (code, said) == (0, "")
    width, height, samples = pixels(tmp_path / name)
    assert width > 900
    assert height > 700
    counts = np.bincount(np.frombuffer(samples, dtype=np.uint8), minlength=256)
    assert (counts > 50).sum() > 100
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_a_picture_as_svg_names_what_it_shows(run, tmp_path, monkeypatch):
    import matplotlib as mpl

    monkeypatch.setitem(mpl.rcParams, "svg.fonttype", "none")
    assert run("-m", "paper", *MOVE, "-o", "map.svg", "--points", 90)[0] == 0
    root = ET.parse(tmp_path / "map.svg").getroot()
    assert root.tag.endswith("svg")
    text = " ".join("".join(e.itertext()) for e in root.iter() if e.tag.endswith("text"))
    text = "".join(text.split())
    for words in (
        "Z 1 mm, Condition III, mode rocking, 30 Hz",
        "T1 [ms]",
        "TSUM [ms]",
        "acceleration amplitude after the move [mm/s²]",
        "colours by the square root of it",
        "no profile:",
        "acceleration limit",
        "jerk limit",
        "null of rocking, 30 Hz (without damping)",
        "G0 today 13209",
    ):
        assert "".join(words.split()) in text


@pytest.mark.parametrize("name", ["c.png", "c.svg", "c.pdf"])
def test_the_maps_of_all_conditions_are_one_picture(run, tmp_path, name):
    assert run("-m", "paper", *MOVE, "--conditions", "-o", name, "--points", 60) == (0, "")
    assert (tmp_path / name).stat().st_size > 20_000


def test_a_picture_as_pdf(run, tmp_path):
    assert run("-m", "centre", *MOVE, "-o", "map.pdf", "--points", 60)[0] == 0
    assert (tmp_path / "map.pdf").read_bytes().startswith(b"%PDF-")


def test_the_summary_has_the_papers_numbers(run):
    code, said = run("-m", "paper", *MOVE)
    assert code == 0
    assert "13209.3 -> 5696.8" in said
    assert "371.77 -> 160.33" in said
    assert "49 (1.311)" in said
    assert "[mm/s^2]" in said


def test_the_summary_of_a_move_that_needs_more_than_its_time(run):
    code, said = run("-m", "centre", "--axis", "Z", "--length", "8", "--mode", "rocking")
    assert code == 0
    assert "90.6226" in said
    assert "  99 " in said
    assert "bed" not in said


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--axis", "Q", "--length", 1), 1, "has no axis 'Q', it has X, Y, Z"),
        (("--axis", "Z", "--length", 0), 2, "--length 0 is no move"),
        (("--axis", "Z", "--length", "nan"), 1, "expected a length"),
        (("--axis", "Z", "--length", "inf"), 1, "expected a length"),
        (("--axis", "Z", "--length", "one"), 2, "--length"),
        (("--axis", "Z"), 2, "--length"),
        ((*MOVE, "--mode", 5), 1, "choose a number or a name: 1 (rocking), 2 (bed), 3"),
        ((*MOVE, "--mode", 0), 1, "excites no mode '0'"),
        ((*MOVE, "--mode", "swaying"), 1, "excites no mode 'swaying'"),
        ((*MOVE, "--condition", "IV"), 2, "choose I, II or III"),
        ((*MOVE, "--conditions"), 2, "--conditions is of maps that are drawn (-o FILE)"),
        ((*MOVE, "--conditions", "-o", "map.csv"), 2, "a .csv is of one condition"),
        (
            (*MOVE, "--conditions", "--condition", "III", "-o", "m.png"),
            2,
            "--conditions draws all three: leave --condition out",
        ),
        ((*MOVE, "-o", "map.gif"), 2, "a map is one of .png, .svg, .pdf, .csv"),
        ((*MOVE, "-o", "map"), 2, "a map is one of"),
        ((*MOVE, "-o", "-", "--json"), 2, "both on standard output"),
        ((*MOVE, "-o", "-", "--conditions"), 2, "a .csv is of one condition"),
        ((*MOVE, "-o", "map.png", "--points", 1), 2, "--points"),
        ((*MOVE, "--points", 50), 2, "-o FILE"),
        ((*MOVE, "-o", "map.png", "--longest", 0.01), 1, "for example --longest 0.08"),
        ((*MOVE, "-o", "map.csv", "--longest", "nan"), 1, "the map would end at T_SUM = nan"),
        ((*MOVE, "-o", "no/map.csv"), 1, "cannot be written"),
    ],
)
def test_what_is_refused_leaves_nothing(run, tmp_path, arguments, code, message):
    status, said = run("-m", "centre", *arguments)
    assert status == code
    assert message in " ".join(said.replace("│", " ").split())
    assert not list(tmp_path.iterdir())


def test_an_axis_without_modes_has_no_map(run, tmp_path):
    (tmp_path / "still.yaml").write_text(
        "interval: 0.001\npositioning: linear\n"
        "axes: {X: {rapid: {velocity: 100, acceleration: 1000}}}\n"
    )
    code, said = run("-m", "still.yaml", "--axis", "X", "--length", 1)
    assert code == 1
    assert "axis X of still.yaml excites no mode: nothing to map" in said


def test_without_matplotlib_the_remedy_is_named(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    code, said = run("-m", "paper", *MOVE, "-o", "map.png")
    assert code == 1
    assert "pip install 'gcodejerk[figures]'" in said
    assert not list(tmp_path.iterdir())
    assert run("-m", "paper", *MOVE, "-o", "map.csv")[0] == 0
