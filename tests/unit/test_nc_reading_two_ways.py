"""The quick way and the careful way through a program give the same columns, on every real file."""

from pathlib import Path

import pytest

from gcodejerk.nc import AXES, Start
from gcodejerk.testing.programs import differences

SHARED = Path(__file__).resolve().parents[2].parent / "shared"
FOLDERS = [
    SHARED / "hosts" / "nc",
    SHARED / "hosts" / "nc_invalid",
    SHARED / "corpus",
    Path("/usr/share/linuxcnc"),
    Path("/usr/share/doc/linuxcnc"),
]
ENDINGS = (".ngc", ".nc", ".gcode", ".mpf", ".h")
STARTS = {
    "nothing known": Start(),
    "all known": Start(
        positions=dict.fromkeys(AXES, 1.0),
        offsets={"G54": dict.fromkeys(AXES, 2.0)},
        tool_lengths={1: 10.0},
        startup="G17 G21 G40 G49 G54 G64 P0.01 G90",
    ),
}


def real_files(folder):
    return [p for p in sorted(folder.rglob("*")) if p.suffix.lower() in ENDINGS and p.is_file()]


@pytest.mark.parametrize("start", STARTS.values(), ids=STARTS)
@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_both_ways_agree_on_every_real_file(folder, start):
    files = real_files(folder) if folder.exists() else []
    if not files:
        pytest.skip(f"no programs in {folder.name}: it is not on this machine")
    for path in files:
        data = path.read_bytes()
        if data:
            assert differences(data, start) == [], path
