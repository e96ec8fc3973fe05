"""Where a program's flow leads, followed a second time, against the same program written out."""
