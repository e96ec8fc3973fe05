"""One line at a time: words, comments, and what is wrong with it."""

import numpy as np
import pytest

from gcodejerk.nc import find_dialect, parse_block
from gcodejerk.nc.dialects import DIALECTS
from gcodejerk.nc.text import tokenizer


def words(text):
    return [(w.letter, w.value) for w in parse_block(text).words]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"G0X1Y2", [("G", 0), ("X", 1), ("Y", 2)]),
        (b"g0x +0. 12 34y 7", [("G", 0), ("X", 0.1234), ("Y", 7)]),
        (b"X1. Y-.5 Z+3", [("X", 1), ("Y", -0.5), ("Z", 3)]),
        (b"G0 X1 (G0 X9) Y2", [("G", 0), ("X", 1), ("Y", 2)]),
        (b"X1 ;Y2 (", [("X", 1)]),
        (b"N56.78 X1", [("N", 56.78), ("X", 1)]),
        (b"X#1 Y[1+[2*3]] Z-#<depth> A##2", [(a, None) for a in "XYZA"]),
        (b"X sin[30] Y atan[1]/[2]", [("X", None), ("Y", None)]),
        (b"\tX\t1\t", [("X", 1)]),
        (b"(\xe4\xf6\xfc) X1", [("X", 1)]),
    ],
)
def test_words(text, expected):
    block = parse_block(text)
    assert block.problem is None
    assert words(text) == expected


@pytest.mark.parametrize(
    ("text", "column"),
    [
        (b"G0 Y4..2", 5),
        (b"X1 (open", 4),
        (b"(a (b) c)", 4),
        (b"X1e5", None),
        (b"X1 N5", 4),
        (b"(c) N5", 5),
        (b"N10 /X1", 5),
        (b"X--1", 2),
        (b"X", 2),
        (b"X1\rY2", 3),
        (b"X=1", 2),
        (b"#1 5", 4),
        (b"X[1", 2),
        (b"X1 (py, anything)", 4),
        (b"% text", 2),
        (b"X1 " + b" " * 300, 255),
    ],
)
def test_problem_is_named_with_its_column(text, column):
    block = parse_block(text)
    if column is None:  # a letter without a use, which only the meaning can tell
        assert [w.letter for w in block.words] == ["X", "E"]
    else:
        assert block.problem
        assert block.column == column


def test_word_spans_are_those_of_the_line():
    text = b" G0  X- 1.5 (c) Y2 "
    block = parse_block(text)
    assert [text[w.begin : w.end] for w in block.words] == [b"G0", b"X- 1.5", b"Y2"]
    assert [text[a:b] for a, b in block.comments] == [b"(c)"]


def test_block_delete_and_percent_are_flags():
    assert parse_block(b"/N1 X1").block_delete
    assert parse_block(b" % ").percent


@pytest.mark.parametrize(
    ("text", "keyword", "name"),
    [
        (b"o100 sub", "sub", "100"),
        (b"N5 O<my name> CALL [1] [2]", "call", "<myname>"),
        (b"o#1 if [#2 gt 3] (c)", "if", "#1"),
        (b"O1000", "", "1000"),
    ],
)
def test_o_words(text, keyword, name):
    block = parse_block(text)
    assert (block.problem, block.o_word, block.o_name) == (None, keyword, name)


def test_assignments_are_listed():
    assert parse_block(b"#1=5 #<a>=[#1+1] X1").assigns == ("1", "<a>")


@pytest.mark.parametrize("dialect", [d for d in DIALECTS if not DIALECTS[d].text.klartext])
def test_plain_blocks_are_read_the_quick_way_as_the_careful_one_reads_them(dialect):
    random = np.random.default_rng(12)
    taken = 0
    for _ in range(300):
        words = [f"N{random.integers(1, 10**6)}"] * (random.random() < 0.4)
        words += [f"G{random.choice(['0', '00', '1', '01', '2', '53', '90'])}"] * (
            random.random() < 0.7
        )
        for letter in random.permutation(list("XYZ"))[: random.integers(1, 4)]:
            number = random.choice(["5", "-5.", "12.345", "-0.001", "0", "007.50", "123456"])
            words.append(f"{letter}{number}")
        text = (" " if random.random() < 0.7 else "").join(words).encode()
        text += b" " * int(random.random() < 0.2)
        taken += tokenizer._PLAIN.fullmatch(text) is not None
        quick = tokenizer.parse_line(text, find_dialect(dialect))
        assert quick == tokenizer._parse_carefully(text, find_dialect(dialect)), text
    assert taken == 300
