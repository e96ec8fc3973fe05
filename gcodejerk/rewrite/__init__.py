"""The main job: a program in, the same program with its rapids re-timed out, from bytes to bytes.

`pipeline` runs the steps in their order, `rewriter` puts streams in the place of blocks, `stamp`
says at the top of an output what it is, `expanded` is the way to programs with their drilling
cycles written out and back, `foreign` refuses what is no program.
"""
