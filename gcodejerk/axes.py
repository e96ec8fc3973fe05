"""The letters of axes: one definition for programs, machines and everything that joins them."""

AXES = "XYZABCUVW"
"""Every axis letter, in the order in which axes are listed, written and reported. Columns of arrays
with one entry for each axis are in this order too."""
