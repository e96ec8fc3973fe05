"""How a machine with its drives and its structure follows its commands.

`bodies` and `equations` make the equations of motion, `response` solves them exactly, `friction`
with dry friction; `reduction` finds the modes that planning needs; `moves` and `programs` are what
the command `simulate` shows.
"""
