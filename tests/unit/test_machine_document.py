import os

import pytest
import yaml

from gcodejerk.machine import Machine, MachineFileError
from gcodejerk.machine.file import document
from gcodejerk.machine.file.document import MOST_BYTES


def first_line(text):
    with pytest.raises(MachineFileError) as caught:
        Machine.loads(text, "mill.yaml")
    return str(caught.value).splitlines()[0]


def refusal_of(path):
    with pytest.raises(MachineFileError) as caught:
        Machine.load(path)
    return str(caught.value).replace(str(path), "mill.yaml")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "mill.yaml:1:1: is empty, expected a machine"),
        ("# nothing but a comment\n", "mill.yaml:1:1: is empty, expected a machine"),
        ("- a\n", "mill.yaml:1:1: the file is [a], expected a mapping with the keys schema, "),
        ("G0 X1\n", "mill.yaml:1:1: the file is 'G0 X1', expected a mapping with the keys "),
        ("a: 1\nb: [1, 2\n", "mill.yaml:3:1: is not YAML: did not find expected ',' or ']'"),
        ("a: b: c\n", "mill.yaml:1:5: is not YAML: mapping values are not allowed"),
        ("a: *b\n", "mill.yaml:1:4: is not YAML: found undefined alias"),
        ("---\na: 1\n---\nb: 2\n", "mill.yaml:3:1: is not YAML: but found another document"),
        ("a: 1\nb: x\0y\n", "mill.yaml:2:5: holds the control character 0x00"),
        ("a: \udc80\n", "mill.yaml:1:4: holds the control character 0xDC80"),
        ("a: \ufffe\n", "mill.yaml:1:4: holds the character"),
        ("a: !!python/object/apply:os.system [ls]\n",
         "mill.yaml:1:4: the tag '!!python/object/apply:os.system' is not allowed"),
        ("a: !secret x\n", "mill.yaml:1:4: the tag '!secret' is not allowed"),
        ("axes:\n  <<: 5\n", "mill.yaml:2:7: a merge key (<<) stands before something that"),
        ("axes: &a {<<: *a}\n", "mill.yaml:1:7: merge keys (<<) expand to more than"),
        ("a: " + "[" * 100, "mill.yaml:1:23: holds more than 20000 values, 1000 aliases or"),
        ("a: [" + "1," * 30_000 + "]", "mill.yaml:1:"),
    ],
)  # fmt: skip
def test_a_text_that_is_no_machine_file_is_refused_at_its_place(text, line):
    assert first_line(text).startswith(line)


def test_levels_without_end_are_refused_by_their_number():
    # Some libraries read further ahead than to where they are too many.
    assert "aliases or 20 levels, which no machine has" in first_line("a: " + "[" * 100_000)


def test_a_tab_is_named_in_the_remedy():
    with pytest.raises(MachineFileError) as caught:
        Machine.loads("axes:\n\tX: 1\n", "mill.yaml")
    assert caught.value.place.line == 2
    assert caught.value.remedy == "this line holds a tab; indent with spaces"


LAUGHS = "a0: &a0 [lol, lol]\n" + "".join(
    f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 30)
)
MERGED_LAUGHS = "a0: &a0 {x: 1}\n" + "".join(
    f"a{n}: &a{n}\n  <<: [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 15)
)
MANY_MODES = "modes: [" + "&m {frequency: 5}, " + "*m, " * 900 + "]\n"


@pytest.mark.parametrize(
    "text",
    [
        LAUGHS,
        MERGED_LAUGHS,
        MERGED_LAUGHS + "<<: *a14\n",
        "axes: *x\n" + LAUGHS,
        MANY_MODES,
        "? " * 300_000,
        "- " * 300_000,
        "{a: " * 200_000,
        "a: &b [*b]\naxes: *b\n",
        "".join(f"k{n}: 1\n" for n in range(9_000)),
        "a: '" + "x" * 900_000,
        "9" * 900_000,
        "interval: " + "9" * 900_000,
        "interval: " + "1e" * 400_000,
        "name: " + "x" * 900_000,
        "x" * 500_000 + ": 1",
        "&" * 900_000,
        ":" * 900_000,
        "\n" * 900_000,
        "#" * 900_000,
        "!" * 900_000,
        "a: &a\n  <<: *a\n",
        "&a {schema: 1, axes: *a, modes: *a, design: *a, program: *a}",
        "[" * 10_000 + "]" * 10_000,
        "interval: 0." + "0" * 900_000 + "1",
        "interval: " + "1:" * 400_000 + "1",
        "interval: 1e999",
        'name: "\\U00110000"',
        'name: "\\Uffffffff"',
        "%TAG !a! b\n" * 80_000 + "---\na: 1\n",
        "".join(f"%TAG !{n}! b\n" for n in range(60_000)) + "---\na: 1\n",
        "--- a\n" * 100_000,
        "interval: !!python/object/apply:os.system [exit 1]",
        "interval: !!python/name:os.system",
        "%TAG ! tag:yaml.org,2002:python/\n--- !object:os.x {}\n",
        "interval: !<tag:yaml.org,2002:python/object:os.x> {}",
    ],
    ids=lambda text: text[:16].strip(),
)
@pytest.mark.parametrize("loader", ["CSafeLoader", "SafeLoader"])
def test_a_hostile_text_is_refused_without_being_expanded(text, loader, monkeypatch):
    # Without the bounds some of these take hours and all memory: this test would not end.
    monkeypatch.setattr(document, "_LOADER", getattr(yaml, loader))
    message = first_line(text)
    assert message.startswith("mill.yaml")
    assert len(message) < 1000


def test_a_pipe_and_a_device_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    expected = "mill.yaml: is a pipe or a device, expected a machine file\n"
    assert refusal_of(tmp_path / "pipe.yaml").startswith(expected)
    assert refusal_of("/dev/zero").startswith(expected)


def test_a_file_that_is_missing_is_refused(tmp_path):
    path = tmp_path / "none.yaml"
    assert refusal_of(path).startswith("mill.yaml: there is no such file\n")


def test_a_directory_is_refused(tmp_path):
    assert refusal_of(tmp_path).startswith("mill.yaml: is a directory, expected a machine file\n")


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="everything is readable for root"
)
def test_an_unreadable_file_is_refused(tmp_path):
    path = tmp_path / "secret.yaml"
    path.write_text("axes: {}\n")
    path.chmod(0)
    assert refusal_of(path).startswith("mill.yaml: cannot be read: Permission denied\n")


@pytest.mark.parametrize(
    ("data", "start"),
    [
        (b"", "mill.yaml:1:1: is empty"),
        (b"\xef\xbb\xbf", "mill.yaml:1:1: is empty"),
        (b"\xff\xfea\x00:\x00", "mill.yaml:1:1: is UTF-16 or UTF-32 text"),
        ("axes: {}".encode("utf-16-be"), "mill.yaml:1:1: holds the control character 0x00"),
        (b"a: 1\nname: M\xfcller\n", "mill.yaml:2:8: byte 0xFC is not UTF-8 text"),
        (b"\x7fELF\x02\x01\x01", "mill.yaml:1:1: holds the control character 0x7F"),
        (b"\x89PNG\r\n\x1a\n", "mill.yaml:1:1: byte 0x89 is not UTF-8 text"),
        (b"#" * (MOST_BYTES + 1), "mill.yaml: is larger than 1 MiB"),
    ],
)
def test_a_file_that_is_no_text_is_refused(tmp_path, data, start):
    path = tmp_path / "mill.yaml"
    path.write_bytes(data)
    assert refusal_of(path).startswith(start)
