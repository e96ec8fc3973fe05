"""Lines by variables that the second reader takes many at a time: as it takes them one by one."""

import random

import pytest

from gcodejerk.nc import DIALECTS, Start
from gcodejerk.verification.second_reading import agreement, ahead
from gcodejerk.verification.second_reading.reading import Text
from gcodejerk.verification.second_reading.stepping import Stepper
from gcodejerk.verification.second_reading.straight import PlainLines

RUNS = [
    *("#1=%d.", "#2=[#1*2.5]", "#3=[#3+1]", "#1=#2", "#2=5.", "#1=%.3f", "N10 #1=1.", "(rest)"),
    *("G0 X[#1+#2]", "G1 Y[#1*2.] F100.", "G0 X#1 Z[-#1]", "G0 Z[5.0-#1]", "X#1", "G0 X-#2"),
    *("#1 = 2. (so)", "G0 X%.3f Y#1", "G0 X%.1f", "G0 X%.1f Y%.2f Z[#1+%d.]", "G1 Z[0-#1/2.] F%d"),
    *("", "G1 Z-3.25"),
]  # fmt: skip
DOUBTS = [
    *("#4=#5221", "#2=[1/0]", "#0=1", "#[#1]=2", "#5221=1", "#3004=1", "#3003=0", "#4109=3", "G21"),
    *("#1=1. #2=#1", "#1=1. G0 X1.", "/#1=2", "#5=[#1/3]", "G1 X#1 F#4", "G0 Y#9", "G0 X[#1/3]"),
    *("G0X[ROUND[#1]]", "G#1 X1.", "F#1", "G0 A#1", "G0 X[#1] X1.", "M#1", "N#1 G0 X1.", "S#1"),
    *("G0 X#<depth>", "#<depth>=4.", "G65 P9 A1.", "M6 T1", "G91", "G90", "G20", "G92 X#1", "U#1"),
    *("G0 X+#1 Y--#1", "G0 Y[#1 EQ 5.]", "G1 X5", "Z1E#1", "G0 X#3 Y#2", "G53 Z#1", "G64", "G4 P1"),
    *("G81 X%.1f Z-2. R1. F50", "G80", "G41 D1", "G40", "G68 X0 Y0 R9", "G69", "M98 P1", "g0 x#1"),
]  # fmt: skip


def filled(form, rng):
    return form % tuple(rng.uniform(1, 90) for _ in range(form.count("%")))


def drawn(rng):
    known = ["G21 G90 G94 G17 G40 G49 G80", "G0 X0. Y0. Z5.", "F100.", "#1=5.", "#2=1.", "#3=2."]
    lines = []
    for _ in range(12):
        lines += known
        for _ in range(rng.choice((1, 1, 3))):
            lines += [filled(rng.choice(RUNS), rng) for _ in range(rng.choice((5, 40, 80)))]
            lines += [filled(rng.choice(DOUBTS), rng) for _ in range(rng.choice((0, 1, 1, 2)))]
    return rng.choice(("\n", "\r\n")).join([*lines, ""]).encode()


def same(a, b):
    return repr(a) == repr(b)


@pytest.mark.parametrize("name", ["linuxcnc", "fanuc", "haas", "mach"])
def test_lines_by_variables_taken_at_once_do_what_they_do_one_by_one(name, monkeypatch, request):
    taken = 0
    for seed in range(300 if request.config.getoption("--long") else 9):
        rng = random.Random(f"{name} {seed}")
        monkeypatch.setattr(ahead, "MOST", rng.choice((16, 1 << 10)))
        taken += compared(name, drawn(rng))
    assert taken > 60


def compared(name, data):
    """Follow lines both ways; how many were taken that have no place among plain ones."""
    dialect = DIALECTS[name].set_up(Start())
    decimals = dialect.whole_numbers == "machine"
    text = Text(dialect, decimals)
    stepper, plain = Stepper(text, dialect), PlainLines(dialect, decimals)
    tracker, careful = (agreement._begin(text, dialect, Start()) for _ in range(2))
    runs = []

    def agrees(run, numbers, at):
        runs.append((run, numbers))
        return True

    lines = ahead.Ahead(stepper, tracker, plain, agrees)
    at, number, taken = 0, 1, 0
    while at < len(data):
        found = lines.take(data, at, number)
        behind = data.index(b"\n", at) + 1 if found is None else found[1]
        said = data[at:behind].splitlines()
        seen = [stepper.step(careful, line) for line in said]
        if found is None:
            stepper.step(tracker, said[0])
        else:
            assert found[0] == number + len(said)
            run, numbers = runs[-1]
            taken += len(said) - len(run)
            own = (numbers[: len(run)] - number).tolist()
            for k, line in enumerate(own):
                one = seen[line]
                assert same(one.start[:3], run.start[k].tolist()), said[line]
                assert same(one.end[:3], run.end[k].tolist()), said[line]
                assert one.axes == run.axes[k]
                assert (one.against is None) == run.rapid[k] == one.sure
                assert same(one.modes["F"], float(run.feed[k]))
            assert not any(one.sure for k, one in enumerate(seen) if k not in own)
        assert {k: repr(v) for k, v in vars(tracker).items()} == {
            k: repr(v) for k, v in vars(careful).items()
        }, said[-1]
        at, number = behind, number + len(said)
    return taken
