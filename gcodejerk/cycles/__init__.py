"""Drilling cycles written out: a program in, the same program with explicit moves out.

`series` says which cycles are certain, `drilling` what each does on the way, `expansion` replaces
them, and `called` does all that for cycles with a name.
"""
