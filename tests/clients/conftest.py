"""The kit that runs LinuxCNC is no test: LinuxCNC starts parts of it with Python of its own."""

import sys
from pathlib import Path

# For `interpreter`, which several tests share.
sys.path.insert(0, str(Path(__file__).resolve().parent))

collect_ignore = ["linuxcnc", "freecad", "oracle.py"]
