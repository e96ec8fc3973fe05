"""Knowing again after not knowing: what a block can touch, and since when what is unknown."""

import io
import random

import pytest

from gcodejerk.nc import DIALECTS, Start, read_program
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm, observations

POSITIONS = {"X": 0.0, "Y": 0.0, "Z": 0.0}
STARTUP = {
    **dict.fromkeys(("fanuc", "haas", "mach", "linuxcnc", "grbl"), "G17 G21 G90 G94"),
    **{"siemens": "G17 G71 G90 G94 G64", "fanuc-lathe-a": "G21 G98"},
}


def start_of(dialect, **more):
    lathe = dialect == "fanuc-lathe-a"
    return Start(positions=POSITIONS, startup=STARTUP[dialect], diameter=lathe, **more)


def read(text, dialect, **more):
    """What each rapid is left alone for, None where it is certain; and the notes.

    The second reading has to confirm every certain one.
    """
    start = start_of(dialect, decimal_point="calculator", spindle="mill", **more)
    program = read_program(io.BytesIO(text), dialect=dialect, start=start)
    reason = program.rapids.reason.tolist()
    certain = [i for i, r in enumerate(reason) if r == CERTAIN]
    found = Findings(9)
    confirmed = confirm(io.BytesIO(text), dialect, start, program.rapids, certain, found)
    assert not found.violations
    assert confirmed == len(certain)
    notes = [f.message for f in program.findings]
    return [None if r == CERTAIN else str(REASONS[r]) for r in reason], notes


# --- groups that a dialect does not have ---


@pytest.mark.parametrize(
    ("dialect", "fixed"),
    [
        ("grbl", {"compensation", "path"}),
        ("marlin", {"compensation", "path"}),
        ("klipper", {"units"}),
    ],
)
def test_a_group_of_one_code_is_never_unknown(dialect, fixed):
    table = DIALECTS[dialect]
    lone = {
        group
        for group, code in table.defaults.items()
        if {c for c, g in table.groups.items() if g == group} <= {code}
    }
    assert fixed <= lone
    assert "distance" not in lone


def test_grbl_has_no_cutter_compensation_to_be_unknown():
    found, notes = read(b"G123\nG90 G21 G94\nG0 X1 Y1 Z1\nG0 X5\n", "grbl")
    assert found == ["start unknown", None]
    assert any("G123" in note for note in notes)


@pytest.mark.parametrize(
    ("line", "after"),
    [
        (b"G64", None),
        (b"%", None),
        (b"T1 M6", None),
        (b"G43 H1", None),
        (b"M62 P1", None),
        (b"G64 G91", "distance mode unknown"),
        (b"G64 G20", "units unknown"),
        (b"G41 D1", "cutter compensation active"),
        (b"G41 D1\nG40", "cutter compensation active"),
        (b"G51 X2 Y2", "rotation, scaling, mirroring or polar active"),
        (b"G7", "start unknown"),
        (b"G65 P1", "distance mode unknown"),
        (b"G66 P1", "rapid inside a canned cycle"),
    ],
)
def test_what_plain_grbl_refuses_and_others_run_is_reckoned_both_ways(line, after):
    text = line + b"\nG0 X1 Y1 Z1\nG0 X5\n"
    if after == "cutter compensation active" and b"G40" in line:
        after = None  # ended on both
    found, notes = read(text, "grbl")
    assert found[-1] == after
    assert found[-2] == ("start unknown" if after is None else after)
    assert notes


@pytest.mark.parametrize(
    ("block", "after"),
    [
        # by grbl 1.1's own gc_execute_line: run and not moving, or refused; others move
        (b"G49 X3", "start unknown"),
        (b"G1 G49 X3", "start unknown"),
        (b"X3 A5", "start unknown"),
        (b"T300 X3", "start unknown"),
        (b"T-1 X3", "start unknown"),
        (b"G10 G91", "distance mode unknown"),
        (b"G91 I5", "distance mode unknown"),
        (b"G80 G0 X3", "start unknown"),
        (b"G43.1 G91", "distance mode unknown"),
        (b"G80\nG92 X3\nG0", "start unknown"),
        (b"G1 F0 G38.2 G91 X3", "distance mode unknown"),
    ],
)
def test_words_that_plain_grbl_refuses_and_others_run_are_reckoned_both_ways(block, after):
    text = b"G0 X1 Y1 Z1 F100\n" + block + b"\nG0 X7\n"
    found, notes = read(text, "grbl")
    assert found[-1] == after
    assert notes
    start = start_of("grbl", spindle="mill")
    ((_, seen),) = observations(io.BytesIO(text), find_dialect("grbl"), start, [text.count(b"\n")])
    assert not seen.sure or seen.start[0] != seen.start[0] or seen.modes["incremental"] is None
    plain, _ = read(b"G0 X1 Y1 Z1 F100\nG49\nG1 X3\nT25\nG0 X7\n", "grbl")
    assert plain[-1] is None


def test_an_axis_that_the_machine_has_is_refused_by_nobody():
    limits = dict.fromkeys("XYZA", (100.0, 1000.0, 10000.0))
    found, _ = read(b"G0 X1 Y1 Z1 A0\nX3 A5\nG0 X7\n", "grbl", limits=limits)
    assert found[-1] is None


def test_a_rapid_beside_a_code_that_may_be_refused_is_left_alone():
    found, notes = read(b"G0 X1\nG64 G0 X5\nX7\nG0 X9\n", "grbl")
    assert found == [None, "block not understood", "start unknown", None]
    assert any("refuse G64" in note for note in notes)


def test_who_says_that_nobody_moves_the_axes_knows_where_they_stand():
    found, _ = read(b"G0 X1\nG64\nG0 X9\n", "grbl", resume="same")
    assert found == [None, None]
    found, _ = read(b"G0 X1\nT1 M6\nG0 X9\n", "grbl", resume="same")
    assert found == [None, "start unknown"]


# --- the reason is the true one ---


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"G999", "block not understood"),
        (b"G65 P9000", "behind a call, jump or loop that is not followed"),
        (b"G41 D1", "cutter compensation active"),
        (b"/G41 D1", "cutter compensation active"),
    ],
)
def test_the_reason_names_what_made_compensation_unknown(line, reason):
    found, notes = read(line + b"\nG90 G21 G17 G54 G94\nG0 X1.\n", "fanuc")
    assert found == [reason]
    since = [note for note in notes if "since this line" in note]
    assert len(since) == (b"G41" not in line)
    assert all(line.decode() in note for note in since)


def test_compensation_that_is_stated_again_is_known_again():
    lost = b"G999\n"
    text = lost + b"G90 G21 G17 G40 G54 G94\nG0 X1. Y1. Z1.\nG0 X5.\n"
    assert read(text, "fanuc")[0] == ["start unknown", None]
    # and a later doubt is not put down to the earlier line
    text += b"/G41 D1\nG0 X7.\n"
    found, notes = read(text, "fanuc")
    assert found[-1] == "cutter compensation active"
    assert not any("since this line" in note for note in notes)


def test_what_a_block_that_may_be_skipped_makes_unknown_has_its_line():
    found, notes = read(b"F90.\nG0 X1.\n/G999\nG0 X5.\n", "fanuc")
    assert found == [None, "block not understood"]
    assert any("since this line (/G999): 1 rapid " in note for note in notes)


# --- the line of % ---


@pytest.mark.parametrize("head", [b"%O1200(TITLE)", b"% O1200 (A) (B)", b"%(TITLE", b"%:12"])
def test_what_stands_on_the_first_line_behind_a_percent_is_not_read(head):
    text = head + b"\nG0 X10. Z5.\nG0 X20.\nM30\n%\n"
    assert read(text, "fanuc-lathe-a")[0] == [None, None]
    assert read(text, "fanuc")[0] == [None, None]


@pytest.mark.parametrize("head", [b"%G91", b"%O1200 G91", b"%M98P1"])
def test_code_behind_a_percent_is_not_taken_for_a_title(head):
    assert read(head + b"\nG0 X10.\n", "fanuc")[0] != [None]


def test_a_percent_behind_comments_opens_the_program():
    text = b"(a)\n(b)\n\n%\nG0 X1\nG0 X5\n%\nG0 X7\n"
    found, notes = read(text, "linuxcnc")
    assert found == [None, None, "after the end of the program"]
    assert any("first line" in note for note in notes)
    assert read(b"G0 X1\n%\nG0 X5\n", "linuxcnc")[0][-1] == "block not understood"


# --- a lathe's diameters ---


def test_no_code_that_is_not_known_changes_whether_x_is_a_diameter():
    text = b"G123\nG18 G21 G40 G98 G54\nG0 X10. Z5.\nG0 X20.\n"
    assert read(text, "fanuc-lathe-a")[0] == ["start unknown", None]


def test_the_one_code_that_changes_it_leaves_rapids_alone():
    text = b"G10.9 X0.\nG18 G21 G40 G98 G54\nG0 X10. Z5.\nG0 X20.\n"
    found, _ = read(text, "fanuc-lathe-a")
    assert found == ["rotation, scaling, mirroring or polar active"] * 2


# --- codes that move nothing ---


@pytest.mark.parametrize("code", [b"M31", b"M33", b"M88", b"M89", b"M83"])
def test_haas_codes_that_move_nothing_leave_everything_known(code):
    assert read(code + b"\nG0 X5.\n", "haas")[0] == [None]
    assert read(code + b" G0 X5.\n", "haas")[0] != [None]
    assert read(code + b"\nG0 X5.\n", "fanuc")[0] == ["start unknown"]


@pytest.mark.parametrize("code", [b"M39", b"M16", b"M51", b"M21"])
def test_haas_codes_that_move_or_start_anything_do_not(code):
    assert read(code + b"\nG0 X5.\n", "haas")[0] == ["start unknown"]


def test_the_machine_file_declares_codes_harmless():
    harmless = frozenset({"M150", "G187"})
    text = b"G0 X1.\nM150 P2\nG187 P3 E0.01\nG0 X5.\n"
    assert read(text, "fanuc", harmless=harmless)[0] == [None, None]
    assert read(text, "linuxcnc", harmless=frozenset({"M450", "G187"}))[0][1] is not None
    assert read(text, "fanuc")[0][1] is not None
    # whose axis words these are, nobody knows
    assert read(b"G187 X3.\nG0 X5.\n", "fanuc", harmless=harmless)[0] != [None]
    # what the table knows keeps its meaning
    assert read(b"G28 X0.\nG0 X5.\n", "fanuc", harmless=frozenset({"G28"}))[0][-1] is not None


# --- Siemens ---


@pytest.mark.parametrize(
    "line",
    [
        b"FNORM",
        b"WAITM(1,1,2)",
        b"DEF REAL DEPTH, _WIDE=2.5\nDEPTH=4 _WIDE=3",
        b"DEF STRING[9] TXT",
    ],
)
def test_siemens_words_that_touch_nothing(line):
    assert read(line + b"\nG0 X5\n", "siemens")[0] == [None]


@pytest.mark.parametrize("line", [b"DEPTH=4", b"DEF AXIS DEPTH\nDEPTH=4", b"DEF REAL A1\nMYSUB"])
def test_siemens_names_that_nobody_declared_may_be_anything(line):
    assert read(line + b"\nG0 X5\n", "siemens")[0] != [None]


def test_supa_holds_for_its_block_alone():
    found, _ = read(b"G0 X1\nG0 SUPA Z9\nG0 X5\nG0 Z3\nG0 Z4\n", "siemens")
    changes = "coordinate frame changes in the block"
    assert found[:2] == [None, changes]
    assert found[3:] == ["start unknown", None]


def test_cycle800_without_arguments_turns_the_plane_back():
    turned = "rotation, scaling, mirroring or polar active"
    text = b'CYCLE800(1,"TC",0)\nG0 X1 Y1 Z1\nG0 X5\nCYCLE800()\nG0 X1 Y1 Z1\nG0 X5\n'
    assert read(text, "siemens")[0] == [turned, turned, "start unknown", None]


# --- a first reading that takes such a block for nothing is not believed ---

MISTAKEN = [
    *[("grbl", line) for line in (b"G41 D1", b"G51 X2", b"G64 G91", b"G66 P1", b"T1 M6", b"G7")],
    *[("siemens", line) for line in (b"SUPA X7", b'CYCLE800(1,"A")', b"DEPTH=4", b"CYCLE800()")],
    *[("haas", line) for line in (b"M39", b"M51", b"M16")],
    *[("fanuc-lathe-a", line) for line in (b"G10.9 X0.", b"G123")],
    *[("fanuc", line) for line in (b"%G91", b"M150", b"G187")],
]


def judged(believed, text, dialect, rapid):
    """What the second reading of a text says of a rapid that was read in another one."""
    start = start_of(dialect, decimal_point="calculator", spindle="mill")
    rapids = read_program(io.BytesIO(believed), dialect=dialect, start=start).rapids
    assert rapids.reason[rapid] == CERTAIN
    found = Findings(9)
    confirmed = confirm(io.BytesIO(text), dialect, start, rapids, [rapid], found)
    return confirmed, found.violations


@pytest.mark.parametrize(("dialect", "line"), MISTAKEN)
def test_what_may_move_or_change_a_mode_is_not_confirmed_as_nothing(dialect, line):
    head = b"G0 X1. Z1. F90.\n"
    believed, text = head + b"\nG0 X5.\nM30\n", head + line + b"\nG0 X5.\nM30\n"
    assert judged(believed, believed, dialect, 1)[0] == 1
    assert judged(believed, text, dialect, 1)[0] == 0


@pytest.mark.parametrize(
    ("dialect", "block"), [("grbl", b"G64 G0 X5."), ("siemens", b"G0 SUPA X5.")]
)
def test_a_rapid_beside_such_a_word_is_refused(dialect, block):
    believed, text = b"F90\nG0 X5.\nM30\n", b"F90\n" + block + b"\nM30\n"
    confirmed, violations = judged(believed, text, dialect, 0)
    assert confirmed == 0
    assert [v.original_line for v in violations] == [2]


def test_what_a_refused_block_leaves_unknown_is_not_called_compensation():
    reasons, notes = read(b"F9 G0 X1\nFOO P2\nG0 X2\nG5 P9 X4\nG0 X3\nM30\n", "siemens")
    assert reasons[:2] == [None, "behind a call, jump or loop that is not followed"]
    assert "cutter compensation active" not in reasons
    assert not any("refuse" in note for note in notes if "FOO" in note)
    reasons, _ = read(b"G0 X1 F9\nG1 G41 X1. X2.\nG0 X2\nM30\n", "fanuc")
    assert reasons == [None, "block not understood"]


# --- a code beside G80, and a system that only one reader still knows ---


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "mach"])
def test_beside_g80_the_other_code_of_its_group_counts_for_both_readers(dialect):
    text = b"G0 X1. F9.\nG90 G80 G0 X2.\nG0 G80\nX3.\nM30\n"
    assert read(text, dialect)[0] == [None, None, None]


def test_two_codes_of_a_group_are_still_no_rapid():
    reasons, _ = read(b"G0 X1. F9.\nG0 G1 X2.\nG0 X3.\nM30\n", "linuxcnc")
    assert reasons[0] is None
    assert reasons[1:] == ["block not understood", "start unknown"]


# --- threads ---


class Lathe:
    """Runs G0, G1, G32 and G33 with X as a diameter, and U and W as increments."""

    def __init__(self):
        self.x, self.z = 0.0, 0.0

    def block(self, words):
        before = (self.x, self.z)
        self.x += words.get("U", 0.0) / 2.0
        self.x = words["X"] / 2.0 if "X" in words else self.x
        self.z = words.get("Z", self.z + words.get("W", 0.0))
        return before, (self.x, self.z)


@pytest.mark.parametrize(("dialect", "thread"), [("fanuc-lathe-a", 32), ("fanuc-lathe-b", 33)])
def test_a_thread_ends_where_it_says(dialect, thread):
    """Drawn threads, each of one to three passes of G32 or G33, and the ways back."""
    draw = random.Random(thread)
    control, text, expected = Lathe(), ["G0 X50. Z2. F9."], {}
    control.block({"X": 50.0, "Z": 2.0})
    for _ in range(40):
        code = draw.choice([0, 0, 1, thread, thread])
        names = draw.sample(["X", "Z"], draw.randint(1, 2))
        if dialect == "fanuc-lathe-a":
            names = [draw.choice([n, {"X": "U", "Z": "W"}[n]]) for n in names]
        words = {name: draw.randint(-40, 60) / 4.0 for name in names}
        before, after = control.block(words)
        lead = " F1.5" if code == thread else ""
        text.append(f"G{code} " + " ".join(f"{n}{v:.2f}" for n, v in words.items()) + lead)
        if code == 0 and before != after:
            expected[len(text)] = before, after
    data = "\n".join([*text, "M30", ""]).encode()
    feed = "G99" if dialect == "fanuc-lathe-a" else "G90 G95"
    start = Start(positions=POSITIONS, startup=f"G21 G18 G40 {feed}", diameter=True)
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    certain = [i for i, r in enumerate(rapids.reason.tolist()) if r == CERTAIN]
    assert {int(rapids.line[i]) for i in certain} >= set(expected)
    for i in certain:
        if (line := int(rapids.line[i])) in expected:
            before, after = expected[line]
            named = [k for k in (0, 2) if rapids.words[i] >> k & 1]
            for k in named:
                assert rapids.start[i, k] == pytest.approx(before[k // 2])
                assert rapids.target[i, k] == pytest.approx(after[k // 2])
    found = Findings(99)
    assert confirm(io.BytesIO(data), dialect, start, rapids, certain, found) == len(certain)
    assert not found.violations
    # a start that is wrong behind a thread is noticed
    behind = next(
        i for i in certain
        if text[rapids.line[i] - 2].startswith(f"G{thread} ") and rapids.words[i] & 1
    )  # fmt: skip
    rapids.start[behind, 0] += 0.1
    confirm(io.BytesIO(data), dialect, start, rapids, [behind], found)
    assert found.violations


# --- the spindle of a word, in LinuxCNC ---


@pytest.mark.parametrize("words", [b"M3 $0 S100", b"m5$-1", b"S7 M4 $ 1.", b"$0 M3 S1"])
def test_a_spindle_is_a_word_of_linuxcnc(words):
    text = b"F9 G0 X1 Z1\n" + words + b"\nG0 X2\nM2\n"
    assert read(text, "linuxcnc")[0] == [None, None]
    # other controls refuse it, and who refuses may be led on by hand
    assert read(text, "mach")[0] != [None, None]


@pytest.mark.parametrize("words", [b"M3 $#5", b"M3 $1 2", b"$ M3"])
def test_what_is_no_number_of_a_spindle_is_not_understood(words):
    reasons, notes = read(b"F9 G0 X1\n" + words + b"\nG0 Z2\nM2\n", "linuxcnc")
    assert reasons[1] is not None or any("not understood" in note for note in notes)


def test_beside_a_spindle_a_rapid_stays_as_it_is():
    reasons, _ = read(b"F9 G0 X1\nG0 X2 M3 $0\nG0 X3\nM2\n", "linuxcnc")
    assert reasons == [None, "other words of the block cannot keep their order", None]


COMPENSATED = b"G0 X0. Y0. Z5.\nG41 D1 G1 X1. Y1.\nX5. Y5.\n"
NO_LENGTH = [
    *(
        b"G40\nG1 X5. Y5.\n",
        b"G40 G1 X5. Y5.\n",
        b"G40\nG1 Y5.\nX5.\n",
        b"G40\nG91 G1 X0. Y0.\nG90\n",
    ),
    *(b"G40\nG1 Z9.\n", b"G40\nG0 X5. Y5.\n"),
]
LENGTH = [b"G40\nG1 X6. Y5.\n", b"G40 G1 X5. Y4.\n", b"G40\nG91 G1 X1.\nG90 X3. Y3.\n"]


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "siemens"])
@pytest.mark.parametrize("ends", [*NO_LENGTH, *LENGTH])
def test_g40_is_done_with_a_move_that_has_a_length(dialect, ends):
    modes = b"G710 G90 G94 G17 G40" if dialect == "siemens" else b"G21 G90 G94 G17 G40 G49 G80"
    head = modes + b" G54 G64 F100.\n" + COMPENSATED
    start = Start(decimal_point="calculator")
    text = head + ends + b"G0 X9. Y9.\n"
    rapids = read_program(io.BytesIO(text), dialect=dialect, start=start).rapids
    lines = [int(rapids.line[-1])]
    ((_, seen),) = observations(io.BytesIO(text), find_dialect(dialect), start, lines)
    certain = ends in LENGTH
    assert (rapids.reason[-1] == CERTAIN) == certain
    assert (seen.sure and seen.start[0] == seen.start[0]) == certain
