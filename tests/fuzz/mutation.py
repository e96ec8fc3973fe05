"""Changes to a program that keep it near what a reader takes for one.

Bytes flipped at random are refused at the first comment; words put in the wrong place, numbers out
of range and lines repeated a thousand times go further.
"""

import random

WORDS = [
    *"G0 G1 G2 G3 G4 G10 G17 G18 G19 G20 G21 G28 G33 G38.2 G40 G41 G43 G49 G52 G53 G54".split(),
    *"G59.3 G61 G61.1 G64 G73 G76 G80 G81 G83 G90 G91 G91.1 G92 G92.1 G93 G94 G95 G96".split(),
    *"G98 G99 G7 G8 M0 M2 M3 M6 M30 M66 M70 M72 M98 M99 M101 T1 H1 D1 S100 F100 F0 L2".split(),
    *"P1 Q1 R1 I5 J0 K1 X0 X10 Y-5 Z.5 A90 B1 C-90 U1 V2 W3 x1 g0 X+1 X-0 X1. N10 O1".split(),
    *"( ) ; / % [ ] # < > #1=2 #1 #5220=1 #<a>=1 #<a> [1+2] sin[1] atan[1]/[2] O1sub".split(),
    *"O1endsub (py,1) ;py,x MSG(1) R1=2 WHILE GOTO5 CALL LBL *50 $ @1 ! ? : = , \" ' _ ~".split(),
    *("(gcodejerk stamp)", "; gcodejerk stamp", "(gcodejerk: G0 X1)", "O1 call [1]"),
    *("\t", "\r", "\n", "\x0b", "\x1a", "\xa0", "\xff", "\x00"),
]
NUMBERS = [
    *"0 -0 +0 .5 1. -.001 0.00001 123456789 1e5 99999999999 1000000000 0.123456789012345".split(),
    *". - + .. 1.2.3 --1 1-1 +-1 0x10 1,5 00000001 1_0 inf nan".split(),
]
STRETCHES = [
    b"(", b"[", b"]", b"#", b"#1=#1=", b"G", b"0", b"1.", b";", b" ", b"-", b"<", b"#<", b"N1",
    b"G0", b"X1", b"G0 X1 ", b"/", b"%", b"()", b"[1]", b"sin", b"sin[", b"O",
    b"\r", b"\n", b"\r\n", b"(a)", b"\t", b"+", b"#[", b"**", b"1 ",
]  # fmt: skip
LONGEST = 60_000
"""Of a stretched line; longer ones are refused as a whole."""


def mutate(data, draw, most):
    """A program that differs a little; `draw` is a random.Random."""
    for _ in range(1 + draw.randrange(4)):
        data = draw.choice(KINDS)(data, draw)
    return data[:most]


def _lines(change):
    """A change of the list of lines."""

    def changed(data, draw):
        lines = data.split(b"\n")
        change(lines, draw)
        return b"\n".join(lines)

    return changed


@_lines
def _swap(lines, draw):
    i, j = draw.randrange(len(lines)), draw.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]


@_lines
def _delete(lines, draw):
    del lines[draw.randrange(len(lines))]


@_lines
def _repeat(lines, draw):
    i = draw.randrange(len(lines))
    lines[i:i] = lines[i : i + 1 + draw.randrange(5)] * draw.choice([1, 2, 30])


@_lines
def _word_in_line(lines, draw):
    i = draw.randrange(len(lines))
    words = lines[i].split(b" ")
    words.insert(draw.randrange(len(words) + 1), draw.choice(WORDS).encode("latin-1"))
    lines[i] = draw.choice([b" ", b""]).join(words)


@_lines
def _new_line(lines, draw):
    words = [draw.choice(WORDS).encode("latin-1") for _ in range(1 + draw.randrange(4))]
    lines.insert(draw.randrange(len(lines) + 1), b" ".join(words))


@_lines
def _stretch(lines, draw):
    part = draw.choice(STRETCHES)
    times = draw.choice([3, 20, 300, LONGEST]) // len(part) + 1
    lines.insert(draw.randrange(len(lines) + 1), draw.choice([b"", b"G0 "]) + part * times)


@_lines
def _join(lines, draw):
    i = draw.randrange(len(lines))
    lines[i : i + 2] = [b"".join(lines[i : i + 2])]


def _number(data, draw):
    """Another number in the place of one."""
    digits = [k for k, byte in enumerate(data) if byte in b"0123456789"]
    if not digits:
        return data
    begin = end = draw.choice(digits)
    while end < len(data) and data[end] in b"0123456789.":
        end += 1
    return data[:begin] + draw.choice(NUMBERS).encode() + data[end:]


def _byte(data, draw):
    if not data:
        return data
    at = draw.randrange(len(data))
    return data[:at] + bytes([draw.randrange(256)]) + data[at + draw.randrange(2) :]


def _cut(data, draw):
    at = draw.randrange(len(data) + 1)
    return data[:at]


def _ends(data, draw):
    """Other line ends."""
    return data.replace(*draw.choice([(b"\n", b"\r\n"), (b"\r\n", b"\n"), (b"\n", b"\r")]))


KINDS = [
    _swap, _delete, _repeat, _word_in_line, _word_in_line, _new_line, _new_line, _stretch, _join,
    _number, _number, _byte, _cut, _ends,
]  # fmt: skip


def drawn(seeds, number, most, seed=0):
    """So many programs, the same ones for the same seed."""
    draw = random.Random(seed)
    for _ in range(number):
        yield mutate(draw.choice(seeds), draw, most)
