"""What reads F, or keeps it to give it back, behind a rapid whose F is not known."""

import io

import pytest

from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.reasons import REASONS, Reason

PLACED = {axis: 0.0 for axis in "XYZ"}


def last_rapid(text, dialect):
    """Why the last rapid is left alone; None where it is not."""
    start = Start(positions=PLACED)
    rapids = read_program(io.BytesIO(text), dialect=dialect, start=start).rapids
    return None if rapids.reason[-1] == CERTAIN else REASONS[rapids.reason[-1]]


LINUXCNC = b"G21 G90 G17 G94 G40 G64\nF#200\nG0 X1 Y2 Z3\nG0 X-20\n%sG1 X-10 F100\nM2\n"
SUB = b"o10 sub\n%so10 endsub\n"
FANUC = b"O1\nG21 G17 G40 G49 G80 G90 G94 G54 G64\nG0 X0. Y0. Z50.\nF#500\nG0 X10.\n%sM30\n"
SIEMENS = b"G710 G17 G40 G90 G94 G64 G54\nG0 X0 Y0 Z50\nF=R5\nG0 X10\n%sG1 X12 F100\nG1 X14\nM30\n"
READING = {
    "an argument": (
        "linuxcnc",
        SUB % b"G1 X3 F50\nF#1\nG1 X4\n" + LINUXCNC % b"o10 call [#<_feed>]\n",
    ),
    "an argument, computed": ("linuxcnc", SUB % b"F#1\n" + LINUXCNC % b"o10 call [1+2*#<_FEED>]\n"),
    "what is returned": (
        "linuxcnc",
        b"o10 sub\no10 endsub [#<_feed>]\n" + LINUXCNC % b"o10 call\nF100\nF#<_value>\n",
    ),
    "how often": ("linuxcnc", LINUXCNC % b"o10 repeat [#<_feed>/100]\nG1 X1 F5\no10 endrepeat\n"),
    "kept by M73": ("linuxcnc", SUB % b"M73\nG1 X1 F100\n" + LINUXCNC % b"o10 call\n"),
    "kept by M70": ("linuxcnc", LINUXCNC % b"M70\nG1 X1 F100\nM72\n"),
    "a macro's argument": (
        "fanuc",
        FANUC % b"G65 P9000 A#4109\nG1 X12.\n" + b"O9000\nG1 X5. F50.\nF#1\nM99\n",
    ),
    "of the block that runs": ("fanuc", FANUC % b"#1=#4309\nG1 X5. F50.\nF#1\nG1 X6.\n"),
    "of the interrupted block": ("haas", FANUC % b"#1=#4509\nG1 X5. F50.\nF#1\nG1 X6.\n"),
    "Mitsubishi has the same numbers": (
        "mitsubishi",
        FANUC % b"#1=#4109\nG1 X5. F50.\nG1 X6. F#1\n",
    ),
    "a variable of the control": ("siemens", SIEMENS % b"R9=$P_F\nG1 X11 F100\nF=R9\n"),
    "a declared one": ("siemens", b"DEF REAL OLD\n" + SIEMENS % b"OLD=$P_F\nG1 X11 F90\nF=OLD\n"),
    "a jump": ("siemens", SIEMENS % b"IF $P_F>100 GOTOF DONE\nG1 X11 F90\nDONE:\n"),
    "Heidenhain reads it": (
        "klartext",
        b"BEGIN PGM A MM\nL X+0 Y+0 Z+50 R0 FMAX\nL X+1 FQ5\nL X+10 FMAX\n"
        b"FN 18: SYSREAD Q9 = ID20 NR9\nL X+11 F100\nL X+12 FQ9\nEND PGM A MM\n",
    ),
}
"""Each sets F again before it feeds; but what the rapid would leave as F is read before."""


@pytest.mark.parametrize("name", READING)
def test_who_reads_f_behind_a_rapid_needs_to_have_it_back(name):
    dialect, text = READING[name]
    assert last_rapid(text, dialect) == Reason.FEED_UNKNOWN


@pytest.mark.parametrize("name", READING)
def test_who_reads_nothing_does_not(name):
    dialect, text = READING[name]
    for read, other in (
        (b"#<_feed>", b"#<other>"), (b"#<_FEED>", b"#<other>"), (b"#4109", b"#4107"),
        (b"#4309", b"#4307"), (b"#4509", b"#4507"), (b"$P_F>", b"R1>"), (b"$P_F", b"R1"),
        (b"M73\n", b""), (b"M70\n", b""), (b"M72\n", b""),
        (b"FN 18: SYSREAD Q9 = ID20 NR9", b"FN 0: Q9 = 100"),
    ):  # fmt: skip
        text = text.replace(read, other)
    assert last_rapid(text, dialect) is None or name in ("how often", "a jump", "what is returned")
