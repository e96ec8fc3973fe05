"""Drilling cycles written out: a program in, the same program with explicit moves out.

`series` says which cycles are certain, `drilling` what each does on the way, `expansion` replaces
them and keeps the map of lines that leads back to the original.
"""
