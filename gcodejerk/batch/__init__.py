"""Many programs in one run: the owner of worker processes, and of files in and out.

`inputs` says which programs the arguments of a command stand for, `jobs` does one or all of them,
`workers` have a program each, those of a `pool` work on one together; `processes` starts and ends
them, `signals` in order, and `files` lets an output appear in one move, or not at all. (The solver
of optima forks processes of its own, `planning.optima`: those share what is in memory, these are
started afresh.)
"""
