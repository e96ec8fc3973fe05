"""What a person sees on a screen: tables of any width, the bar, units; and the way back."""

import io
import json
import os
import pty
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from gcodejerk.machine import Machine, find_machine
from gcodejerk.report.screen import ScreenTable
from gcodejerk.studies.amplitude_map import Survey

SAMPLES = Path(__file__).parents[2] / "samples"

INCH = b"G20 G90 G94\nG0 X0 Y0 Z0\nG0 X1\nG1 X2 F20\nG0 Z.5\nM2\n"
METRIC = b"G21 G90 G94\nG0 X0 Y0 Z0\nG0 X20\nG1 X30 F500\nG0 Z5\nM2\n"
SPECTRUM = "freq,psd_xyz\n" + "".join(
    f"{f},{1.0 / ((1 - (f / 42) ** 2) ** 2 + (0.1 * f / 42) ** 2):.6g}\n" for f in range(6, 120, 2)
)


def shown(table, width):
    out = io.StringIO()
    Console(file=out, width=width, color_system=None).print(table)
    return out.getvalue()


words = st.text("abcdefg0123456789.+-", min_size=1, max_size=14)
texts = st.lists(words, min_size=1, max_size=12).map(" ".join)


@settings(max_examples=60)
@given(st.lists(st.tuples(words, words, words, texts), min_size=1, max_size=8),
       st.sampled_from((60, 80, 120)))  # fmt: skip
def test_no_word_is_broken_and_no_column_vanishes_in_silence(rows, width):
    table = ScreenTable(
        ("one\n[mm]", "right"), ("two", "right"), ("three", "right"), ("text", "left"),
        wrap=("text",), drop=("three", "two"),
    )  # fmt: skip
    for row in rows:
        table.add_row(*row)
    out = shown(table, width)
    lines = out.splitlines()
    assert max(map(len, lines)) <= width
    said = [line for line in lines if line.startswith("for want of room without: ")]
    missing = said[0].split(": ")[1].split(", ") if said else []
    found = out.split()
    for title, k in (("one", 0), ("two", 1), ("three", 2), ("text", 3)):
        if title in missing:
            continue
        for row in rows:
            for word in row[k].split():
                assert word in found


@pytest.mark.parametrize("width", range(24, 90, 3))
def test_no_number_is_cut_where_a_screen_is_too_narrow_for_what_may_be_dropped(width):
    titles = [f"column {k}" for k in range(6)]
    table = ScreenTable(*((title, "right") for title in titles), drop=titles[4:5])
    numbers = [f"{371.77 + k:.2f}" for k in range(6)]
    table.add_row(*numbers)
    lines = shown(table, width).splitlines()
    (row,) = (line.split() for line in lines if "371.77" in line)
    kept = int("".join(lines).count("column 0") > 0) * len(row)
    assert 0 < len(row) == kept
    assert set(row) <= set(numbers)
    missing = " ".join(" ".join(lines).split()).partition("without: ")[2]
    for title, number in zip(titles, numbers, strict=True):
        assert (number in row) != (title in missing)


@pytest.mark.parametrize("width", [60, 80, 120])
@pytest.mark.parametrize(
    "arguments",
    [["inspect", "p.ngc", "-m", "vmc"], ["controllers"], ["machine", "list"],
     ["plan", "X=3", "Z=1", "-m", "vmc"], ["map", "-m", "vmc", "--axis", "Z", "--length", "1"]],
    ids=lambda a: a[0],
)  # fmt: skip
def test_tables_fit_on_screens(command, monkeypatch, tmp_path, arguments, width):
    (tmp_path / "p.ngc").write_bytes(METRIC)
    monkeypatch.setenv("COLUMNS", str(width))
    code, out = command(*arguments)
    assert code == 0
    prose = ("note", "p.ngc", "  all rapids", "the worst", "within")
    table = [line for line in out.splitlines() if not line.startswith(prose)]
    assert max(map(len, table)) <= width
    numbers = [word for word in out.split() if word.startswith("->")]
    assert all(word == "->" for word in numbers)


def in_a_terminal(arguments, folder, stdout):
    """Run a command with a terminal as standard error: what it writes there."""
    master, slave = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "100"}
    process = subprocess.Popen(
        [sys.executable, "-m", "gcodejerk.cli", *arguments], cwd=folder, stdout=stdout,
        stderr=slave, env=environment, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    os.close(slave)
    parts = []
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # the terminal is closed
            break
        if not part:
            break
        parts.append(part)
    os.close(master)
    assert process.wait() == 0
    return b"".join(parts).decode()


def test_results_go_to_standard_output_while_a_bar_is_shown(tmp_path):
    for name in ("a.ngc", "b.ngc"):
        (tmp_path / name).write_bytes(METRIC)
    with open(tmp_path / "log", "wb") as log:
        screen = in_a_terminal(["process", "a.ngc", "b.ngc", "-m", "vmc"], tmp_path, log)
    said = (tmp_path / "log").read_text()
    assert said.startswith("a.ngc: 3 rapids, 2 rewritten")
    assert "2 programs: 4 rapids rewritten" in said
    assert "rapids rewritten" not in screen
    # The bar was drawn, and its line erased in the end.
    assert "\x1b[?25l" in screen
    assert screen.rindex("\x1b[2K") > screen.rindex("━")


LONG = {
    "compare -m vmc Z=1": ("conventional", "judging"),
    "map -m vmc --axis Z --length 1 -o z.png": ("mapping",),
    "plan -m vmc Z=1 --profile shortest": ("planning",),
    "simulate -m vmc Z=1": ("simulating",),
    "parameters -m vmc --controller fanuc a.ngc --no-curve": ("reading", "searching"),
    "verify a.ngc a.ngc -m vmc": ("reading",),
    "identify r.csv --axis Z": ("reading", "searching"),
}
"""Commands that may last for minutes; their first step, and their last one."""


@pytest.mark.parametrize("text", LONG)
def test_no_command_that_may_last_is_silent_on_a_terminal(tmp_path, text):
    (tmp_path / "a.ngc").write_bytes(METRIC)
    shutil.copy(SAMPLES / "ringing.csv", tmp_path / "r.csv")
    with open(tmp_path / "log", "wb") as log:
        screen = in_a_terminal(text.split(), tmp_path, log)
    assert [step for step in LONG[text] if step in screen] == list(LONG[text])
    assert screen.rindex("\x1b[2K") > screen.rindex(LONG[text][-1])


def test_a_comparison_says_what_it_does_from_its_beginning_to_its_end():
    from gcodejerk.studies.comparison import CONTENDERS, DESIGNED, compare_move

    told = []
    compare_move({"Z": 1.0}, Machine.load(find_machine("vmc")), progress=lambda *a: told.append(a))
    steps = list(dict.fromkeys(step for step, _, _ in told))
    assert steps == [*CONTENDERS[:3], *DESIGNED, "limits", "judging"]
    done = [part for _, part, _ in told]
    assert done == sorted(done)
    assert done[0] == 0
    (whole,) = {whole for _, _, whole in told}
    assert 0.9 * whole < done[-1] < whole


def test_long_lines_are_broken_between_words_on_a_terminal(monkeypatch, capsys):
    from gcodejerk.cli import common

    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "40")
    common.say("  " + "word " * 20 + "x" * 50)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("  word")
    assert all(line.startswith("    ") for line in lines[1:])
    assert max(map(len, lines[:-1])) <= 40
    assert lines[-1].strip() == "x" * 50


def test_programs_in_inches_are_shown_in_inches(command, tmp_path):
    (tmp_path / "i.ngc").write_bytes(INCH)
    code, out = command("inspect", "i.ngc", "-m", "vmc")
    assert code == 0
    assert "[inch]" in out
    assert "[thou]" in out
    assert "1.0000" in out
    record = json.loads(command("inspect", "i.ngc", "-m", "vmc", "--json")[1])
    assert record["summary"]["inch"] is True
    assert record["rapids"][1]["length"] == 25.4
    # A residual in thousandths of an inch is that in um over 25.4.
    now = max(r["conventional_displacement"] for r in record["rapids"][1]["residual"]) * 1e3 / 25.4
    assert f"{now:.2f} -> " in out


def test_a_program_as_a_line_of_json(command, tmp_path):
    for name in ("a.ngc", "b.ngc"):
        (tmp_path / name).write_bytes(METRIC)
    code, out = command("process", "a.ngc", "b.ngc", "missing.ngc", "-m", "vmc", "--json", "-q")
    lines = [json.loads(line) for line in out.splitlines() if line.startswith("{")]
    assert code == 1
    assert [line["input"] for line in lines] == ["a.ngc", "b.ngc", "missing.ngc"]
    assert [line["summary"] and line["summary"]["planned"] for line in lines] == [2, 2, None]
    assert "there is no file" in lines[2]["error"].lower()
    assert lines[0]["output"] == "a.jerk.ngc"
    code, out = command("verify", "a.ngc", "a.jerk.ngc", "-m", "vmc", "--json")
    record = json.loads(out)
    assert (code, record["ok"], record["rewritten"], record["violations"]) == (0, True, 2, [])
    (tmp_path / "a.jerk.ngc").write_bytes(
        (tmp_path / "a.jerk.ngc").read_bytes().replace(b"G1 X30", b"G1 X31")
    )
    code, out = command("verify", "a.ngc", "a.jerk.ngc", "-m", "vmc", "--json")
    assert (code, json.loads(out)["ok"]) == (1, False)
    assert command("verify", "a.ngc", "a.jerk.ngc", "-m", "vmc", "-q") == (1, "")


def test_where_rapids_were_left_alone(command, tmp_path):
    (tmp_path / "a.ngc").write_bytes(METRIC)
    code, out = command("process", "a.ngc", "-m", "vmc", "-v")
    assert code == 0
    assert "  start unknown: line 2" in out


def test_the_original_is_kept_and_comes_back(command, tmp_path):
    part, kept = tmp_path / "a.ngc", tmp_path / "a.ngc.orig"
    part.write_bytes(METRIC)
    assert command("process", "a.ngc", "-m", "vmc", "--backup")[0] == 2
    assert command("process", "a.ngc", "-m", "vmc", "--in-place", "--backup")[0] == 0
    assert kept.read_bytes() == METRIC
    made = part.read_bytes()
    assert made != METRIC
    # A second run is refused (the stamp), and nothing is lost by it.
    assert command("process", "a.ngc", "-m", "vmc", "--in-place", "--backup")[0] == 1
    # Nothing is left to rewrite in it, so no copy is made of what is no original.
    assert command("process", "a.ngc", "-m", "vmc", "--in-place", "--backup", "--force")[0] == 0
    assert (kept.read_bytes(), part.read_bytes()) == (METRIC, made)
    part.write_bytes(METRIC.replace(b"X20", b"X21"))
    code, out = command("process", "a.ngc", "-m", "vmc", "--in-place", "--backup")
    assert (code, "an original would be lost" in out) == (1, True)
    assert kept.read_bytes() == METRIC
    part.write_bytes(made)
    code, out = command("process", "--revert", "a.ngc")
    assert (code, "the original is back" in out) == (0, True)
    assert part.read_bytes() == METRIC
    assert not kept.exists()
    code, out = command("process", "--revert", "a.ngc")
    assert (code, "no a.ngc.orig" in out) == (1, True)


@pytest.mark.parametrize("option", [["--check"], ["--diff"], ["-o", "b.ngc"], ["--json"]])
def test_putting_originals_back_takes_no_option_of_outputs(command, tmp_path, option):
    (tmp_path / "a.ngc").write_bytes(METRIC)
    assert command("process", "-q", "a.ngc", "-m", "vmc", "--in-place", "--backup")[0] == 0
    made = (tmp_path / "a.ngc").read_bytes()
    code, out = command("process", "--revert", "a.ngc", *option)
    assert (code, option[0] in out) == (2, True)
    assert (tmp_path / "a.ngc").read_bytes() == made
    assert (tmp_path / "a.ngc.orig").read_bytes() == METRIC


def test_there_is_no_difference_where_the_program_stays_as_it_is(command, tmp_path):
    (tmp_path / "a.ngc").write_bytes(METRIC)
    code, out = command("process", "a.ngc", "-m", "vmc", "--controller", "csv", "--diff")
    assert (code, "--diff" in out) == (2, True)


def test_an_edited_output_does_not_give_way(command, tmp_path):
    (tmp_path / "a.ngc").write_bytes(b"G0 X1 (edited by hand)\n")
    (tmp_path / "a.ngc.orig").write_bytes(METRIC)
    code, out = command("process", "--revert", "a.ngc")
    assert (code, "carries no stamp" in out) == (1, True)
    assert (tmp_path / "a.ngc").read_bytes() == b"G0 X1 (edited by hand)\n"


@pytest.mark.parametrize("name", ["plan", "compare"])
def test_forty_seconds_were_meant_as_milliseconds(command, name):
    code, out = command(name, "-m", "vmc", "Z=1", "--time", "40")
    assert (code, "did you mean 40 ms" in out, "--time 0.04" in out) == (1, True, True)
    assert command(name, "-m", "vmc", "Z=1", "--time", "0.04")[0] == 0


def test_a_map_of_a_measured_spectrum(command, tmp_path):
    (tmp_path / "s.csv").write_text(SPECTRUM)
    (tmp_path / "m.yaml").write_text(
        "interval: 0.001\npositioning: linear\naxes:\n  X:\n"
        "    rapid: {velocity: 300, acceleration: 3000}\n    limit: {acceleration: 6000}\n"
        "    spectrum: {file: s.csv}\n"
    )
    code, out = command("map", "-m", "m.yaml", "--axis", "X", "--length", "10", "--json")
    record = json.loads(out)
    assert (code, record["modes"][0]["mode"]) == (0, "peak of s.csv")
    # The planner's own measure of today's rapid is made of samples, and by other code.
    plan = json.loads(command("plan", "-m", "m.yaml", "X=10", "--json", "-")[1])
    stated = plan["rapids"][0]["residual"][0]["conventional_displacement"]
    assert record["modes"][0]["conventional_displacement"] == pytest.approx(stated, rel=0.05)
    chosen = record["chosen"]
    survey = Survey.of(Machine.load(tmp_path / "m.yaml"), "X", 10.0)
    grid = survey.values(*(np.array([chosen[k]]) for k in ("T1", "T_SUM")))
    assert grid.item() == pytest.approx(record["modes"][0]["displacement"])
    code, out = command("map", "-m", "m.yaml", "--axis", "X", "--length", "10", "-o", "m.svg")
    assert (code, Path("m.svg").stat().st_size > 1000) == (0, True)


def test_completion_can_be_had():
    for words, expected in (
        ("gcodejerk plan --machine d", "drill"),
        ("gcodejerk process --controller linuxcnc-", "linuxcnc-hal"),
        ("gcodejerk machine test", "test-program"),
    ):
        # What a shell asks behind a tabulator.
        asked = {"_GCODEJERK_COMPLETE": "complete_bash", "COMP_WORDS": words,
                 "COMP_CWORD": str(len(words.split()) - 1)}  # fmt: skip
        done = subprocess.run(
            [Path(sys.executable).with_name("gcodejerk")], env=os.environ | asked,
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.stdout.split() == [expected]
