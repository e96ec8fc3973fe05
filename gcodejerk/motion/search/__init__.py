"""Searches: for each kind of profile, the member of its family that leaves the modes most still.

`condition3` chooses T1 as the paper has it; `conditions` does so for the other two families,
`cascade` chooses boxes, and `optimal` every jerk on the command grid, by the cone programmes of
`socp`. All are judged by the one `objective`, and take moves in `rows`.
"""
