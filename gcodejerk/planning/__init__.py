"""Planning: moves on a machine become profiles, profiles become streams.

`rapids` makes moves of a program's rapids, `plan` decides for all of them at once, `plans` holds
what was decided. A `task` is moves as a design gets them, with the measure that all are judged by;
`designs` finds the profiles of each kind, `conventional` says what the control does by itself,
`optima` solves each distinct problem once and keeps it in the `solution_cache`; `stream` makes the
points that are written. `move` is the library's way to one move, `refusals` says what a move
breaks.
"""
