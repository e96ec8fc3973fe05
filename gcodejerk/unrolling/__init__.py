"""Loops, branches and calls written out: a program in, the same blocks in the order they run out.

`o_words` does it for LinuxCNC, structure by structure, `scripts` for whole programs of Siemens and
macro B, `spelling` writes numbers into the place of variables that have no meaning outside of their
subprogram, and `pieces` puts a file together.
"""
