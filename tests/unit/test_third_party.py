"""A controller of another package, as `docs/controllers.md` shows it: installed, listed, used."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = (ROOT / "docs" / "controllers.md").read_text(encoding="utf-8")
PROGRAM = "G21 G90 G94 G64\nG0 X0 Y0 Z5\nG0 X40.\nG1 X41. F100.\nG0 X2.\nG1 X3.\nM2\n"


def installed(folder):
    """What an installer leaves of the documented package: the module, and its metadata."""
    toml = re.search(r"```toml\n(.*?)```", DOCS, flags=re.DOTALL).group(1)
    code = re.search(r"```python\n(.*?)```", DOCS, flags=re.DOTALL).group(1)
    name = re.search(r'^name = "(.*)"', toml, flags=re.MULTILINE).group(1)
    version = re.search(r'^version = "(.*)"', toml, flags=re.MULTILINE).group(1)
    entry = re.search(r"^acme = .*", toml, flags=re.MULTILINE).group(0).replace('"', "")
    (folder / "gcodejerk_acme.py").write_text(code)
    about = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (about / "entry_points.txt").write_text(f"[gcodejerk.controllers]\n{entry}\n")


def run(folder, *arguments):
    """The command in a folder, with the package beside ours."""
    here = os.environ | {"PYTHONPATH": str(folder), "COLUMNS": "120"}
    return subprocess.run(
        [sys.executable, "-m", "gcodejerk.cli", *arguments],
        cwd=folder, env=here, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_the_documented_package_works(tmp_path):
    installed(tmp_path)
    (tmp_path / "part.ngc").write_text(PROGRAM)
    listed = run(tmp_path, "controllers")
    assert re.search(r"^ acme +stream +unverified", listed.stdout, flags=re.MULTILINE)
    done = run(tmp_path, "process", "part.ngc", "-m", "vmc", "--controller", "acme")
    assert done.returncode == 0, done.stderr
    assert "G1 X" in (tmp_path / "part.jerk.ngc").read_text()
    tuned = run(
        tmp_path, "parameters", "part.ngc", "-m", "vmc", "--controller", "acme", "-o", "acme.txt"
    )
    assert tuned.returncode == 0, tuned.stderr
    sheet = (tmp_path / "acme.txt").read_text()
    assert re.search(r"^P77 X [0-9]+\.[0-9]{2}$", sheet, flags=re.MULTILINE)
    assert "2026, p. 12" in sheet
    assert re.search(r"^; to go back:\nP77 X 4\.00$", sheet, flags=re.MULTILINE)
