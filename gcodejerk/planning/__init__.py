"""Planning: moves on a machine become profiles, profiles become streams.

`plan` decides for all moves of a program at once, `plans` holds what was decided, `designs` finds
the profiles of each kind, `conventional` says what the control does by itself, `optima` solves
each distinct problem once and keeps it in the `solution_cache`; `stream` makes the points that are
written. `move` is the library's way to one move, `refusals` says what a move breaks.
"""
