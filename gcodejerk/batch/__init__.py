"""Many programs in one run: the only owner of processes, and of files in and out.

`inputs` says which programs the arguments of a command stand for, `jobs` does one or all of them,
`workers` are the processes, and `files` lets an output appear in one move, or not at all.
"""
