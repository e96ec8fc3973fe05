"""Files of rows for motion controllers, read back and judged with nothing from their emitters.

`readers` turn a file into moves, `motion` makes the cubics between their rows, `judge` holds these
to the program and the machine.
"""
