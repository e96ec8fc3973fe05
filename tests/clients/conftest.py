"""The kit that runs LinuxCNC is no test: it needs Debian's own Python, or is started by LinuxCNC."""

collect_ignore = ["linuxcnc", "oracle.py"]
