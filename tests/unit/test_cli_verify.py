"""The command verify: what it accepts, what it lists, and its exit status."""

import json
import shutil
from pathlib import Path

import pytest

SAMPLES = Path(__file__).parents[2] / "samples"


@pytest.fixture
def run(command, tmp_path):
    shutil.copy(SAMPLES / "plate.ngc", tmp_path)
    return command


@pytest.fixture
def processed(run, tmp_path):
    assert run("process", "-q", "plate.ngc", "-m", "vmc")[0] == 0
    return tmp_path / "plate.jerk.ngc"


def test_what_process_wrote_is_accepted(run, processed):
    code, out = run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc")
    assert code == 0
    assert "19 of its 26 rapids re-timed and nothing else changed" in out
    assert "19 of 19 confirmed by a second reading" in out


def test_the_original_is_the_original_with_nothing_re_timed(run):
    code, out = run("verify", "plate.ngc", "plate.ngc", "-m", "vmc")
    assert (code, "0 of its 26" in out) == (0, True)


def test_every_damage_is_listed_with_its_line(run, processed):
    lines = processed.read_bytes().split(b"\n")
    first = next(k for k, line in enumerate(lines) if line.startswith(b"G1 Z9."))
    lines[first + 3] = lines[first + 3].replace(b"Z9.", b"Z8.", 1)
    last = next(k for k in reversed(range(len(lines))) if lines[k].startswith(b"N"))
    lines[last] += b" X1"
    processed.write_bytes(b"\n".join(lines))
    code, out = run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc")
    assert code == 1
    assert f"plate.jerk.ngc:{first + 4}: " in out
    assert f"plate.jerk.ngc:{last + 1}: line changed" in out
    assert "do not run it" in out
    code, out = run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc", "--most", "1")
    assert (code, "1 or more violations" in out) == (1, True)


def test_the_walk_goes_on_behind_lines_that_were_changed_lost_and_added(run, processed):
    """Of every kind, in one file, and a rapid's block, and a stream that is none any more."""
    lines = processed.read_bytes().split(b"\n")
    starts = [k for k, line in enumerate(lines) if line.startswith(b"(gcodejerk: ")]
    kept = [k for k, line in enumerate(lines) if line.startswith(b"N")]
    damaged = {
        starts[1] + 5: b"G1 nonsense",  # within a stream
        kept[3]: b"N1 (changed)",
        kept[7]: b"(added)\n" + lines[kept[7]],
        starts[-2] + 6: b"G2 X1",
        kept[-2]: None,
    }
    for k in sorted(damaged, reverse=True):
        lines[k : k + 1] = [] if damaged[k] is None else damaged[k].split(b"\n")
    processed.write_bytes(b"\n".join(lines))
    code, out = run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc")
    assert code == 1
    listed = {
        int(line.split(":")[1])
        for line in out.splitlines()
        if line.startswith("plate.jerk.ngc:") and line.split(":")[1].isdigit()
    }
    moved = sum(1 for k in damaged if damaged[k] is not None and b"\n" in damaged[k])
    for k in damaged:
        at = k + 1 + moved * (k > kept[7])
        assert at in listed or at + 1 in listed, (at, out)
    assert len(listed) <= 2 * len(damaged), out


def test_what_differs_is_shown_where_it_stands_far_to_the_right(run, processed):
    lines = (SAMPLES / "plate.ngc").read_bytes().split(b"\n")
    comment = next(line for line in lines if len(line) > 70)
    processed.write_bytes(processed.read_bytes().replace(comment, comment + b" G91", 1))
    code, out = run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc")
    end = comment[-15:].decode()
    assert code == 1
    assert f"{end}' as in the original, found '..." in out
    assert f"{end} G91'" in out


def test_another_machines_limits_are_not_kept(run, processed):
    assert run("verify", "plate.ngc", "plate.jerk.ngc", "-m", "router")[0] == 1


def test_a_table_of_streams_is_verified(run, tmp_path):
    assert run("process", "-q", "plate.ngc", "-m", "vmc", "--controller", "csv")[0] == 0
    code, out = run("verify", "plate.ngc", "plate.jerk.csv", "-m", "vmc")
    assert (code, "19 of its 26" in out) == (0, True)


def test_the_processed_program_may_come_from_standard_input(run, processed):
    given = processed.read_bytes()
    code, _ = run("verify", "plate.ngc", "-", "-m", "vmc", input=given)
    assert code == 0


def test_a_missing_file_is_refused_and_two_standard_inputs_are_wrong_usage(run):
    code, out = run("verify", "plate.ngc", "none.ngc", "-m", "vmc")
    assert (code, "none.ngc" in out) == (1, True)
    assert run("verify", "-", "-", "-m", "vmc")[0] == 2


def test_streams_are_held_to_the_profiles_of_a_report(run, processed, tmp_path):
    assert run("process", "-q", "plate.ngc", "-m", "vmc", "--report", "r.json")[0] == 0
    check = ("verify", "plate.ngc", "plate.jerk.ngc", "-m", "vmc", "--report", "r.json")
    assert run(*check)[0] == 0
    report = json.loads((tmp_path / "r.json").read_text())
    rapid = next(r for r in report["rapids"] if r["status"] == "planned")
    rapid["segments"][0]["jerk"] *= 0.8
    (tmp_path / "r.json").write_text(json.dumps(report))
    code, out = run(*check)
    assert (code, "off the profile that was reported" in out) == (1, True)
    for text in ("{}", "[", '{"rapids": 3}'):
        (tmp_path / "r.json").write_text(text)
        code, out = run(*check)
        assert (code, "is no report of process" in out) == (1, True)


def test_a_table_is_verified_under_any_name(run, tmp_path):
    assert run("process", "-q", "plate.ngc", "-m", "centre", "-o", "plate.csv")[0] == 0
    (tmp_path / "plate.csv").rename(tmp_path / "plate.points")
    code, out = run("verify", "plate.ngc", "plate.points", "-m", "centre")
    assert (code, "re-timed and nothing else changed" in out) == (0, True), out


@pytest.fixture
def independent(run, tmp_path):
    """A machine whose rapids of profile `shortest` take another time than by condition3."""
    described = run("machine", "show", "vmc")[1]
    (tmp_path / "own.yaml").write_text(
        described.replace("positioning: linear ", "positioning: independent ")
    )
    return "own.yaml"


@pytest.mark.parametrize("controller", ["json", "pmac"])
def test_rows_say_with_which_profile_they_were_made(run, independent, controller):
    said = ["-m", independent, "--controller", controller]
    assert run("process", "-q", "plate.ngc", *said, "--profile", "shortest", "-o", "rows")[0] == 0
    assert run("verify", "plate.ngc", "rows", *said)[0] == 0
    # The user's own word is taken, whatever the rows say.
    code, out = run("verify", "plate.ngc", "rows", *said, "--profile", "condition3")
    assert (code, "moves earlier or later" in out) == (1, True)


def test_of_a_table_that_says_no_profile_the_user_is_asked_for_it(run, independent):
    said = ["-m", independent, "--controller", "csv"]
    assert run("process", "-q", "plate.ngc", *said, "--profile", "shortest", "-o", "t.csv")[0] == 0
    code, out = run("verify", "plate.ngc", "t.csv", *said)
    assert code == 1
    assert "taken as condition3; repeat the --profile of `process`" in out
    assert run("verify", "plate.ngc", "t.csv", *said, "--profile", "shortest")[0] == 0
