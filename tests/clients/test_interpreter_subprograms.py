"""Subprograms of LinuxCNC in files of their own, against its interpreter.

Every rapid of the program leads to an X of its own, by which its move is found among the
interpreter's; the files lie beside the program, where the interpreter looks for them.
"""

import io
import re
import shutil
import subprocess

import pytest

from gcodejerk.axes import AXES
from gcodejerk.nc import CERTAIN, Start, read_program

STARTUP = "G17 G21 G40 G49 G54 G64 G90 G94"
HOME = dict.fromkeys(AXES, 0.0)
START = Start(positions=HOME, offsets={"G54": HOME}, startup=STARTUP)
_MOVE = re.compile(r"STRAIGHT_(TRAVERSE|FEED)\(([-0-9.]+), ([-0-9.]+), ([-0-9.]+)")

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]
PROGRAMS = {
    "arguments": (
        "o<spot> call [3] [4]\nG0 X101 Y1\no<spot> call [2*3] [7]\nG0 X102 Y2\n",
        {"spot": "G0 X999\no<spot> sub\nG0 X#1 Y#2\nG1 Z-1\nG0 Z5\no<spot> endsub\nG0 X888\n"},
    ),
    "one calls the other": (
        "o<outer> call [2]\nG0 X101\no<outer> call [3]\nG0 X102 Y9\n",
        {
            "outer": "o<outer> sub\no<inner> call [#1 * 2]\nG1 Y#1\no<outer> endsub\n",
            "inner": "o<inner> sub\nG1 X#1\n#1=50\no<inner> endsub\n",
        },
    ),
    "globals and returns": (
        "#<_deep>=4\no<deep> call\nG0 X101 Z9\nG0 X107 Z4\n",
        {
            "deep": "o<deep> sub\nG1 Z[-#<_deep>]\n#<_deep>=6\no10 if [#<_deep> gt 5]\n"
            "o<deep> return\no10 endif\nG1 Z99\no<deep> endsub\n"
        },
    ),
    "modes stay": (
        "o<mode> call\nG0 X101 Y1\nG90 G0 X300\n",
        {"mode": "o<mode> sub\nG91\nG1 Y2\no<mode> endsub\n"},
    ),
    "by number, in a loop": (
        "#5=0\no7 while [#5 lt 3]\no200 call [#5]\n#5=[#5+1]\no7 endwhile\nG0 X101\n",
        {"200": "o200 sub\nG1 X#1 Y[#1+1]\no200 endsub\n"},
    ),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_rapids_behind_calls_start_where_the_interpreter_is(name, tmp_path):
    main, subs = PROGRAMS[name]
    text = f"{STARTUP} F100\nG0 X100 Y0 Z5\n{main}M2\n"
    path = tmp_path / "part.ngc"
    path.write_text(text)
    for sub, body in subs.items():
        (tmp_path / f"{sub}.ngc").write_text(body + "M2\n")
    done = subprocess.run(
        ["rs274", "-g", "part.ngc"], cwd=tmp_path, capture_output=True, text=True, check=False,
        timeout=20,
    )  # fmt: skip
    places, at = {}, (0.0, 0.0, 0.0)
    for kind, *ends in _MOVE.findall(done.stdout):
        end = tuple(map(float, ends))
        if kind == "TRAVERSE":
            assert end[0] not in places or end[0] < 100.0
            places[end[0]] = at, end
        at = end
    files = {f"{sub}.ngc": body.encode() for sub, body in subs.items()}
    start = Start(
        positions=START.positions, offsets=START.offsets, startup=STARTUP, subprograms=files
    )
    program = read_program(io.BytesIO(text.encode()), dialect="linuxcnc", start=start)
    rapids = program.rapids
    assert (rapids.reason == CERTAIN).all(), program.findings
    assert set(program.subprograms) == set(files)
    for i in range(len(rapids)):
        before, after = places[float(rapids.target[i, 0])]
        assert rapids.start[i, :3] == pytest.approx(before, abs=1e-4)
        assert rapids.target[i, :3] == pytest.approx(after, abs=1e-4)
    # without the files, and with other ones, the same rapids are not known, or elsewhere
    bare = read_program(io.BytesIO(text.encode()), dialect="linuxcnc", start=START).rapids
    assert (bare.reason[1:] != CERTAIN).all()
