"""Which programs files and folders stand for, and what their outputs are called."""

import os
import subprocess

import pytest

from gcodejerk.batch.inputs import (
    SUFFIXES,
    Input,
    NameClashError,
    check_names,
    find_inputs,
    output_name,
)


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """Makes files in a folder of its own, from names with slashes."""
    monkeypatch.chdir(tmp_path)

    def make(*names):
        for name in names:
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(b"M2\n")

    return make


def names(*arguments, passed_over=None):
    found, problems = find_inputs(list(arguments), passed_over)
    assert not problems
    return [(f.path, f.below) for f in found]


def test_a_named_file_is_taken_whatever_its_name(tree):
    tree("shop/O1234", "shop/.hidden.nc")
    assert names("shop/O1234", "shop/.hidden.nc", "-") == [
        ("shop/O1234", "O1234"), ("shop/.hidden.nc", ".hidden.nc"), ("-", "-")
    ]  # fmt: skip


def test_a_folder_is_walked_in_the_order_of_names_its_files_first(tree):
    tree("shop/b.nc", "shop/a/z.NGC", "shop/a/y.MPF", "shop/c.tap", "shop/B.nc", "shop/a/a/x.gcode")
    assert [below for _, below in names("shop")] == [
        "B.nc", "b.nc", "c.tap", "a/y.MPF", "a/z.NGC", "a/a/x.gcode"
    ]  # fmt: skip


def test_what_is_no_program_or_ours_or_hidden_is_passed_over(tree):
    tree("s/a.nc", "s/a.jerk.nc", "s/A.JERK.NC", "s/.a.nc", "s/a.txt", "s/nc", "s/.git/b.nc",
         "s/.~gcodejerk-0123456789abcdef", "s/a.yaml")  # fmt: skip
    assert [below for _, below in names("s")] == ["a.nc"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_documented_suffix_is_found(tree, suffix):
    tree(f"s/a{suffix}", f"s/b{suffix.upper()}")
    assert len(names("s")) == 2


def test_this_folder_gives_names_without_a_dot_and_slash(tree):
    tree("a.nc", "b/c.nc")
    assert names(".") == [("a.nc", "a.nc"), ("b/c.nc", "b/c.nc")]


def test_links_do_not_lead_round_in_circles(tree, tmp_path):
    tree("s/a/b.nc", "other/c.nc")
    (tmp_path / "s" / "a" / "up").symlink_to("..")
    (tmp_path / "s" / "self.nc").symlink_to("self.nc")
    (tmp_path / "s" / "nowhere.nc").symlink_to("nothing")
    (tmp_path / "s" / "link.nc").symlink_to("../other/c.nc")
    found, problems = find_inputs(["s"], None)
    assert [one.below for one in found] == ["link.nc", "a/b.nc"]
    assert sorted(str(problem).split(" ")[0] for problem in problems) == [
        "s/nowhere.nc",
        "s/self.nc",
    ]
    assert all("leads nowhere" in str(problem) for problem in problems)


def test_a_link_to_a_folder_is_walked_where_it_is_named(tree, tmp_path):
    tree("real/a.nc")
    (tmp_path / "link").symlink_to("real")
    assert names("link") == [("link/a.nc", "a.nc")]


def test_a_pipe_with_the_name_of_a_program_is_passed_over(tree, tmp_path):
    tree("s/a.nc")
    os.mkfifo(tmp_path / "s" / "pipe.nc")
    (tmp_path / "s" / "folder.nc").mkdir()
    assert [below for _, below in names("s")] == ["a.nc"]


def test_the_folder_of_outputs_is_not_an_input(tree):
    tree("a.nc", "out/a.nc", "out/b/c.nc")
    assert names(".", passed_over="out") == [("a.nc", "a.nc")]
    assert names("out", passed_over="out") == [("out/a.nc", "a.nc"), ("out/b/c.nc", "b/c.nc")]


def test_a_program_that_is_named_twice_is_taken_once(tree):
    tree("s/a.nc", "s/b.nc")
    assert names("s/b.nc", "s", "s/b.nc") == [("s/b.nc", "b.nc"), ("s/a.nc", "a.nc")]


def test_folders_nest_as_deep_as_they_like(tree, tmp_path):
    here = os.open(tmp_path, os.O_RDONLY)
    try:
        for _ in range(1200):
            os.mkdir("d", dir_fd=here)
            below = os.open("d", os.O_RDONLY, dir_fd=here)
            os.close(here)
            here = below
    finally:
        os.close(here)
    tree("d/a.nc")
    assert names("d") == [("d/a.nc", "a.nc")]
    subprocess.run(["rm", "-rf", tmp_path / "d"], check=True)  # too deep for pytest's own hands


def test_a_folder_without_programs_is_told(tree):
    tree("s/readme.txt", "t/a.nc")
    found, problems = find_inputs(["s", "t"])
    assert [f.path for f in found] == ["t/a.nc"]
    assert "s holds no program" in str(problems[0])
    assert ".mpf" in str(problems[0])


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read anywhere")
def test_a_folder_that_cannot_be_read_is_told_and_the_others_are_read(tree, tmp_path):
    tree("s/a.nc", "s/shut/b.nc", "s/t/c.nc")
    (tmp_path / "s" / "shut").chmod(0)
    found, problems = find_inputs(["s"])
    (tmp_path / "s" / "shut").chmod(0o755)
    assert [f.below for f in found] == ["a.nc", "t/c.nc"]
    assert "s/shut cannot be read" in str(problems[0])


@pytest.mark.parametrize(
    ("path", "below", "folder", "suffix", "output"),
    [
        ("a/p.nc", "p.nc", None, "", "a/p.jerk.nc"),
        ("a/p.nc", "p.nc", None, ".csv", "a/p.jerk.csv"),
        ("a/O12", "O12", None, "", "a/O12.jerk"),
        ("a/b/p.x.nc", "b/p.x.nc", "out", "", "out/b/p.x.nc"),
        ("a/b/p.x.nc", "b/p.x.nc", "out", ".csv", "out/b/p.x.csv"),
        ("/abs/p.nc", "p.nc", "out", "", "out/p.nc"),
    ],
)
def test_outputs_are_named_after_their_programs(path, below, folder, suffix, output):
    assert output_name(Input(path, below), folder, suffix) == output


def test_two_outputs_of_one_name_are_refused(tree):
    with pytest.raises(NameClashError, match=r"a/p\.nc and b/p\.nc would both be written to out/p"):
        check_names(["a/p.nc", "b/p.nc"], ["out/p.nc", "out/p.nc"])


def test_one_file_under_two_names_is_one_output(tree, tmp_path):
    tree("a.nc")
    (tmp_path / "link.nc").symlink_to("a.nc")
    with pytest.raises(NameClashError):
        check_names(["a.nc", "link.nc"], ["a.nc", "link.nc"])


def test_an_output_over_another_program_is_refused(tree):
    tree("a/p.nc", "p.nc")
    with pytest.raises(NameClashError, match=r"a/p\.nc would be written over p\.nc"):
        check_names(["a/p.nc", "p.nc"], ["./p.nc", "p.jerk.nc"])
