"""Searches: for each kind of profile, the member of its family that leaves the modes most still.

`condition3` chooses T1 as the paper has it, `ramps` all that is free where there are more segments
than four; `conditions` chooses T1 for the other two families, `cascade` chooses boxes, and
`optimal` every jerk of a `unit_move` on the command grid, by the cone programmes of `socp`
(`together` of several moves), or by `cutting` planes: in which blocks, `knots` says, which
frequencies they know, `looked_at`, and `guard` what those may keep that nobody named. That a move
can be perfectly still, `nulls` shows of many at once. All others are judged by the one `objective`,
evaluate `candidates` by the thousand, and take moves in `rows`.
"""
