"""The kit that runs LinuxCNC is no test: LinuxCNC starts parts of it with Python of its own."""

collect_ignore = ["linuxcnc", "oracle.py"]
