"""Blocks as a planner with a servo period runs them (LinuxCNC): their ends, and what is played.

Numbers in, arrays out, as all of `motion`. Facts about LinuxCNC 2.9 were measured on it and read in
its source; `docs/linuxcnc.md` says which.
"""
