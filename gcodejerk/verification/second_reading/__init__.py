"""A second interpreter of programs, which shares nothing with `nc` but the dialects' tables.

`reading` and `sorting` take lines apart, `known` is what is known between two of them, `coding` and
`tracking` say what a line does; `agreement` holds all that against the first reading.
"""
