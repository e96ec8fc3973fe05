"""Drilling cycles written out: a program in, the same program with explicit moves out.

`series` says which cycles are certain, `drilling` what each does on the way, `expansion` replaces
them, and `line_map` leads back to the original.
"""
