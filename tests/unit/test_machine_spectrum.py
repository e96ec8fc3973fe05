import math
import os
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.errors import MachineError
from gcodejerk.machine import Machine, MachineFileError, Spectrum, machine_yaml
from gcodejerk.machine.spectrum import (
    MOST_BYTES,
    MOST_LINES,
    MOST_ROWS,
    load_spectrum,
    read_spectrum,
)

SHARED = Path(__file__).resolve().parents[2].parent / "shared" / "data"
NYQUIST = 500.0

MILL = """\
interval: 0.001
positioning: linear
axes:
  X:
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
"""
EVEN = "".join(f"{f},2\n" for f in range(10, 90, 10))


def resonance(f, f0=47.0, zeta=0.06):
    """Squared transmissibility of an oscillator's base acceleration to its own."""
    r = np.asarray(f) / f0
    return (1.0 + (2.0 * zeta * r) ** 2) / ((1.0 - r**2) ** 2 + (2.0 * zeta * r) ** 2)


def plain(f, psd):
    return "".join(f"{x!r},{y!r}\n" for x, y in zip(map(float, f), map(float, psd), strict=True))


def read(text, highest=NYQUIST):
    return read_spectrum(text.encode(), "x.csv", highest)


def refused(text, highest=NYQUIST):
    with pytest.raises(MachineError) as caught:
        read(text, highest)
    return caught.value


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "x.csv").write_text(EVEN)
    return tmp_path


def load(folder, extra, text=MILL):
    (folder / "mill.yaml").write_text(text + extra)
    return Machine.load(folder / "mill.yaml")


def problems(folder, extra, text=MILL):
    with pytest.raises(MachineFileError) as caught:
        load(folder, extra, text)
    prefix = f"{folder}{os.sep}"
    return [f"{p.place}: {p.problem}".removeprefix(prefix) for p in caught.value.problems]


# The file


def test_weights_are_psd_times_width_and_add_up_to_one():
    spectrum = read("10,1\n20,1\n30,1\n50,1\n60,1\n70,1\n80,1\n90,3\n")
    assert spectrum.frequency == (10.0, 20.0, 30.0, 50.0, 60.0, 70.0, 80.0, 90.0)
    assert spectrum.weight == pytest.approx(np.array([5, 10, 15, 15, 10, 10, 10, 15]) / 90.0)
    assert math.fsum(spectrum.weight) == 1.0
    assert (spectrum.peak, spectrum.participation, spectrum.source) == (90.0, 1.0, "x.csv")


def test_klipper_s_sum_counts_and_not_one_direction_nor_the_shapers():
    lines = "".join(f"{f}.0,{f},{100 - f},1.0e+00,{f * f},0.5,0.9\n" for f in range(10, 100, 10))
    with_sum = read("freq,psd_x,psd_y,psd_z,psd_xyz,mzv(54.2),ei(60.0)\n" + lines)
    f = np.arange(10.0, 100.0, 10.0)
    assert with_sum == read(plain(f, f * f))
    with_shapers = read("freq,psd_x,psd_y,psd_z,psd_xyz,shapers:,mzv(54.2)\n" + lines)
    assert with_shapers == with_sum


def test_directions_are_added_where_their_sum_is_not_given():
    lines = "".join(f"{f},1,{f},3,1e9\n" for f in range(10, 100, 10))
    f = np.arange(10.0, 100.0, 10.0)
    assert read("Freq, PSD_X, PSD_Y, PSD_Z, other\n" + lines) == read(plain(f, 4.0 + f))


@pytest.mark.parametrize(
    "head",
    [
        "f,PSD\n",
        "f [Hz],PSD\n",
        "# measured with a hammer\n",
        "# one\n\n#two, three\nf,PSD\n",
        '"freq","psd"\n',
        "\n\n",
    ],
)
def test_plain_files_may_have_comments_and_a_header(head):
    assert read(head + EVEN) == read(EVEN)


def test_names_of_columns_may_stand_in_a_comment():
    lines = "".join(f"{f},1,{f}\n" for f in range(10, 100, 10))
    assert read("# freq,psd_x,psd_xyz\n" + lines) == read("freq,psd_x,psd_xyz\n" + lines)


@pytest.mark.parametrize(
    "data",
    [
        EVEN.replace("\n", "\r\n").encode(),
        EVEN.replace("\n", "\r").encode(),
        b"\xef\xbb\xbf" + EVEN.encode(),
        b"\xef\xbb\xbff,PSD\r\n" + EVEN.replace("\n", "\r\n").encode(),
        EVEN.removesuffix("\n").encode(),
        EVEN.replace(",", " , ").encode(),
        b"# \xb5m\n" + EVEN.encode(),
    ],
    ids=["crlf", "cr", "bom", "bom crlf header", "no last line end", "blanks", "latin-1"],
)
def test_the_same_numbers_are_the_same_spectrum_however_the_text_is_written(data):
    assert read_spectrum(data, "copy.csv", NYQUIST) == read(EVEN)


def test_drift_below_5_hz_and_what_the_interval_cannot_tell_are_left_out():
    f = np.array([0.0, 4.9, 5.0, 10, 20, 30, 40, 50, 60, 70, 124.9, 125.0, 200.0])
    psd = np.ones(13)
    psd[[0, 1, 11, 12]] = 1e6
    spectrum = read(plain(f, psd), highest=125.0)
    assert (spectrum.frequency[0], spectrum.frequency[-1]) == (5.0, 124.9)
    assert spectrum.peak == 5.0
    assert spectrum == read(plain(f[2:11], psd[2:11]))


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        (EVEN + "90,-1\n", "x.csv:9", "the line is '90,-1', expected finite numbers of at least 0"),
        ("-1,2\n" + EVEN, "x.csv:1", "the line is '-1,2', expected finite numbers of at least 0"),
        (
            "freq,psd_x,psd_y\n10,3,-1\n",
            "x.csv:2",
            "the line is '10,3,-1', expected finite numbers of at least 0",
        ),
        (
            "freq,psd_x,psd_y\n10,3,nan\n",
            "x.csv:2",
            "the line is '10,3,nan', expected finite numbers of at least 0",
        ),
        (EVEN + "90,nan\n", "x.csv:9", "the line is '90,nan', expected finite numbers of at"),
        (EVEN + "90,inf\n", "x.csv:9", "the line is '90,inf', expected finite numbers of at"),
        (EVEN + "1e999,1\n", "x.csv:9", "the line is '1e999,1', expected finite numbers of at"),
        (EVEN + "90;1\n", "x.csv:9", "the line is '90;1', expected numbers"),
        (EVEN + "90\n", "x.csv:9", "the line is '90', expected numbers"),
        (EVEN + "90,\n", "x.csv:9", "the line is '90,', expected numbers"),
        ("# a\nf,PSD\nG0 X1\n", "x.csv:3", "the line is 'G0 X1', expected numbers"),
        ("10,1\nf,PSD\n", "x.csv:2", "the line is 'f,PSD', expected numbers"),
        ("freq,a,psd_xyz\n10,1\n", "x.csv:2", "the line is '10,1', expected numbers"),
        (EVEN + "x" * 99, "x.csv:9", f"the line is '{'x' * 57}...', expected numbers"),
        (
            EVEN + "\n80,1\n",
            "x.csv:10",
            "the line is '80,1', expected a frequency above 80 Hz, that of the line before",
        ),
        (
            "10,1\n20,1\n15,1\n",
            "x.csv:3",
            "the line is '15,1', expected a frequency above 20 Hz, that of the line before",
        ),
    ],
)  # fmt: skip
def test_a_wrong_line_is_refused_with_its_number(text, place, problem):
    error = refused(text)
    assert (str(error.place), error.problem[: len(problem)]) == (place, problem)
    assert error.remedy


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "has no lines from 5 Hz to below 500 Hz, half the sampling rate 1/interval, "
             "expected at least 8"),
        (EVEN.replace(",", "00,"), "has no lines from 5 Hz to below 500 Hz, half"),
        ("".join(f"{f / 10},1\n" for f in range(45)), "has no lines from 5 Hz"),
        (EVEN.replace("10,2\n", ""), "has 7 lines from 5 Hz to below 500 Hz, half"),
        ("10,1\n", "has 1 line from 5 Hz to below 500 Hz, half"),
        (EVEN.replace(",2", ",0"), "is zero everywhere from 5 Hz to below 500 Hz, half"),
        ("1,5\n" + EVEN.replace(",2", ",0"), "is zero everywhere from 5 Hz"),
        ("\x00\x01", "is not text"),
        (EVEN.encode("utf-16").decode("latin-1"), "is not text"),
    ],
)  # fmt: skip
def test_a_file_without_a_spectrum_in_the_band_is_refused(text, problem):
    error = refused(text)
    assert error.place is None
    assert error.problem.startswith(problem)
    assert error.remedy


def test_a_recording_in_time_is_recognised():
    remedy = refused("#time,accel_x,accel_y,accel_z\n0.1,-12,3,9810\n").remedy
    assert "recording" in remedy


# Fewer lines


def test_many_lines_become_few_with_the_same_energy_and_centroid():
    # Strong enough everywhere for no line to be left out.
    f = np.linspace(30.0, 70.0, 400)
    psd = resonance(f) + 0.2 * resonance(f, 61.0, 0.03)
    spectrum = read(plain(f, psd))
    assert 0.8 * MOST_LINES <= len(spectrum.frequency) <= MOST_LINES
    assert math.fsum(spectrum.weight) == 1.0
    energy = psd * np.gradient(f)
    energy[[0, -1]] *= 0.5
    centroid = np.dot(energy, f) / energy.sum()
    assert np.dot(spectrum.weight, spectrum.frequency) == pytest.approx(centroid, rel=1e-12)
    assert spectrum.peak == f[np.argmax(psd)]


def test_few_lines_leave_the_residual_that_many_leave():
    f = np.linspace(6.0, 180.0, 130)
    psd = resonance(f) + 0.05 * resonance(f, 110.0, 0.04)
    spectrum = read(plain(f, psd))
    width = np.gradient(f)
    width[[0, -1]] *= 0.5
    weight = psd * width / np.dot(psd, width)
    for time in (0.021, 0.043, 0.117, 0.23):
        for share in (0.13, 0.29, 0.41):
            rise = share * time
            few = residual(spectrum.frequency, spectrum.weight, rise, time)
            assert few == pytest.approx(residual(f, weight, rise, time), rel=0.02)


def residual(frequency, weight, rise, time):
    """The residual that `Spectrum` documents, of an antisymmetric move of four segments."""
    fall = 0.5 * time - rise
    t = np.array([0.0, rise, 0.5 * time, time - rise, time])
    jerk = np.array([1.0 / rise, -1.0 / fall, -1.0 / fall, 1.0 / rise])
    steps = np.diff(jerk, prepend=0.0, append=0.0)
    omega = 2.0 * np.pi * np.asarray(frequency)
    amplitude = np.abs(np.exp(-1j * omega[:, np.newaxis] * t) @ steps) / omega
    return math.sqrt(np.dot(weight, amplitude**2))


def test_lines_without_energy_are_left_out():
    f = np.arange(10.0, 90.0, 1.0)
    psd = np.where(f == 40.0, 1.0, np.where(f == 50.0, 3.0, 0.0))
    spectrum = read(plain(f, psd))
    assert spectrum.frequency == (40.0, 50.0)
    assert spectrum.weight == pytest.approx((0.25, 0.75))


# In the machine file


@pytest.mark.parametrize(
    "extra",
    [
        "    spectrum: x.csv\n",
        "    modes: {spectrum: x.csv}\n",
        "    spectrum: {file: x.csv}\n",
        "    modes: {spectrum: {file: x.csv, participation: 1}}\n",
        "    modes: []\n    spectrum: x.csv\n",
        "    modes:\n    spectrum: 'x.csv'\n",
        "    spectrum: ./x.csv\n",
    ],
)
def test_a_spectrum_can_be_given_in_every_way_and_is_the_same(folder, extra):
    machine = load(folder, extra)
    x = machine.axis("X")
    assert (x.spectrum, x.modes) == (read(EVEN), ())
    assert machine == load(folder, "    spectrum: x.csv\n")
    assert machine.settings_hash == load(folder, "    spectrum: x.csv\n").settings_hash


def test_participation_is_read_and_is_1_where_it_is_not_given(folder):
    spectrum = load(folder, "    spectrum: {file: x.csv, participation: 0.5}\n").axis("X").spectrum
    assert (spectrum.participation, read(EVEN).participation) == (0.5, 1.0)
    assert spectrum != read(EVEN)


def test_an_axis_without_a_spectrum_has_none(folder):
    assert load(folder, "").axis("X").spectrum is None


def test_the_name_of_the_file_begins_in_the_folder_of_the_machine_file(folder, monkeypatch):
    (folder / "data").mkdir()
    (folder / "x.csv").rename(folder / "data" / "x.csv")
    assert load(folder, "    spectrum: data/x.csv\n").axis("X").spectrum.source == "data/x.csv"
    monkeypatch.chdir(folder / "data")
    assert Machine.loads(MILL + "    spectrum: x.csv\n").axis("X").spectrum == read(EVEN)
    text = MILL + f"    spectrum: {folder / 'data' / 'x.csv'}\n"
    assert Machine.loads(text, "elsewhere/mill.yaml").axis("X").spectrum == read(EVEN)


def test_two_axes_can_have_spectra_of_their_own(folder):
    (folder / "y.csv").write_text(EVEN + "90,1\n")
    y = "  Y:\n    rapid: {velocity: 1, acceleration: 1}\n    spectrum: y.csv\n"
    machine = load(folder, "    spectrum: x.csv\n" + y)
    assert [len(axis.spectrum.frequency) for axis in machine.axes] == [8, 9]
    assert machine.all_modes() == ()


def test_a_machine_with_a_spectrum_is_written_and_read_back_as_the_same(folder):
    machine = load(folder, "    spectrum: {file: x.csv, participation: 0.25}\n")
    text = machine_yaml(machine)
    assert '    spectrum: {file: "x.csv", participation: 0.25}\n' in text
    again = Machine.loads(text, str(folder / "mill.yaml"))
    assert again == machine
    assert again.settings_hash == machine.settings_hash
    assert machine_yaml(again) == text


@pytest.mark.parametrize("name", ["1e3", "true", "a b: c#.csv", "\u00e4'\".csv", "null"])
def test_any_name_of_a_file_is_written_so_that_it_reads_back(folder, name):
    (folder / name).write_text(EVEN)
    machine = load(folder, "    spectrum: x.csv\n")
    x = machine.axis("X")
    renamed = replace(machine, axes=(replace(x, spectrum=replace(x.spectrum, source=name)),))
    again = Machine.loads(machine_yaml(renamed), str(folder / "mill.yaml"))
    assert again == machine
    assert again.axis("X").spectrum.source == name


def test_settings_hash_is_that_of_the_content_wherever_it_is_kept(folder):
    machine = load(folder, "    spectrum: x.csv\n")
    (folder / "copy.csv").write_text(EVEN)
    copy = load(folder, "    spectrum: copy.csv\n")
    assert copy == machine
    assert copy.settings_hash == machine.settings_hash
    for content in (EVEN.replace("80,2", "80,2.000001"), EVEN.replace("80,", "80.00001,")):
        (folder / "copy.csv").write_text(content)
        assert load(folder, "    spectrum: copy.csv\n").settings_hash != machine.settings_hash
    halved = load(folder, "    spectrum: {file: x.csv, participation: 0.5}\n")
    assert halved.settings_hash != machine.settings_hash
    assert load(folder, "").settings_hash != machine.settings_hash


def test_a_machine_with_a_spectrum_can_be_a_key_and_cross_a_process_border(folder):
    machine = load(folder, "    spectrum: x.csv\n")
    assert {machine: 1}[pickle.loads(pickle.dumps(machine))] == 1


# What is refused there

GIVEN_TWICE = "axes.X.spectrum is given beside axes.X.modes, expected only one of them"


@pytest.mark.parametrize(
    ("extra", "line"),
    [
        (
            "    spectrum: y.csv\n",
            "mill.yaml:6:15: axes.X.spectrum is 'y.csv', which does not exist",
        ),
        (
            "    modes: {spectrum: y.csv}\n",
            "mill.yaml:6:23: axes.X.modes.spectrum is 'y.csv', which does not exist",
        ),
        (
            "    spectrum: {participation: 2, file: y.csv}\n",
            "mill.yaml:6:40: axes.X.spectrum is 'y.csv', which does not exist",
        ),
        (
            "    spectrum: .\n",
            "mill.yaml:6:15: axes.X.spectrum is '.', which is a folder, expected a CSV file",
        ),
        (
            "    spectrum: x.csv/y.csv\n",
            "mill.yaml:6:15: axes.X.spectrum is 'x.csv/y.csv', which cannot be read: "
            "Not a directory",
        ),
        (
            "    spectrum: bad.csv\n",
            "mill.yaml:6:15: axes.X.spectrum is 'bad.csv', which is no spectrum: bad.csv:9: "
            "the line is '90,-1', expected finite numbers of at least 0",
        ),
        (
            "    spectrum: short.csv\n",
            "mill.yaml:6:15: axes.X.spectrum is 'short.csv', which has 1 line from 5 Hz to below "
            "500 Hz, half the sampling rate 1/interval, expected at least 8",
        ),
        (
            "    spectrum:\n",
            "mill.yaml:6:14: axes.X.spectrum is empty, expected the name of a CSV file",
        ),
        (
            "    spectrum: [x.csv]\n",
            "mill.yaml:6:15: axes.X.spectrum is [x.csv], expected the name of a CSV file",
        ),
        (
            '    spectrum: "x\\0.csv"\n',
            "mill.yaml:6:15: axes.X.spectrum is 'x\\x00.csv', expected the name of a CSV file",
        ),
        (
            "    spectrum: {}\n",
            "mill.yaml:6:15: axes.X.spectrum is an empty mapping, expected the name of a CSV file",
        ),
        (
            "    spectrum: {participation: 1}\n",
            "mill.yaml:6:15: axes.X.spectrum.file is missing, expected the name of a CSV file",
        ),
        (
            "    spectrum: {file: x.csv, participation: -1}\n",
            "mill.yaml:6:44: axes.X.spectrum.participation is -1, "
            "expected a number of at least 0 [-]",
        ),
        (
            "    spectrum: {file: x.csv, damping: 0.1}\n",
            "mill.yaml:6:29: axes.X.spectrum.damping is not a known key",
        ),
        (
            "    spectrum: {flie: x.csv}\n",
            "mill.yaml:6:16: axes.X.spectrum.flie is not a known key, "
            "the nearest known key is 'file'",
        ),
        (
            "    spectrm: x.csv\n",
            "mill.yaml:6:5: axes.X.spectrm is not a known key, the nearest known key is 'spectrum'",
        ),
        (
            "    modes: {spectra: x.csv}\n",
            "mill.yaml:6:13: axes.X.modes.spectra is not a known key, "
            "the nearest known key is 'spectrum'",
        ),
        (
            "    modes: {spectrum: x.csv, frequency: 30}\n",
            "mill.yaml:6:30: axes.X.modes.frequency is not a known key",
        ),
        (
            "    modes: x.csv\n",
            "mill.yaml:6:12: axes.X.modes is 'x.csv', expected a list of at most 100 entries, "
            "each in braces or after a dash",
        ),
        ("    modes: [{frequency: 30}]\n    spectrum: x.csv\n", f"mill.yaml:7:15: {GIVEN_TWICE}"),
        ("    modes: {spectrum: x.csv}\n    spectrum: x.csv\n", f"mill.yaml:7:15: {GIVEN_TWICE}"),
        (
            "modes: {spectrum: x.csv}\n",
            "mill.yaml:6:8: modes is a mapping, expected a list of at most 100 entries, "
            "each in braces or after a dash",
        ),
    ],
)
def test_a_spectrum_that_cannot_be_is_refused_at_its_place(folder, extra, line):
    (folder / "bad.csv").write_text(EVEN + "90,-1\n")
    (folder / "short.csv").write_text("10,1\n")
    assert problems(folder, extra) == [line]


def test_problems_of_spectra_are_shown_with_all_others_also_without_an_interval(folder):
    (folder / "short.csv").write_text("10,1\n")
    y = "  Y:\n    rapid: {velocity: -1, acceleration: 1}\n    spectrum: y.csv\n"
    text = MILL.replace("0.001", "fast")
    assert problems(folder, "    spectrum: short.csv\n" + y, text) == [
        "mill.yaml:1:11: interval is 'fast', expected a number above zero [s]",
        "mill.yaml:6:15: axes.X.spectrum is 'short.csv', which has 1 line from 5 Hz, "
        "expected at least 8",
        "mill.yaml:8:23: axes.Y.rapid.velocity is -1, expected a number above zero [mm/s]",
        "mill.yaml:9:15: axes.Y.spectrum is 'y.csv', which does not exist",
    ]


def test_message_shows_the_line_of_the_machine_file_and_the_remedy():
    with pytest.raises(MachineFileError) as caught:
        Machine.loads(MILL + "    spectrum: none.csv\n", "shop/mill.yaml")
    assert str(caught.value) == (
        "shop/mill.yaml:6:15: axes.X.spectrum is 'none.csv', which does not exist\n"
        "        spectrum: none.csv\n"
        "                  ^\n"
        "  give its path from the folder of the machine file"
    )


def test_a_huge_file_is_refused_before_it_is_read_to_its_end(folder):
    with (folder / "x.csv").open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    with pytest.raises(MachineError, match="is larger than 10 MB"):
        load_spectrum("x.csv", folder, NYQUIST)


@pytest.mark.parametrize(
    "data",
    [
        b"x" * MOST_BYTES,
        b"9" * MOST_BYTES,
        b"1" * 5_000_000 + b"," + b"2" * 4_000_000,
        b"," * MOST_BYTES,
        b"\n" * MOST_BYTES,
        b"\r" * MOST_BYTES,
        b"#\n" * (MOST_BYTES // 2),
        b"a,b\n" * (MOST_BYTES // 4),
        bytes(range(1, 256)) * 39_000,
        b"\x7fELF\0\0" * 1_000_000,
    ],
    ids=lambda data: repr(data[:4]),
)
def test_a_hostile_file_is_refused_with_a_short_message(folder, data):
    (folder / "x.csv").write_bytes(data)
    with pytest.raises(MachineError) as caught:
        load_spectrum("x.csv", folder, NYQUIST)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("rows", [MOST_ROWS, 3 * MOST_ROWS])
def test_the_number_of_lines_has_an_end(rows):
    data = b"".join(b"%d.%05d,1\n" % divmod(500_000 + n, 100_000) for n in range(rows))
    if rows == MOST_ROWS:
        assert len(read_spectrum(data, "x.csv", NYQUIST).frequency) > 1
        return
    with pytest.raises(MachineError, match=f"has more than {MOST_ROWS} lines"):
        read_spectrum(data, "x.csv", NYQUIST)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_without_waiting_for_a_writer(folder):
    os.mkfifo(folder / "pipe.csv")
    with pytest.raises(MachineError, match="is not a file, expected a CSV file"):
        load_spectrum("pipe.csv", folder, NYQUIST)


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="everything is readable for root"
)
def test_a_file_without_permission_is_refused(folder):
    (folder / "x.csv").chmod(0)
    with pytest.raises(MachineError, match="cannot be read: Permission denied"):
        load_spectrum("x.csv", folder, NYQUIST)


# Measured machines


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared folder of measured spectra is absent")
def test_every_measured_spectrum_is_read_with_its_peak():
    files = sorted(SHARED.glob("*.csv"))
    assert len(files) == 8
    for path in files:
        table = np.genfromtxt(path, delimiter=",", skip_header=1)
        f, psd = table[:, 0], np.where(table[:, 0] > 5.0, table[:, 4], 0.0)
        text = MILL + f"    spectrum: {path}\n"
        spectrum = Machine.loads(text).axis("X").spectrum
        assert isinstance(spectrum, Spectrum)
        assert spectrum.peak == f[np.argmax(psd)], path.name
        assert 30 <= len(spectrum.frequency) <= MOST_LINES
        assert math.fsum(spectrum.weight) == 1.0
        assert 5.0 <= spectrum.frequency[0] < spectrum.frequency[-1] < 200.0
        assert np.dot(spectrum.weight, spectrum.frequency) == pytest.approx(
            np.dot(psd, f) / psd.sum(), rel=0.01
        )
