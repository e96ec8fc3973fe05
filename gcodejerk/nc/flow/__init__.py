"""Flow: which block runs next, where it is not the next line.

`subprograms` follows M98 and M97, `o_words` LinuxCNC's loops, branches and subroutines, pass by
pass; `jumps` and `branches` forget where nothing can be followed; `outline` is the first look.
"""
